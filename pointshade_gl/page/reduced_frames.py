"""Frames with fewer pixels, for pages: what a browser holds, and what somebody wants to send."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.level_of_detail import coarser
from ..scene.point_object import PointObject

Source = Frame | Sequence[Frame] | Scene


def reduced(source: Source, largest: int) -> Source:
    """The frame, frames or scene, where depths and colours have up to `largest` pixels a side; itself if they do."""
    if isinstance(source, Scene):
        return source.with_every_node(lambda node: {"content": _reduced_content(node.content, largest)})
    if isinstance(source, Frame):
        return _reduced_frame(source, largest)
    return [_reduced_frame(frame, largest) for frame in source]


def _reduced_content(content: Any, largest: int) -> Any:
    if isinstance(content, tuple):
        return tuple(_reduced_content(part, largest) for part in content)
    if not isinstance(content, PointObject):
        return content
    frames = [_reduced_frame(frame, largest) for frame in content.frames]
    is_same = all(a is b for a, b in zip(frames, content.frames, strict=True))
    return content if is_same else PointObject(frames, look=content.look)


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
