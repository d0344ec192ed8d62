"""Divides the light out of a frame's colour image, so that the albedo remains."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...estimation.light_fit import FoundLight, fit_light
from ...estimation.light_pairs import LUMINANCE, Array
from ...estimation.photo_shading import DARKEST, find_gains, is_known
from ...scene.camera import Camera
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA32F, Image, read_texture
from ..core.passes import FullscreenPasses, data_texture

SAMPLES = 160  # that the light is fitted to, across the longer side of a frame
UNKNOWN = 1e4  # log luminance of samples without a surface: no pixel is like them


class SmallCopy(NamedTuple):
    """A small copy of a frame, read-only.

    colors    (h, w, 4) float32: linear RGB and 1; 0.5 where clipped, 0 where unknown
    surfaces  (h, w, 4) float32: unit normal and depth; 0 where unknown
    rays      (h, w, 3) float32 from the camera through the samples, z = 1
    size      of the frame, in samples
    """

    colors: Array
    surfaces: Array
    rays: Array
    size: tuple[float, float]

    @property
    def unclipped(self) -> Array:
        """The colours, 0 where they are clipped."""
        return np.where(self.colors[..., 3:] == 1, self.colors, np.float32(0))


class UnlightingPass(FullscreenPasses):
    """Finds the light in a small copy of the frame, which is read back, and divides it out on the GPU."""

    def find_light(self, copy: SmallCopy) -> FoundLight:
        """Find the light in a frame's colour image, from the normals of its surface."""
        return fit_light(copy.unclipped, copy.surfaces)

    def copy(self, frame: FrameTextures, surface: PointSurface, camera: Camera) -> SmallCopy:
        """Return a small copy. camera: the frame's own, at the size of the surface."""
        stride = max(max(surface.size) / SAMPLES, 1.0)
        width, height = (max(int(side / stride), 1) for side in surface.size)
        copy = Image(self._context, (width, height), RGBA32F, RGBA32F)
        try:
            maps = {"color_map": frame.color, "surface_map": surface.texture}
            self.fullscreen("points/lit_samples.frag").draw(copy.target, maps, stride=stride)
            colors, surfaces = (read_texture(self._context, one) for one in copy.textures)
        finally:
            copy.release()
        size = surface.size[0] / stride, surface.size[1] / stride
        return SmallCopy(colors, surfaces, _rays(camera, (height, width), stride), size)

    def run(
        self, colors: Colors, surface: PointSurface, camera: Camera, copy: SmallCopy, light: FoundLight, albedo: Image
    ) -> None:
        """Paint the albedo. camera: the frame's own, at the size of the surface."""
        height, width = copy.colors.shape[:2]
        maps = {"color_map": colors.texture, "surface_map": surface.texture}
        made = {name: data_texture(self._context, width, height, 4) for name in ("gain_map", "hue_map")}
        try:
            made["gain_map"].write(_gain_map(copy, light))
            made["hue_map"].write(np.ascontiguousarray(copy.colors))
            values = {"source": camera.intrinsics, "samples": copy.size}
            self.fullscreen("surface/unlighting.frag").draw(albedo.target, maps | made, **values)
        finally:
            for texture in made.values():
                texture.release()
        albedo.raise_version()


def _gain_map(copy: SmallCopy, light: FoundLight) -> Array:
    """Return (h, w, 4) float32: x and y of the normal, log luminance, and log gain."""
    known = is_known(copy.colors, copy.surfaces)
    brightness = np.log(np.maximum(copy.colors[..., :3] @ LUMINANCE, DARKEST))
    gains = find_gains(copy.colors, copy.surfaces, copy.rays, light)
    brightness = np.where(known, brightness, np.float32(UNKNOWN))
    return np.concatenate([copy.surfaces[..., :2], brightness[..., None], gains[..., None]], -1)


def _rays(camera: Camera, shape: tuple[int, int], stride: float) -> Array:
    """(h, w, 3) float32 from the camera through the middles of blocks of pixels, z = 1."""
    v, u = ((np.arange(count) + 0.5) * stride - 0.5 for count in shape)
    x, y = np.meshgrid(*camera.ray_at(u, v))
    return np.stack([x, y, np.ones_like(x)], -1).astype(np.float32)
