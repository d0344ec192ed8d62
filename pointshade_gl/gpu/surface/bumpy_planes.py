"""Finds wide planes under noise that neighbours share (shaders/common/bumpy_planes.glsl)."""

from __future__ import annotations

import moderngl
import numpy as np

from ...estimation.noise_model import flat_grid
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image
from ..core.passes import FullscreenPasses


class BumpyPlanesPass(FullscreenPasses):
    """Fits a plane to a wide window around each cell, and gives the cells the planes on which the windows agree."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._windows = self._keep(Fitted(context, Image))
        self._planes = self._keep(Fitted(context, Image))

    def measure(self, frame: DepthTextures) -> np.ndarray:
        """Return (rows, columns, 4) float32: what windows leave of planes, for `find_bumps`."""
        cells, first = flat_grid(*frame.size)
        windows, measure = self._windows.fit(cells), self.fullscreen("surface/bumpy_windows.frag", MEASURE=1)
        measure.draw(windows.target, {"depth_map": frame.depth}, first=first)
        return windows.read()

    def find(self, frame: DepthTextures, bumps: float) -> dict[str, moderngl.Texture | tuple[int, int]]:
        """Return the inputs of shaders that draw the planes. bumps: standard deviation of 1/z about planes."""
        cells, first = flat_grid(*frame.size)
        windows, planes = self._windows.fit(cells), self._planes.fit(cells)
        fit, spread = (self.fullscreen("surface/bumpy_windows.frag", SPREAD=k) for k in (0, 1))
        common = {"depth_map": frame.depth, "first": first, "bumps": bumps}
        fit.draw(windows.target, {}, **common)
        spread.draw(planes.target, {"planes": windows.texture}, **common)
        return {"planes": planes.texture, "first": first}
