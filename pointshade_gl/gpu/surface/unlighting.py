"""Divides the light out of a frame's colour image, so that the albedo remains."""

from __future__ import annotations

import numpy as np

from ...estimation.light_fit import FoundLight, fit_light
from ...scene.camera import Camera
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA32F, Image, read_texture
from ..core.passes import FullscreenPasses

SAMPLES = 160  # that the light is fitted to, across the longer side of a frame


class UnlightingPass(FullscreenPasses):
    """Finds the light in a small copy of the frame, which is read back, and divides it out on the GPU."""

    def find_light(self, frame: FrameTextures, surface: PointSurface) -> FoundLight:
        """Find the light in a frame's colour image, from the normals of its surface."""
        return fit_light(*self.sample(frame, surface)[:2])

    def sample(self, frame: FrameTextures, surface: PointSurface) -> tuple[np.ndarray, np.ndarray, float]:
        """Colours and surfaces of a small copy, and the pixels between its samples.

        Both are (h, w, 4) float32, read-only: linear RGB and 1, or 0 where unknown; unit normal and depth.
        """
        stride = max(max(surface.size) / SAMPLES, 1.0)
        width, height = (max(int(side / stride), 1) for side in surface.size)
        copy = Image(self._context, (width, height), RGBA32F, RGBA32F)
        try:
            maps = {"color_map": frame.color, "surface_map": surface.texture}
            self.fullscreen("points/lit_samples.frag").draw(copy.target, maps, stride=stride)
            colors, surfaces = (read_texture(self._context, one) for one in copy.textures)
            return colors, surfaces, stride
        finally:
            copy.release()

    def run(self, colors: Colors, surface: PointSurface, camera: Camera, light: FoundLight, albedo: Image) -> None:
        """Paints the albedo. camera: the frame's own, at the size of the surface."""
        maps = {"color_map": colors.texture, "surface_map": surface.texture}
        values = {"source": camera.intrinsics, "light": light.values, "white": light.white}
        self.fullscreen("surface/unlighting.frag").draw(albedo.target, maps, **values)
        albedo.raise_version()
