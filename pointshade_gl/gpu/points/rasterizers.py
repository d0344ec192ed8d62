"""Chooses the rasteriser for splats: the compute shader where it can draw them, otherwise GL points."""

from __future__ import annotations

import moderngl
import numpy as np

from .compute_raster import ComputeSplatPass
from .point_raster import PointSplatPass
from .rims import has_rims


class Rasterizers:
    """Both rasterisers, each made when it is first used.

    can_compute  whether there is OpenGL 4.3: footprints of size 1 are then drawn by the compute shader
    merge        of the compute rasteriser, see `Renderer`
    """

    def __init__(self, context: moderngl.Context, is_software: bool, can_compute: bool, merge: float):
        self._context, self.is_software = context, is_software
        self.can_compute, self._merge = can_compute, merge
        self._made: dict[bool, PointSplatPass | ComputeSplatPass] = {}

    def choose(self, sizes: np.ndarray, splat: str) -> PointSplatPass | ComputeSplatPass:
        """Return the rasteriser for splats of these sizes, (1,) or (h*w,) in source pixels, and of this shape."""
        computed = self.can_compute and has_rims(sizes, splat)
        if computed not in self._made:
            made = ComputeSplatPass(self._context, self._merge, self.is_software) if computed else None
            self._made[computed] = made or PointSplatPass(self._context)
        return self._made[computed]

    def release(self) -> None:
        for rasterizer in self._made.values():
            rasterizer.release()
