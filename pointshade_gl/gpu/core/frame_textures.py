"""The textures of a frame: what was uploaded, and what is made from it."""

from __future__ import annotations

import math
from collections.abc import Hashable
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import moderngl
import numpy as np

from ...notes.notes import print_note
from ...scene.camera import Camera
from ...scene.frame import NEUTRAL, Frame
from ...scene.noise import Choice, Noise
from ..context.software_driver import wants_software
from .images import R32F, RGBA8, RGBA32F, Box, Image, Images, check_size, empty

if TYPE_CHECKING:
    from ...estimation.light_fit import FoundLight

RIMS_A_ROW = 256  # as in rims.comp, in four texels each
MOST_RIMS = 1 << 17  # that are kept: 8 MB
CELL = 16  # pixels along a side for which the certainty of normals is found together
CALM_CELL = 4  # the same of calm normals, as SIDE in calm_normals.glsl
GREY = np.full((1, 1, 3), NEUTRAL, np.uint8)


class DepthTextures(Images):
    """Depth (R32F), and `surface`: the normals and the depth of its points.

    noise   of a tile: what was measured on its whole frame; None has it measured here
    source  the stream that the frame is one of, as `Frame.source`
    """

    source: Hashable = None

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.noise: Noise | None = None
        with self._all_or_nothing():
            self.depth = self._texture(1, "f4")
            self.surface = self._keep(PointSurface(context, size))

    @cached_property
    def depth_target(self) -> moderngl.Framebuffer:
        """For depth that is rendered instead of uploaded."""
        return self._framebuffer(self.depth)


class FrameTextures(DepthTextures):
    """Depth and colour (RGB8 or RGBA8) of one frame, as uploaded, and what is made from them.

    lit      the points' light, linear, not cut off at 1, for flat and gouraud shading
    is_next  is the frame the next one of a stream?
    trust    whether the points are trusted, 0 or 1, and how good they are, see shaders/common/consensus.glsl
    """

    def __init__(self, context: moderngl.Context, frame: Frame):
        super().__init__(context, _size(frame.depth))
        color = GREY if frame.color is None else frame.color
        self._shape = frame.depth.shape, color.shape
        self._is_software = wants_software(context)
        with self._all_or_nothing():
            check_size(context, *_size(color))
            self.color = self._texture(color.shape[2], size=_size(color))
            self.lit = self._keep(Image(context, self.size))
        self.frame: Frame | None = None  # whose textures these are
        self.is_next = False
        self.large: LargePoints | None = None  # these two are made for the first view that shows them
        self.completed: LargePoints | None = None
        self.calm: LargePoints | None = None
        self.bridged: LargePoints | None = None  # never lit: made when the frame casts a shadow
        self.trust: Image | None = None  # made when the frame is one of several of the same thing
        self.albedo: Image | None = None  # RGBA16, sRGB: made when the light in the picture is to be taken out
        self.light: FoundLight | None = None  # in the picture, if it was looked for
        self.matte: Image | None = None  # the same, made when highlights are to be taken out
        self._noted: dict[str, tuple[str, Camera]] = {}  # why it does not tell what was asked for, and whose it was
        self.choice = Choice("")  # what estimated the normals, and why; nothing yet

    def fits(self, frame: Frame) -> bool:
        color = GREY if frame.color is None else frame.color
        return self._shape == (frame.depth.shape, color.shape)

    def upload(self, frame: Frame) -> None:
        self.frame, self.source = None, frame.source
        left, top, right, bottom = frame.box
        self.surface.confine((left, top, right - left, bottom - top))
        self.depth.write(np.ascontiguousarray(frame.depth))
        self._write_color(GREY if frame.color is None else np.ascontiguousarray(frame.color))
        self.frame = frame
        self.raise_version()

    def _write_color(self, color: np.ndarray) -> None:
        if self._is_software or not self.version:  # a frame that stays the only one needs no buffer
            self.color.write(color)
            return
        self._pixels.orphan()  # its last picture may still be on its way
        self._pixels.write_chunks(color, 0, color.nbytes, 1)  # moderngl maps the buffer for this alone
        self.color.write(self._pixels)

    @cached_property
    def _pixels(self) -> moderngl.Buffer:
        """From which a GPU takes colours itself: drivers rearrange 8-bit channels on the CPU, four times slower."""
        return self._allocate(self._context.buffer, reserve=math.prod(self._shape[1]), dynamic=True)

    def note_once(self, what: str, why: str, camera: Camera, text: str) -> None:
        """Print a note on a camera's picture, unless its last note gave the same reason: a stream would repeat it."""
        before, self._noted[what] = self._noted.get(what), (why, camera)
        if before != (why, camera):
            print_note(text)

    @property
    def images(self) -> list[Images]:
        """These textures, and the images made from them."""
        made = [image for image in (self.trust, self.matte, self.albedo) if image]
        larger = self.large, self.completed, self.calm, self.bridged
        points = [image for made in larger if made for image in made.images]
        return [self, self.surface, self.lit, *made, *points]

    def release(self) -> None:
        for made in (self.large, self.completed, self.calm, self.bridged, self.trust, self.matte, self.albedo):
            if made:
                made.release()
        super().release()


