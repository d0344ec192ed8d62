"""Removes specular highlights from a frame's colour image."""

from __future__ import annotations

import numpy as np

from ...estimation.highlight_fit import FoundHighlights, fit_highlights
from ...estimation.light_fit import FoundLight
from ...scene.camera import Camera
from ..core.frame_textures import FrameTextures, PointSurface
from ..core.images import Image
from ..core.passes import FullscreenPasses, data_texture
from .unlighting import UnlightingPass


class HighlightRemovalPass(FullscreenPasses):
    """Finds the highlights in a small copy of the frame, which is read back, and removes them on the GPU."""

    def find_highlights(
        self, albedo: UnlightingPass, frame: FrameTextures, surface: PointSurface, camera: Camera, light: FoundLight
    ) -> FoundHighlights:
        """Find the highlights in a frame's colour image. camera: the frame's own, at the size of the surface."""
        colors, surfaces, stride = albedo.sample(frame, surface)
        return fit_highlights(colors, surfaces, _rays(camera, surfaces.shape, stride), light)

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


def _rays(camera: Camera, shape: tuple[int, ...], stride: float) -> np.ndarray:
    """(h, w, 3) float32 from the camera through the middles of blocks of pixels, z = 1."""
    v, u = ((np.arange(count) + 0.5) * stride - 0.5 for count in shape[:2])
    x, y = np.meshgrid(*camera.ray_at(u, v))
    return np.stack([x, y, np.ones_like(x)], -1).astype(np.float32)
