"""The splats of one frame among several of one object, in the form that both rasterisers take."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Camera
from ..core.frame_textures import PointSurface
from ..core.images import Box


class SetSplats(NamedTuple):
    """The splats of one frame of several, and how they are projected into a view."""

    surface: PointSurface
    trust: moderngl.Texture  # of its points
    source: Camera
    view: np.ndarray  # (4, 4) source axes to target axes
    near: float  # source units
    sizes: np.ndarray  # (1,) float32, source pixels
    splat: str
    primary: float  # share of its splats


def union(windows: Sequence[Box]) -> Box:
    """Return the smallest box round all boxes that are not empty."""
    boxes = [(x, y, x + w, y + h) for x, y, w, h in windows if w > 0 and h > 0] or [(0, 0, 0, 0)]
    edges = zip(*boxes, strict=True)
    left, top, right, bottom = (pick(edge) for pick, edge in zip((min, min, max, max), edges, strict=True))
    return left, top, right - left, bottom - top