class LargePoints(Images):
    """A frame's points at a larger size than its depth, or without gaps: `surface` and `lit`, as in FrameTextures."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.surface = self._keep(PointSurface(context, size))
        self.lit = self._keep(Image(context, size))

    @property
    def images(self) -> list[Images]:
        return [self.surface, self.lit]


class Colors(NamedTuple):
    """The picture that colours a frame's points, and the image that it is part of, whose version it has."""

    texture: moderngl.Texture
    image: Images


class KnownRims(NamedTuple):
    """What was estimated of the rims of points in one state, see rims.comp."""

    of: Hashable
    number: int  # of rims
    texture: moderngl.Texture


class PointSurface(Image):
    """The surface at the points of a frame (RGBA32F): unit normal, depth; depth 0 where there is no point.

    Depth is negative at rims, see shaders/common/rim_marks.glsl: these pixels are drawn otherwise.

    window     the part with points: the passes write no other
    certainty  of the normals, see shaders/common/toksvig.glsl: a smaller picture; None where nobody doubts them
    shape      the same points with the normals by which splats lie, if these are for light alone
    """

    shape: PointSurface | None = None
    certainty: moderngl.Texture | None = None
    _rims: KnownRims | None = None
    _listed: Hashable = None  # the state whose rims were listed last

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        with self._all_or_nothing():
            self.confine((0, 0, 0, 0))

    @property
    def _state(self) -> Hashable:
        return self.version, self.window

    @property
    def known_rims(self) -> KnownRims | None:
        """The rims of the points as they are, if they were kept."""
        return self._rims if self._rims is not None and self._rims.of == self._state else None

    def room_for_rims(self, count: int) -> moderngl.Texture | None:
        """Return where to keep so many rims, the second time that those of the same points are listed; a stream never
        shows a frame twice. None: nowhere, also where they are too many."""
        before, self._listed = self._listed, self._state
        if before != self._listed or count > MOST_RIMS:
            return None
        kept, self._rims, rows = self._rims, None, -(-count // RIMS_A_ROW)
        if kept is not None and kept.texture.height >= rows:
            return kept.texture
        if kept is not None:
            self._made.remove(kept.texture)
            kept.texture.release()
        return self._texture(*RGBA32F, (4 * RIMS_A_ROW, rows))

    def keep_rims(self, count: int, texture: moderngl.Texture) -> None:
        """Note that the rims of the points as they are now are there."""
        self._rims = KnownRims(self._state, count, texture)

    @cached_property
    def staged_target(self) -> moderngl.Framebuffer:
        """With a depth buffer, for estimators that answer in several draws."""
        depth = self._allocate(self._context.depth_renderbuffer, self.size)
        return self._framebuffer(self.texture, depth=depth)

    @cached_property
    def certainty_target(self) -> moderngl.Framebuffer:
        """For `certainty` (R16)."""
        return self._certainty_target(CELL)

    @cached_property
    def calm_certainty_target(self) -> moderngl.Framebuffer:
        """For `certainty` of calm normals: a texel of each of their cells."""
        return self._certainty_target(CALM_CELL)

    def _certainty_target(self, cell: int) -> moderngl.Framebuffer:
        texture = self._texture(1, "nu2", (-(-self.size[0] // cell), -(-self.size[1] // cell)))
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return self._framebuffer(texture)

    @cached_property
    def visibility(self) -> Image:
        """What the points see of the light from all around: see shaders/common/surroundings.glsl."""
        image = self._keep(Image(self._context, self.size, RGBA8))
        image.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        image.texture.repeat_x = image.texture.repeat_y = False
        return image

    @cached_property
    def triangles(self) -> Image:
        """Which triangles lie between a pixel and its neighbours on the right and below, and how far the pixel reaches.

        R32F, for points that are drawn as a mesh, see `grid_code` of common/grid.glsl.
        """
        return self._keep(Image(self._context, self.size, R32F))

    @cached_property
    def planes(self) -> Image:
        """How the squares are drawn, one more column and row: see grid_planes.frag."""
        return self._keep(Image(self._context, (self.size[0] + 1, self.size[1] + 1)))

    def confine(self, window: Box) -> None:
        """From now on only this part has points."""
        if self.window != window:
            self.window = window
            empty(self.target, window)

    def read(self) -> np.ndarray:
        """(h, w, 4) float32, rims not marked"""
        surface = super().read().copy()
        np.abs(surface[..., 3], out=surface[..., 3])
        return surface


def frame_of(textures: FrameTextures) -> Frame:
    """Return the frame that was uploaded last: steps get textures, whose version tells, and keep no frame."""
    assert textures.frame is not None
    return textures.frame


def _size(picture: np.ndarray) -> tuple[int, int]:
    return picture.shape[1], picture.shape[0]
