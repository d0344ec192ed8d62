"""Finds wide planes in rounded depth and uses them as the surface (shaders/common/flat_cells.glsl)."""

from __future__ import annotations

import moderngl

from ...estimation.noise_model import flat_grid
from ...scene.camera import Camera
from ...scene.noise import Noise
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image
from ..core.passes import FullscreenPasses


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
