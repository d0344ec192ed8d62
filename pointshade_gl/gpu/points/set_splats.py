"""The splats of a frame, as the passes that draw them take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Camera
from ..core.frame_textures import PointSurface
from ..core.images import Box
from ..core.programs import source_and_target
from .rims import has_rims


class Splats(NamedTuple):
    """A frame's splats, and their way into a view."""

    surface: PointSurface
    source: Camera  # that took the frame
    camera: Camera  # who looks
    view: np.ndarray  # (4, 4) source axes to target axes
    near: float  # source units
    sizes: np.ndarray  # (1,) or (h*w,) float32, source pixels; of one of several frames (1,)
    splat: str
    trust: moderngl.Texture | None = None  # of its points, if it is one of several frames
    primary: float = 1.0  # share of its splats

    @property
    def way(self) -> dict[str, Any]:
        """The uniforms of the warp."""
        return source_and_target(self.source, self.camera, self.view)

    @property
    def of_set(self) -> dict[str, Any]:
        """The inputs that only one of several frames has."""
        return {} if self.trust is None else {"trust_map": self.trust, "primary": self.primary}

    @property
    def has_rims(self) -> bool:
        return has_rims(self.sizes, self.splat)


def union(windows: Sequence[Box]) -> Box:
    """Return the smallest box round all boxes that are not empty."""
    boxes = [(x, y, x + w, y + h) for x, y, w, h in windows if w > 0 and h > 0] or [(0, 0, 0, 0)]
    edges = zip(*boxes, strict=True)
    left, top, right, bottom = (pick(edge) for pick, edge in zip((min, min, max, max), edges, strict=True))
    return left, top, right - left, bottom - top
