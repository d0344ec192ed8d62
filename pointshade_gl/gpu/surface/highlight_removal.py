"""Removes specular highlights from a frame's colour image."""

from __future__ import annotations

import numpy as np

from ...estimation.highlight_fit import FoundHighlights
from ...scene.camera import Camera
from ..core.frame_textures import FrameTextures, PointSurface
from ..core.images import Image
from ..core.passes import FullscreenPasses, data_texture


class HighlightRemovalPass(FullscreenPasses):
    """Removes highlights from a frame's colour image on the GPU."""

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
