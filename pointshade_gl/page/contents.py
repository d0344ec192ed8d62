"""What a page shows, read from the GPU: the surfaces as the renderer draws them, with calmed depth and its normals."""

from __future__ import annotations

from collections.abc import Iterator
from math import gcd, lcm
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu.core.images import read_texture
from ..gpu.drawables import Drawable
from ..gpu.meshes.mesh_objects import ShownGrid
from ..gpu.points.point_objects import Points, ShownPoints, ShownSet
from ..scene.values import linear_to_bytes, srgb_to_linear
from ..scene.visible import bridged_stride
from .merged_frames import Member, merged

AROUND = 2  # pixels beside the known ones that are kept: rims look so far


MOST_BEHIND = 0.03  # of the depth: by so much the last frame of a set gives way to the first


class Surface(NamedTuple):
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
    behind: float = 0.0  # share of the depth by which others of its set are seen before it where they agree


def surfaces_of(thing: Drawable, is_cut: bool = True) -> Iterator[Surface]:
    """The surfaces of a thing that shows points: one of a frame, several of a set.

    is_cut  only the part of the picture where something is known; else all of it, as the next frame's
    """
    if isinstance(thing, ShownSet):
        step = min(thing.consensus.band / 2, MOST_BEHIND / len(thing.views))
        for k, (view, member) in enumerate(zip(thing.views, _merged(thing), strict=True)):
            if member.known.any():
                yield _read(view, member)._replace(behind=k * step)
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


def _read_surface(shown: ShownPoints | ShownGrid) -> NDArray[np.float32]:
    texture = shown.points.surface.texture
    return np.array(read_texture(texture.ctx, texture))


def _read(shown: ShownPoints | ShownGrid, member: Member | None = None, is_cut: bool = True) -> Surface:
    """What a frame shows, or what is left of it in a set."""
    points = shown.points
    values = _read_surface(shown) if member is None else member.surface
    depth = values[..., 3]
    colors = _read_colors(shown.colors.texture) if member is None else linear_to_bytes(np.clip(member.colors, 0, 1))
    certainty = _read_certainty(points.surface.certainty) if shown.has_doubts else None
    sizes, is_round, stride = np.ones(1, np.float32), False, 0
    if isinstance(points, Points):
        sizes, is_round = points.sizes, points.splat == "round"
        stride = bridged_stride(points.source) if member is None else 0
    others = [picture.shape for picture in (colors, certainty) if picture is not None]
    height, width = depth.shape
    left, top, right, bottom = box = _box(depth, others, max(stride, 1)) if is_cut else (0, 0, width, height)
    camera = points.source
    return Surface(
        values[top:bottom, left:right, :3],
        depth[top:bottom, left:right],
        _cut(colors, box, depth.shape),
        None if certainty is None else _cut(certainty, box, depth.shape),
        sizes if sizes.size == 1 else sizes.reshape(depth.shape)[top:bottom, left:right].ravel(),
        (camera.fx, camera.fy, camera.cx - left, camera.cy - top),
        points.pose,
        points.scale,
        is_round,
        stride,
    )


def _read_colors(texture: moderngl.Texture) -> NDArray[np.uint8]:
    values = read_texture(texture.ctx, texture)[..., :3]
    return (values if values.dtype == np.uint8 else np.rint(values / 257)).astype(np.uint8)


def _read_certainty(texture: moderngl.Texture | None) -> NDArray[np.float32] | None:
    if texture is None:
        return None
    return (read_texture(texture.ctx, texture)[..., 0] / 65535).astype(np.float32)


def _box(depth: NDArray[np.float32], others: list[tuple[int, ...]], stride: int) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of what is known, with the pixels around it; whole strides. Pictures of other shapes
    can be cut there, too: between two of their pixels."""
    sides = []
    for axis in (1, 0):
        size, known = depth.shape[axis], np.flatnonzero(depth.any(1 - axis))
        step = lcm(stride, *(size // gcd(size, shape[axis]) for shape in others))
        low, high = (known[0] - AROUND, known[-1] + 1 + AROUND) if len(known) else (0, 1)
        sides.append((max(int(low), 0) // step * step, min(-(-int(high) // step) * step, size)))
    (left, right), (top, bottom) = sides
    return left, top, right, bottom


def _cut(picture: NDArray[Any], box: tuple[int, int, int, int], shape: tuple[int, ...]) -> NDArray[Any]:
    """The part of a picture of any size that covers a box of another."""
    (height, width), (rows, columns) = shape[:2], picture.shape[:2]
    left, top, right, bottom = box
    return picture[top * rows // height : bottom * rows // height, left * columns // width : right * columns // width]
