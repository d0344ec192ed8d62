"""The colours of a frame's points: its colour image, on request without highlights and without its shading."""

from __future__ import annotations

from functools import cached_property

import moderngl

from ...estimation.highlight_fit import describe_highlights
from ...estimation.light_fit import FoundLight, describe_light
from ...messages.notes import print_note
from ...scene.appearance import Look
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import RGBA16, Image
from ..core.memory import Owner
from ..core.steps import Steps
from .highlight_removal import HighlightRemovalPass
from .unlighting import SmallCopy, UnlightingPass


class SourceColors(Owner):
    """Removes shading and highlights from colour images where the look asks for it. A note says where an image does not
    show its light or its highlights well enough; its colours then stay."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps

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
        copy = self._steps.run("small copy", self._albedo.copy, *inputs, of=textures)
        light = self._steps.run("find light", self._albedo.find_light, copy, of=textures)
        if look.remove_highlights:
            colors = self._without_highlights(textures, frame, copy, light)
        if look.unlight:
            textures.light = light
            if light.tells:
                image = textures.albedo = textures.albedo or Image(self._context, textures.color.size, RGBA16)
                inputs = colors, surface, camera, copy, light, image
                self._steps.run("albedo", self._albedo.run, *inputs, of=textures)
                return Colors(image.texture, image)
            _note_once(textures, "light", light.why, frame.camera, describe_light(light))
        return colors

    def _without_highlights(self, textures: FrameTextures, frame: Frame, copy: SmallCopy, light: FoundLight) -> Colors:
        surface, camera = textures.surface, frame.camera
        found = self._steps.run("find highlights", self._matte.find_highlights, copy, light, of=textures)
        textures.highlights = found
        if not found.tells:
            _note_once(textures, "highlights", found.why, camera, describe_highlights(found))
            return Colors(textures.color, textures)
        matte = textures.matte = textures.matte or Image(self._context, textures.color.size, RGBA16)
        self._steps.run("matte", self._matte.run, textures, surface, camera, found, matte, of=textures)
        return Colors(matte.texture, matte)


def _note_once(textures: FrameTextures, what: str, why: str, camera: Camera, text: str) -> None:
    """Print a note about a camera's picture, unless its last note gave the same reason: a stream would repeat it."""
    before, textures.told[what] = textures.told.get(what), (why, camera)
    if before != (why, camera):
        print_note(text)
