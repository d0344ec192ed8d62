"""Wide planes under noise that neighbours share, and in rounded depth, which they replace."""

from __future__ import annotations

import moderngl
import numpy as np

from ...estimation.noise_model import flat_grid
from ...scene.camera import Camera
from ...scene.noise import Noise
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image
from ..core.programs import FullscreenPasses


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


class FlatCellsPass(FullscreenPasses):
    """Writes the surface of pixels on wide planes of rounded depth, and leaves all others to later passes."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._windows = self._keep(Fitted(context, Image))  # one plane for each cell,
        self._planes = self._keep(Fitted(context, Image))  # and with those that neighbours lend

    def run(self, frame: DepthTextures, noise: Noise, camera: Camera) -> None:
        """Write the surface of flat pixels. noise: with a rounding step."""
        cells, first = flat_grid(*frame.size)
        windows, planes = self._windows.fit(cells), self._planes.fit(cells)
        common = {"depth_map": frame.depth, "first": first, "rounding": noise.rounding}
        self.fullscreen("surface/flat_cells.frag").draw(windows.target, {}, **common)
        spread = self.fullscreen("surface/flat_cells.frag", SPREAD=1)
        spread.draw(planes.target, {"planes": windows.texture}, **common)
        common |= {"planes": planes.texture, "intrinsics": camera.intrinsics}
        self.fullscreen("surface/normals_flat.frag").draw(frame.surface.staged_target, {}, **common)
