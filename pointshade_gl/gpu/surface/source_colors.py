"""The colours of a frame's points: its colour image, on request without its shading."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Look
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA16, Image
from ..core.memory import Owner
from ..core.steps import Steps

if TYPE_CHECKING:
    from ...estimation.photo_shading import PhotoSamples, StreamLights
    from .unlighting import UnlightingPass


class SourceColors(Owner):
    """Removes shading from colour images where the look asks for it. A note says where an image does not show its light
    well enough; its colours then stay."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps

    @cached_property
    def _lights(self) -> StreamLights:
        from ...estimation.photo_shading import StreamLights  # only here

        return StreamLights()

    @cached_property
    def _albedo(self) -> UnlightingPass:
        from .unlighting import UnlightingPass  # only here

        return self._keep(UnlightingPass(self._context))

    def find(self, textures: FrameTextures, frame: Frame, look: Look, surface: PointSurface, camera: Camera) -> Colors:
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
        if not light.tells:
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
