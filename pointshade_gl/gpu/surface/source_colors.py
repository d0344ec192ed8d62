"""The colours of a frame's points: its colour image, on request with the light divided out."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Appearance
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA16, RGBA32F, Image, Owner, read_texture
from ..core.programs import FullscreenPasses, data_texture
from ..core.steps import Steps

if TYPE_CHECKING:
    from ...estimation.light_fit import Array
    from ...estimation.photo_shading import PhotoSamples, StreamLights


class SourceColors(Owner):
    """Removes shading from colour images where the look asks for it. A note says where an image does not show its light
    well enough; its colours then stay."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps, self._albedo = steps, self._keep(UnlightingPass(context))

    @cached_property
    def _lights(self) -> StreamLights:
        from ...estimation.photo_shading import StreamLights  # only here

        return StreamLights()

    def find(
        self, textures: FrameTextures, frame: Frame, look: Appearance, surface: PointSurface, camera: Camera
    ) -> Colors:
        """Return the colours with which a frame is drawn.

        surface  the frame's, at the size at which it is drawn
        camera   the frame's own, at that size
        """
        textures.light = None
        colors = Colors(textures.color, textures)
        if not look.unlight or frame.color is None:
            return colors
        from ...estimation.light_fit import describe_light  # only here
        from ...estimation.photo_shading import find_gains  # only here

        inputs = textures, textures.surface, frame.camera
        photo = self._steps.run("samples", self._albedo.sample, *inputs, of=textures)
        stream = None if frame.source is None else (frame.source, textures.size)
        light = self._steps.run("find light", self._lights.find, photo, stream, frame.pose, of=textures)
        textures.light = light
        if not light.is_shown:
            textures.note_once("light", light.why, frame.camera, describe_light(light))
            return colors
        image = textures.albedo = textures.albedo or Image(self._context, textures.color.size, RGBA16)
        gains = self._steps.run("find gains", find_gains, photo, light, of=textures)
        inputs = colors, surface, camera, photo, gains, image
        self._steps.run("albedo", self._albedo.run, *inputs, of=textures)
        return Colors(image.texture, image)

    def sample(self, textures: FrameTextures, camera: Camera) -> PhotoSamples:
        """Return samples of a frame. camera: the frame's own."""
        return self._albedo.sample(textures, textures.surface, camera)

    def read_unlit(
        self, textures: FrameTextures, camera: Camera, photo: PhotoSamples, gains: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return the colours of a frame, (h, w, 3) sRGB, 0..1, with such gains of its samples. camera: its own."""
        image = Image(self._context, textures.color.size, RGBA16)
        try:
            self._albedo.run(Colors(textures.color, textures), textures.surface, camera, photo, gains, image)
            return (image.read()[..., :3] / 65535).astype(np.float32)
        finally:
            image.release()


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
        from ...estimation.photo_shading import PhotoSamples  # only here

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
