"""Frames with fewer pixels and clouds with fewer points, for pages: what a browser holds and somebody wants to send."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.cloud import ARRAYS, CloudLook, PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.objects import PointObject
from ..scene.visible import coarser, points_at

Source = Frame | Sequence[Frame] | Scene | PointCloud


def reduced(source: Source, largest: int, most: int) -> Source:
    """The frame, frames, scene or cloud, where depths and colours have up to `largest` pixels a side, and all clouds
    together about `most` points; itself if they do."""
    level = max(math.log2(max(cloud_points(source), 1) / min(most, largest**2)), 0.0)
    if isinstance(source, Scene):
        made: dict[PointCloud, PointCloud] = {}
        return source.with_every_node(lambda node: {"content": _reduced_content(node.content, largest, level, made)})
    if isinstance(source, PointCloud):
        return _reduced_cloud(source, level)
    if isinstance(source, Frame):
        return _reduced_frame(source, largest)
    return [_reduced_frame(frame, largest) for frame in source]


def cloud_points(source: Source) -> int:
    """How many points the visible clouds have."""
    if isinstance(source, Scene):
        return sum(len(p.content) for p in source.placed() if isinstance(p.content, PointCloud))
    return len(source) if isinstance(source, PointCloud) else 0


def _reduced_content(content: Any, largest: int, level: float, made: dict[PointCloud, PointCloud]) -> Any:
    if isinstance(content, tuple):
        return tuple(_reduced_content(part, largest, level, made) for part in content)
    if isinstance(content, PointCloud):
        return made.setdefault(content, _reduced_cloud(content, level))
    if not isinstance(content, PointObject):
        return content
    frames = [_reduced_frame(frame, largest) for frame in content.frames]
    is_same = all(a is b for a, b in zip(frames, content.frames, strict=True))
    return content if is_same else PointObject(frames, look=content.look)


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
