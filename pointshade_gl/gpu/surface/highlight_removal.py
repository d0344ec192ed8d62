"""Removes specular highlights from a frame's colour image."""

from __future__ import annotations

import numpy as np

from ...estimation.highlight_fit import FoundHighlights, fit_highlights
from ...estimation.light_fit import FoundLight
from ...scene.camera import Camera
from ..core.frame_textures import FrameTextures, PointSurface
from ..core.images import Image
from ..core.passes import FullscreenPasses, data_texture
from .unlighting import SmallCopy


class HighlightRemovalPass(FullscreenPasses):
    """Finds the highlights in a small copy of the frame, which is read back, and removes them on the GPU."""

    def find_highlights(self, copy: SmallCopy, light: FoundLight) -> FoundHighlights:
        """Find the highlights in a frame's colour image."""
        return fit_highlights(copy.unclipped, copy.surfaces, copy.rays, light)

    def run(
        self, frame: FrameTextures, surface: PointSurface, camera: Camera, found: FoundHighlights, matte: Image
    ) -> None:
        """Write the colour image without its highlights. camera: the frame's own, at the size of the surface."""
        height, width = found.strengths.shape[:2]
        strengths = data_texture(self._context, width, height, 2)
        try:
            strengths.write(np.ascontiguousarray(found.strengths))
            maps = {"color_map": frame.color, "surface_map": surface.texture, "strength_map": strengths}
            values = {"source": camera.intrinsics, "light": found.light, "exponent": found.exponent}
            self.fullscreen("surface/highlight_removal.frag").draw(matte.target, maps, **values)
        finally:
            strengths.release()
        matte.raise_version()
