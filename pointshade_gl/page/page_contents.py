"""What a page shows, read from the GPU: surfaces, clouds, several frames merged, with fewer pixels if need be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from math import gcd, lcm
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu.core.images import read_texture
from ..gpu.drawables import Drawable
from ..gpu.meshes.mesh_objects import ShownGrid
from ..gpu.points.point_objects import Points, ShownPoints, ShownSet
from ..notes.words import counted
from ..scene.cloud import ARRAYS, CloudLook, PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.objects import PointObject
from ..scene.settings import Finish
from ..scene.values import linear_to_bytes, srgb_to_linear
from ..scene.visible import bridged_stride, coarser, points_at
from .merged_frames import Member, merged

AROUND = 2  # pixels beside the known ones that are kept: rims look so far


MOST_BEHIND = 0.03  # of the depth: by so much the last frame of a set gives way to the first


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
    behind: float = 0.0  # share of the depth by which others of its set are seen before it where they agree


def surfaces_of(thing: Drawable, is_cut: bool = True) -> Iterator[PageSurface]:
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


def _read(shown: ShownPoints | ShownGrid, member: Member | None = None, is_cut: bool = True) -> PageSurface:
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
    return PageSurface(
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


def reduced(source: Any, largest: int, most: int, points: int = 0) -> Any:
    """The frame, frames, scene or cloud, where depths and colours have up to `largest` pixels a side, and all clouds
    together about `most` points, or as many as such a picture has; itself if they do.

    points  of all clouds
    """
    level = max(math.log2(max(points, 1) / min(most, largest**2)), 0.0)
    made: dict[PointCloud, PointCloud] = {}

    def smaller(content: Any) -> Any:
        if isinstance(content, Frame):
            return _reduced_frame(content, largest)
        if isinstance(content, PointCloud):
            return made.setdefault(content, _reduced_cloud(content, level))
        if isinstance(content, PointObject):
            frames = smaller(content.frames)
            is_same = all(a is b for a, b in zip(frames, content.frames, strict=True))
            return content if is_same else PointObject(frames, look=content.look)
        return tuple(map(smaller, content)) if isinstance(content, Sequence) else content

    if isinstance(source, Scene):
        return source.with_every_node(lambda node: {"content": smaller(node.content)})
    return smaller(source)


def cloud_points(scene: Scene) -> int:
    """How many points the visible clouds have."""
    return sum(len(placed.content) for placed in scene.things if isinstance(placed.content, PointCloud))


def _reduced_cloud(cloud: PointCloud, level: float) -> PointCloud:
    """An even sample of the points, those with sizes of their own larger by as much as they are fewer."""
    some = points_at(cloud, level)
    if some is None:
        return cloud
    arrays: dict[str, Any] = {name: getattr(cloud, name) for name in ARRAYS}
    arrays = {name: one[some] if np.ndim(one) and len(one) == len(cloud) else one for name, one in arrays.items()}
    if cloud.sizes is not None:
        arrays["sizes"] = arrays["sizes"] * np.float32(2 ** (level / 2))
    look = {name: getattr(cloud, name) for name in CloudLook.__annotations__}
    return PointCloud(**arrays, origin=cloud.origin, up=cloud.up, front=cloud.front, **look)


def _reduced_frame(frame: Frame, largest: int) -> Frame:
    color = frame.color
    if color is not None and max(color.shape[:2]) > largest:
        frame = Frame(_averaged(color, largest), frame.depth, frame.camera, frame.pose, source=frame.source)
    step = -(-max(frame.depth.shape) // largest)
    return frame if step == 1 else coarser(frame, step)


def _averaged(color: NDArray[np.uint8], largest: int) -> NDArray[np.uint8]:
    """A smaller picture, each pixel the mean of those that it takes the place of."""
    from PIL import Image

    height, width = color.shape[:2]
    share = largest / max(height, width)
    size = max(round(width * share), 1), max(round(height * share), 1)
    return np.asarray(Image.fromarray(color).resize(size, Image.Resampling.BOX))


def left_out(scene: Scene, finish: Finish, points: int) -> Iterator[str]:
    """Of a scene, finished like this. points: of its clouds, before some were left out."""
    objects, shown = [p.content for p in scene.things if isinstance(p.content, PointObject)], cloud_points(scene)
    if shown < points:
        yield f"of {counted(points, 'point')} an even sample is drawn, {counted(shown, 'point')}"
    if finish.ground:
        yield "the ground and its shadows are in the still picture only"
    if not finish.is_light:
        yield f"{finish.show} in colours is in the still picture only"
    if any(one.look.splat == "mesh" for one in objects):
        yield "triangles between pixels are drawn as splats"
    if not all(one.is_single for one in objects):
        yield "several frames are one surface, the same from everywhere, without points that other frames contradict"
