"""Divides the light out of a frame's colour image, so that the albedo remains."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...estimation.light_fit import Array
from ...estimation.photo_shading import PhotoSamples
from ...scene.camera import Camera
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA32F, Image, read_texture
from ..core.passes import FullscreenPasses, data_texture

SAMPLES = 160  # across the longer side of a frame
UNKNOWN = 1e4  # log luminance of samples without a surface: no pixel is like them


class UnlightingPass(FullscreenPasses):
    """Reads samples of a frame, in which its light is found, and divides it out on the GPU."""

    def sample(self, frame: FrameTextures, surface: PointSurface, camera: Camera) -> PhotoSamples:
        """Return samples of a frame. camera: the frame's own, at the size of the surface."""
        stride = max(max(surface.size) / SAMPLES, 1.0)
        width, height = (max(int(side / stride), 1) for side in surface.size)
        small = Image(self._context, (width, height), RGBA32F, RGBA32F)
        try:
            maps = {"color_map": frame.color, "surface_map": surface.texture}
            sampling = self.fullscreen("points/lit_samples.frag", ALIGNED=int(frame.color.size == surface.size))
            sampling.draw(small.target, maps, stride=stride)
            colors, surfaces = (read_texture(self._context, one) for one in small.textures)
        finally:
            small.release()
        size = surface.size[0] / stride, surface.size[1] / stride
        return PhotoSamples(colors, surfaces, _rays(camera, (height, width), stride), size)

    def run(
        self, colors: Colors, surface: PointSurface, camera: Camera, photo: PhotoSamples, gains: Array, albedo: Image
    ) -> None:
        """Paint the albedo.

        camera  the frame's own, at the size of the surface
        gains   (h, w) of the samples: log of what linear light is multiplied by
        """
        height, width = gains.shape
        maps = {"color_map": colors.texture, "surface_map": surface.texture}
        made = {name: data_texture(self._context, width, height, 4) for name in ("gain_map", "hue_map")}
        try:
            made["gain_map"].write(gain_map(photo, gains))
            made["hue_map"].write(photo.surroundings)
            aligned = colors.texture.size == surface.size
            source = {} if aligned else {"source": camera.intrinsics}
            freeing = self.fullscreen("surface/unlighting.frag", ALIGNED=int(aligned))
            freeing.draw(albedo.target, maps | made, samples=photo.size, **source)
        finally:
            for texture in made.values():
                texture.release()
        albedo.raise_version()


def gain_map(photo: PhotoSamples, gains: Array) -> Array:
    """Return (h, w, 4) float32: x and y of the normal, log luminance, and log gain."""
    brightness = np.where(photo.is_known, photo.brightness, UNKNOWN)
    return np.stack([*np.moveaxis(photo.surfaces[..., :2], -1, 0), brightness, gains], -1).astype(np.float32)


@lru_cache(maxsize=8)
def _rays(camera: Camera, shape: tuple[int, int], stride: float) -> Array:
    """(h, w, 3) float32 from the camera through the middles of blocks of pixels, z = 1."""
    v, u = ((np.arange(count) + 0.5) * stride - 0.5 for count in shape)
    x, y = np.meshgrid(*camera.ray_at(u, v))
    return np.stack([x, y, np.ones_like(x)], -1).astype(np.float32)
