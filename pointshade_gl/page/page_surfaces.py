"""The surfaces of a page, read from the GPU. Of several noisy frames of one thing each part is from the frame that sees
it best, and is the mean of all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import gcd, lcm
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..estimation.multi_view import nearest_others
from ..gpu.core.images import read_texture
from ..gpu.core.view_images import Drawable
from ..gpu.meshes.mesh_objects import ShownGrid
from ..gpu.points.point_objects import Points, ShownPoints, ShownSet
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.values import linear_to_bytes, srgb_to_linear
from ..scene.visible import bridged_stride

MISSING, POINT, RIM = 0, 1, 2  # what a pixel of a surface is
OVERLAP = 2  # pixels by which parts reach over one another, so that no seam gapes
FIRST_WEIGHT = 3  # times the weight that the first frame has: a page begins where its camera stood
MIN_GOODNESS = 1e-3  # of what is good, for every point
MEAN_POWER = 2  # to which power of their weights frames share in a mean: the best ones decide
MIN_NORMALS_COSINE = 0.17  # least cosine between normals of one surface
RIM_PIXELS = 2  # pixels beside the known ones that are kept: rims look so far

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Numbers = NDArray[np.intp]


class PageSurface(NamedTuple):
    """The points of a frame, cut out of its picture."""

    normals: NDArray[np.float32]  # (h, w, 3)
    depth: NDArray[np.float32]  # (h, w), 0 where nothing is known, negative at rims
    colors: NDArray[np.uint8]  # (h, w, 3), or of another size that covers the same part of the picture
    certainty: NDArray[np.float32] | None  # of the normals, a smaller picture
    sizes: NDArray[np.float32]  # (1,) or (h*w,) source pixels
    intrinsics: tuple[float, float, float, float]
    axes: NDArray[np.float64]  # (4, 4) from the camera's axes to the world, without the scale
    scale: float
    is_round: bool
    stride: int  # pixels for each of the smaller surface of what they hide, which casts shadows, too; 0 for none
    light_normals: NDArray[np.float32] | None = None  # (h, w, 3), if splats do not lie by those that are lit
    trust: NDArray[np.uint8] | None = None  # (h, w, 6), of one of a set: as `Splats.trust`, and where its rims end
    gain: tuple[float, ...] = (1.0, 1.0, 1.0)  # of its exposure

    @property
    def kinds(self) -> NDArray[np.uint8]:
        """(h, w): MISSING, POINT or RIM."""
        return np.where(self.depth == 0, MISSING, np.where(self.depth < 0, RIM, POINT)).astype(np.uint8)

    @property
    def certainty_codes(self) -> NDArray[np.uint16] | None:
        """The certainty as whole numbers, little-endian."""
        return None if self.certainty is None else np.rint(self.certainty * 65535).astype("<u2")

    @property
    def has_rims(self) -> bool:
        """Whether footprints bend with the surface and end at its outline."""
        return not self.is_round and bool((self.sizes == 1).all())


def surfaces_of(thing: Drawable, is_cut: bool = True) -> Iterator[PageSurface]:
    """The surfaces of a thing that shows points: one of a frame, several of a set.

    is_cut  only the part of the picture where something is known; else all of it, as the next frame's
    """
    if isinstance(thing, ShownSet):
        members = [None] * len(thing.views) if thing.consensus.is_exact else _merged(thing)
        for view, member, trust, gain in zip(
            thing.views, members, thing.points.trusts, thing.consensus.gains.tolist(), strict=True
        ):
            if member is None or member.known.any():
                found = _read(view, member, trust=np.concatenate([_bytes(one) for one in trust.textures], -1))
                yield found._replace(gain=tuple(gain)) if member is None else found
    else:
        assert isinstance(thing, ShownPoints | ShownGrid), "tiles are reduced before"
        yield _read(thing, is_cut=is_cut)


def _merged(thing: ShownSet) -> list[Member]:
    """The frames of a set without points that another frame shows better."""
    members, frames = [], []
    for view, trust, gain in zip(thing.views, thing.points.trusts, thing.consensus.gains, strict=True):
        surface, trusted = _read_surface(view), trust.read()
        surface[trusted[..., 0] == 0, 3] = 0
        colors = srgb_to_linear(_read_colors(view.colors.texture) / np.float32(255)) * gain.astype(np.float32)
        pose = view.points.pose.copy()
        pose[:3, 3] /= view.points.scale
        members.append(Member(surface, colors, trusted[..., 1], view.points.source, pose))
        frames.append(view.textures.frame)
    return merged(members, frames, thing.consensus.band)


def _read_surface(shown: ShownPoints | ShownGrid, is_shape: bool = False) -> NDArray[np.float32]:
    surface = shown.points.surface
    texture = ((surface.shape if is_shape else None) or surface).texture
    return np.array(read_texture(texture.ctx, texture))


def _bytes(texture: moderngl.Texture) -> NDArray[np.uint8]:
    return np.asarray(read_texture(texture.ctx, texture), np.uint8)


def _read(
    shown: ShownPoints | ShownGrid, member: Member | None = None, is_cut: bool = True,
    trust: NDArray[np.uint8] | None = None,
) -> PageSurface:  # fmt: skip
    """What a frame shows, or what is left of it in a set."""
    points = shown.points
    values = _read_surface(shown, True) if member is None else member.surface
    lit = _read_surface(shown)[..., :3] if member is None and points.surface.shape else None
    depth = values[..., 3]
    colors = _read_colors(shown.colors.texture) if member is None else linear_to_bytes(np.clip(member.colors, 0, 1))
    texture = points.surface.certainty if shown.has_doubts else None
    certainty = None if texture is None else (read_texture(texture.ctx, texture)[..., 0] / 65535).astype(np.float32)
    sizes, is_round, stride = np.ones(1, np.float32), False, 0
    if isinstance(points, Points):
        sizes, is_round = points.sizes, points.splat == "round"
        stride = bridged_stride(points.source) if trust is None else 0
    others = [picture.shape for picture in (colors, certainty) if picture is not None]
    height, width = depth.shape
    left, top, right, bottom = box = _box(depth, others, max(stride, 1)) if is_cut else (0, 0, width, height)
    camera, inside = points.source, np.s_[top:bottom, left:right]
    certainty = None if certainty is None else _cut(certainty, box, depth.shape)
    sizes = sizes if sizes.size == 1 else sizes.reshape(depth.shape)[inside].ravel()
    intrinsics = camera.fx, camera.fy, camera.cx - left, camera.cy - top
    return PageSurface(
        values[inside][..., :3], depth[inside], _cut(colors, box, depth.shape), certainty, sizes, intrinsics,
        points.pose, points.scale, is_round, stride, light_normals=None if lit is None else lit[inside],
        trust=None if trust is None else trust[inside],
    )  # fmt: skip


def _read_colors(texture: moderngl.Texture) -> NDArray[np.uint8]:
    values = read_texture(texture.ctx, texture)[..., :3]
    return (values if values.dtype == np.uint8 else np.rint(values / 257)).astype(np.uint8)


def _box(depth: NDArray[np.float32], others: list[tuple[int, ...]], stride: int) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of what is known, with the pixels around it; whole strides. Pictures of other shapes
    can be cut there, too: between two of their pixels."""
    sides = []
    for axis in (1, 0):
        size, known = depth.shape[axis], np.flatnonzero(depth.any(1 - axis))
        step = lcm(stride, *(size // gcd(size, shape[axis]) for shape in others))
        low, high = (known[0] - RIM_PIXELS, known[-1] + 1 + RIM_PIXELS) if len(known) else (0, 1)
        sides.append((max(int(low), 0) // step * step, min(-(-int(high) // step) * step, size)))
    (left, right), (top, bottom) = sides
    return left, top, right, bottom


def _cut(picture: NDArray[Any], box: tuple[int, int, int, int], shape: tuple[int, ...]) -> NDArray[Any]:
    """The part of a picture of any size that covers a box of another."""
    (height, width), (rows, columns) = shape[:2], picture.shape[:2]
    left, top, right, bottom = box
    return picture[top * rows // height : bottom * rows // height, left * columns // width : right * columns // width]


class Member(NamedTuple):
    """One of the frames.

    surface  (h, w, 4) normal and depth, negative at rims, 0 where no point is trusted
    colors   (.., .., 3) linear, in the exposure of all; those of another size than the surface stay what they are
    good     (h, w) how good points are, 0 to 1
    camera   that took it
    pose     (4, 4) camera-to-world in the frames' own unit
    """

    surface: Floats
    colors: Floats
    good: Floats
    camera: Camera
    pose: NDArray[np.float64]

    @property
    def is_colored(self) -> bool:
        """Whether each point has a colour of its own."""
        return self.colors.shape[:2] == self.surface.shape[:2]

    @property
    def known(self) -> Flags:
        return self.surface[..., 3] != 0

    def rays(self, columns: NDArray[Any], rows: NDArray[Any]) -> Floats:
        """(n, 3), of depth 1."""
        fx, fy, cx, cy = self.camera.intrinsics
        return np.stack([(columns - cx) / fx, (rows - cy) / fy, np.ones(len(rows))], -1).astype(np.float32)


class MergedPoints(NamedTuple):
    """Points of one frame: the numbers of their pixels, and what is known there."""

    pixels: Numbers
    rays: Floats
    places: Floats
    normals: Floats


def merged(members: Sequence[Member], frames: Sequence[Frame], band: float) -> list[Member]:
    """The frames with the points of which no other frame shows more: normals, depths and colours are means.

    band  share of 1/z within which two frames see the same surface
    """
    near = nearest_others(frames)
    means, kept = [], [member.known for member in members]
    weights = [_weights(member) for member in members]
    weights[0] *= FIRST_WEIGHT
    for k, member in enumerate(members):
        points = _points(member)
        others = [(members[j], weights[j], kept[j]) for j in near[k]]
        best, mean = _met(points, others, member, weights[k], band)
        kept[k] = np.zeros(member.known.shape, np.bool_)
        kept[k].ravel()[points.pixels] = best <= weights[k].ravel()[points.pixels]
        means.append(mean)
    return [
        mean._replace(surface=np.where((_grown(mask) & mean.known)[..., None], mean.surface, np.float32(0)))
        for mean, mask in zip(means, kept, strict=True)
    ]


def _weights(member: Member) -> Floats:
    """(h, w): how well each point is seen: how good it is, and how many pixels a piece of its surface has."""
    points = _points(member)
    weights = np.zeros(member.known.shape, np.float32)
    facing = np.abs(_dot(points.normals, points.rays)) / np.linalg.norm(points.rays, axis=1)
    density = facing * np.square(member.camera.fx / points.places[:, 2])
    weights.ravel()[points.pixels] = density * np.maximum(member.good.ravel()[points.pixels], MIN_GOODNESS)
    return weights


def _points(member: Member) -> MergedPoints:
    pixels = np.flatnonzero(member.known)
    values = member.surface.reshape(-1, 4)[pixels]
    rays = member.rays(pixels % member.known.shape[1], pixels // member.known.shape[1])
    return MergedPoints(pixels, rays, rays * np.abs(values[:, 3:]), values[:, :3])


def _met(
    points: MergedPoints, others: Sequence[tuple[Member, Floats, Flags]], member: Member, own: Floats, band: float
) -> tuple[Floats, Member]:
    """For each point the most weight that a kept point of another frame has there, and the frame with means."""
    total = own.ravel()[points.pixels] ** MEAN_POWER
    best = np.zeros(len(total), np.float32)
    normals, off = total[:, None] * points.normals, np.zeros(len(total), np.float32)
    own_colors = member.colors.reshape(-1, 3)[points.pixels] if member.is_colored else None
    colors = None if own_colors is None else total[:, None] * own_colors
    for other, weights, kept in others:
        way = (np.linalg.inv(other.pose) @ member.pose).astype(np.float32)
        found, pixels, excess = _agreeing(points, way, other, band)
        weight = weights.ravel()[pixels]
        best[found] = np.maximum(best[found], np.where(kept.ravel()[pixels], weight, 0))
        weight = weight**MEAN_POWER * (1 - np.square(excess / band))
        total[found] += weight
        normals[found] += weight[:, None] * (other.surface.reshape(-1, 4)[pixels, :3] @ way[:3, :3])
        off[found] += weight * excess
        if colors is not None and own_colors is not None:
            seen = other.colors.reshape(-1, 3)[pixels] if other.is_colored else own_colors[found]
            colors[found] += weight[:, None] * seen
    surface, mean = member.surface.copy(), member.colors.copy()
    flat = surface.reshape(-1, 4)
    flat[points.pixels, :3] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    flat[points.pixels, 3] *= 1 + off / total
    if colors is not None:
        mean.reshape(-1, 3)[points.pixels] = colors / total[:, None]
    return best, member._replace(surface=surface, colors=mean)


def _agreeing(points: MergedPoints, way: Floats, other: Member, band: float) -> tuple[Numbers, Numbers, Floats]:
    """Which points another frame shows, too; at which of its pixels; and by which share it has them farther.

    way  (4, 4) from the axes of the points to the other frame's
    """
    fx, fy, cx, cy = other.camera.intrinsics
    height, width = other.known.shape
    x, y, z = way[:3, :3] @ points.places.T + way[:3, 3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = fx * x / z + cx, fy * y / z + cy
        index = np.flatnonzero((z > 0) & (u > -0.5) & (u < width - 0.5) & (v > -0.5) & (v < height - 0.5))
    u, v, z = u[index], v[index], z[index]
    column, row = np.rint(u).astype(np.intp), np.rint(v).astype(np.intp)
    pixels = row * width + column
    values = other.surface.reshape(-1, 4)[pixels]
    n, depth = values[:, :3], np.abs(values[:, 3])
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = depth * _dot(n, other.rays(column, row)) / (_dot(n, other.rays(u, v)) * z) - 1
    faces = _dot(n @ way[:3, :3], points.normals[index]) > MIN_NORMALS_COSINE
    same = np.flatnonzero((depth > 0) & faces & (np.abs(excess) < band))
    return index[same], pixels[same], excess[same].astype(np.float32)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2], np.float32)


def _grown(mask: Flags) -> Flags:
    """The mask with the pixels up to OVERLAP beside it."""
    for _ in range(OVERLAP):
        wide = np.pad(mask, 1)
        mask = wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
    return mask
