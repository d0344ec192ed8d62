"""Finds wide planes in rounded depth and uses them as the surface (shaders/common/flat_cells.glsl)."""

from __future__ import annotations

import moderngl

from ...estimation.noise_model import flat_grid
from ...scene.camera import Camera
from ...scene.noise import Noise
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image, Images
from ..core.passes import FullscreenPasses


class FlatCellsPass(FullscreenPasses):
    """Writes the surface of pixels on wide planes of rounded depth, and leaves all others to later passes."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, FlatImages))

    def run(self, frame: DepthTextures, noise: Noise, camera: Camera) -> None:
        """Write the surface of flat pixels. noise: with a rounding step."""
        cells, first = flat_grid(*frame.size)
        images = self._images.fit(cells)
        common = {"depth_map": frame.depth, "first": first, "rounding": noise.rounding}
        self.fullscreen("surface/flat_cells.frag").draw(images.windows.target, {}, **common)
        spread = self.fullscreen("surface/flat_cells.frag", SPREAD=1)
        spread.draw(images.planes.target, {"planes": images.windows.texture}, **common)
        common |= {"planes": images.planes.texture, "intrinsics": camera.intrinsics}
        self.fullscreen("surface/normals_flat.frag").draw(frame.surface.staged_target, {}, **common)


class FlatImages(Images):
    """One plane for each cell: of the windows, and with those that neighbours lend."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.windows, self.planes = (self._keep(Image(context, size)) for _ in range(2))
