"""The colours of a frame's points: its colour image, on request without highlights and without its shading."""

from __future__ import annotations

from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.highlight_fit import FoundHighlights, describe_highlights, fit_highlights
from ...estimation.light_fit import FoundLight, describe_light
from ...estimation.light_over_time import StreamLights
from ...estimation.photo_shading import PhotoSamples, find_gains
from ...messages.notes import print_note
from ...scene.appearance import Look
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA16, Image
from ..core.memory import Owner
from ..core.steps import Steps
from .highlight_removal import HighlightRemovalPass
from .unlighting import UnlightingPass


class SourceColors(Owner):
    """Removes shading and highlights from colour images where the look asks for it. A note says where an image does not
    show its light or its highlights well enough; its colours then stay."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._lights = StreamLights()

    @cached_property
    def _albedo(self) -> UnlightingPass:
        return self._keep(UnlightingPass(self._context))

    @cached_property
    def _matte(self) -> HighlightRemovalPass:
        return self._keep(HighlightRemovalPass(self._context))

    def find(self, textures: FrameTextures, frame: Frame, look: Look, surface: PointSurface, camera: Camera) -> Colors:
        """Return the colours with which a frame is drawn.

        surface  the frame's, at the size at which it is drawn
        camera   the frame's own, at that size
        """
        textures.light = textures.highlights = None
        colors = Colors(textures.color, textures)
        if not (look.unlight or look.remove_highlights) or frame.color is None:
            return colors
        inputs = textures, textures.surface, frame.camera
        photo = self._steps.run("samples", self._albedo.sample, *inputs, of=textures)
        stream = None if frame.source is None else (frame.source, textures.size)
        light = self._steps.run("find light", self._lights.find, photo, stream, frame.pose, of=textures)
        if look.remove_highlights:
            colors = self._without_highlights(textures, frame, photo, light)
        if look.unlight:
            textures.light = light
            if light.tells:
                image = textures.albedo = textures.albedo or Image(self._context, textures.color.size, RGBA16)
                gains = self._steps.run("find gains", find_gains, photo, light, of=textures)
                inputs = colors, surface, camera, photo, gains, image
                self._steps.run("albedo", self._albedo.run, *inputs, of=textures)
                return Colors(image.texture, image)
            _note_once(textures, "light", light.why, frame.camera, describe_light(light))
        return colors

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

    def _without_highlights(
        self, textures: FrameTextures, frame: Frame, photo: PhotoSamples, light: FoundLight
    ) -> Colors:
        surface, camera = textures.surface, frame.camera
        found = self._steps.run("find highlights", _find_highlights, photo, light, of=textures)
        textures.highlights = found
        if not found.tells:
            _note_once(textures, "highlights", found.why, camera, describe_highlights(found))
            return Colors(textures.color, textures)
        matte = textures.matte = textures.matte or Image(self._context, textures.color.size, RGBA16)
        self._steps.run("matte", self._matte.run, textures, surface, camera, found, matte, of=textures)
        return Colors(matte.texture, matte)


def _find_highlights(photo: PhotoSamples, light: FoundLight) -> FoundHighlights:
    return fit_highlights(photo.unclipped, photo.surfaces, photo.rays, light)


def _note_once(textures: FrameTextures, what: str, why: str, camera: Camera, text: str) -> None:
    """Print a note about a camera's picture, unless its last note gave the same reason: a stream would repeat it."""
    before, textures.told[what] = textures.told.get(what), (why, camera)
    if before != (why, camera):
        print_note(text)
