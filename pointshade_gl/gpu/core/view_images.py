"""The images of a view: its picture, what that is made from, and where the light pass draws."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import AbstractContextManager, nullcontext
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Eye
from ...scene.noise import Choice
from ..context.caller_state import DEPTH_TEST, enabled, managed
from .images import R32F, RG32F, RGBA16F, RGBA32F, Box, Image, Images, check_memory, confine, empty, read_texture
from .programs import AdditiveBlend
from .steps import Parts

TILE = 4  # pixels a side, as in splats.comp


class SplatImage(Images):
    """What the splats leave of a view: how far the nearest is at each pixel, or which source pixel it shows.

    active     the tiles of the view that are drawn, R32F of a texel each: 1, or 0; None is all of it
    is_listed  whether the rasteriser knows what may be seen there
    may_hide   whether `nearest` may have marks of surfaces that go on behind others: rims leave them
    """

    active: moderngl.Texture | None = None
    is_listed = False
    may_hide = True

    def draw_only(self, active: moderngl.Texture | None) -> None:
        """From now on draw these tiles, of one view and its samples."""
        if active is not self.active:
            self.active, self.is_listed = active, False
            self.raise_version()

    @cached_property
    def nearest(self) -> moderngl.Buffer:
        """By the compute rasteriser: one uint a pixel, rows from the top, the bits of the nearest 1/z; 0 is none."""
        return self._allocate(self._context.buffer, reserve=4 * self.size[0] * self.size[1])

    @cached_property
    def source_ids(self) -> moderngl.Texture:
        """By the points rasteriser, R32I: the source pixel seen, counted from 1; 0 is none.

        Where the depth is that of the pixel itself, at rims, the number is negative. Of several frames, keys.
        """
        return self._texture(1, "i4")

    @cached_property
    def depth(self) -> moderngl.Texture:
        """By the points rasteriser: 1 - near/z."""
        return self._depth_texture()

    @cached_property
    def visible(self) -> moderngl.Framebuffer:
        """Source ids and depth."""
        return self._framebuffer(self.source_ids, depth=self.depth)


class Drawable:
    """An object that is on the GPU. Each kind calls those of the passes, `drawables.Objects`, that draw it.

    kind     under which `steps.counts` counts it
    several  how many it counts as
    """

    __slots__ = ()
    kind = "splats"

    if TYPE_CHECKING:

        @property
        def shading(self) -> str: ...

    @property
    def several(self) -> int:
        return 1

    @property
    def shape(self) -> Any:
        """Return all of it that its shadow depends on; this has `add_shadow`, and counts, too."""
        return self

    @property
    def views(self) -> tuple[Any, ...]:
        """Return the frames that it shows, those that are on the GPU as a whole."""
        return ()

    @property
    def has_doubts(self) -> bool:
        """Return whether some of its normals are uncertain and are used."""
        return False

    @property
    def is_lit_as_drawn(self) -> bool:
        """Return whether its surfaces already hold their light, and so change with it."""
        return False

    @property
    def choices(self) -> tuple[Choice, ...]:
        """Return which method estimated the normals of each of its frames, and why."""
        return tuple(view.textures.choice for view in self.views)

    @property
    def weights(self) -> dict[Any, float]:
        """Return how much each of its frames counts where several show the same surface."""
        return {view.textures.frame: 1.0 for view in self.views}

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        """Draw its visible surfaces among others. number: of its material; lights: for what is lit as it is drawn."""
        raise NotImplementedError


class ShownFrame(Parts, Drawable):
    """A frame's points with their colours or their light, drawn as splats or as triangles."""

    __slots__ = ()
    if TYPE_CHECKING:
        points: Any  # where they are: all that its shadow depends on

    @property
    def shape(self) -> Any:
        return self.points

    @property
    def views(self) -> tuple[Any, ...]:
        return (self,)

    @property
    def has_doubts(self) -> bool:
        return self.shading == "phong" and self.points.surface.certainty is not None


class SurfaceImage(Images):
    """The surfaces that a view shows, for the light pass."""

    has_doubts = False
    has_eye_dome = False
    has_visibility = False  # what can hide light from all around is looked at
    knows_visibility = True  # of all surfaces
    marks_doubts = False  # all normals are as long as they are certain, also where light would not show it

    @cached_property
    def surface(self) -> moderngl.Texture:
        """RGBA32F: normal and depth, target axes; depth 0 is nothing, a normal of 0 is lit already.

        Normals are as long as they are certain if `has_doubts`, else of length 1.
        """
        return self._texture(4, "f4")

    @cached_property
    def albedo(self) -> moderngl.Texture:
        """RGBA32F: linear albedo, or light, which may be above 1; in alpha the number of the material, from 1.

        It is negative where eye-dome lighting is wanted, if `has_eye_dome`.
        """
        return self._texture(4, "f4")

    @cached_property
    def visibility(self) -> moderngl.Texture:
        """RGBA32F: bent normal, target axes, and the share of the light from all around that arrives, -1 where that is
        not known: see shaders/common/surroundings.glsl."""
        return self._texture(4, "f4")

    @property
    def target(self) -> moderngl.Framebuffer:
        return self._drawn_to(False)

    @property
    def shared_target(self) -> moderngl.Framebuffer:
        """The same with a depth buffer, for several objects."""
        return self._drawn_to(True)

    @cached_property
    def _targets(self) -> dict[tuple[bool, bool], moderngl.Framebuffer]:
        """By whether they have visibility, and a depth buffer."""
        return {}

    def _drawn_to(self, is_shared: bool) -> moderngl.Framebuffer:
        key = self.has_visibility, is_shared
        if key not in self._targets:
            textures = (self.surface, self.albedo, *((self.visibility,) if self.has_visibility else ()))
            self._targets[key] = self._framebuffer(*textures, depth=self._depth if is_shared else None)
        return self._targets[key]

    @cached_property
    def _depth(self) -> moderngl.Renderbuffer:
        return self._allocate(self._context.depth_renderbuffer, self.size)

    @cached_property
    def _seen(self) -> moderngl.Framebuffer:
        """What says whether there is a surface: without one, nobody looks at the albedo."""
        return self._framebuffer(self.surface, depth=self._depth)

    def clear(self) -> None:
        """No surfaces yet, of several objects."""
        empty(self._seen)
        confine(self.shared_target, None)
        self.window = 0, 0, *self.size

    def read(self) -> np.ndarray:
        """(h, w, 4) float32, read-only: `surface`"""
        return read_texture(self._context, self.surface)

    def read_part(self, box: Box) -> np.ndarray:
        """(h, w, 4) float32 of a part of `surface`: nothing else leaves the GPU."""
        pixels = np.frombuffer(self.target.read(box, 4, dtype="f4", alignment=1), np.float32)
        return pixels.reshape(box[3], box[2], 4)


class SampleSums(Images):
    """What the samples of a picture add up to: surfaces, and the ground that is seen between them.

    surfaces        RGBA32F (16 bits lose some of 64 samples): linear light, not cut off at 1, and coverage
    ground          RG32F: alpha of the shadows on the ground, of lamps and in the light from all around
    content, count  what the samples show, and how many there are
    has_ground      whether a ground is among it
    """

    content: Any = None
    count = 0
    has_ground = False

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.surfaces = self._keep(Image(context, size))
        self.ground = self._keep(Image(context, size, RG32F))

    @cached_property
    def shades(self) -> Image:
        """What a white matt surface sends back, and highlights, of the pixels that all samples share."""
        return self._keep(Image(self._context, self.size, RGBA16F, RGBA16F))

    @cached_property
    def open(self) -> moderngl.Texture:
        """Where samples are drawn: 1, else 0."""
        return self._depth_texture()

    @cached_property
    def open_surfaces(self) -> moderngl.Framebuffer:
        """The sum of surfaces, which changes only there if it is depth tested."""
        return self._framebuffer(self.surfaces.texture, depth=self.open)

    @cached_property
    def active(self) -> Image:
        """Which tiles of TILE x TILE pixels have some that are open."""
        return self._keep(Image(self._context, (-(-self.size[0] // TILE), -(-self.size[1] // TILE)), R32F))

    def clear(self, has_ground: bool) -> None:
        """No samples yet."""
        self.content, self.has_ground = None, has_ground
        for image in (self.surfaces, self.ground) if has_ground else (self.surfaces,):
            empty(image.target)


class Target(Images):
    """The images of one view: the picture, and what it is made from.

    sums  what several frames add up to (16 bits lose the smallest weights), see set_accumulate.frag: normal, and by
          how much 1/z differs from the nearest splat's, times the weights; linear albedo times the weights, and their
          sum; and visibility times the weights, which `sums_without` has not
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.splats = self._keep(SplatImage(context, size))
        self.surfaces = self._keep(SurfaceImage(context, size))
        self.sums = self._keep(Image(context, size, RGBA32F, RGBA32F, RGBA32F))
        self.sums_without = self._keep(Image(context, size, RGBA32F, RGBA32F))
        self.samples = self._keep(SampleSums(context, size))

    @cached_property
    def behind(self) -> Target:
        """What is drawn of other objects where trained splats are in view: they stand before them, in part."""
        return self._keep(Target(self._context, self.size))

    @cached_property
    def color(self) -> moderngl.Texture:
        """RGBA8, the picture."""
        return self._allocate(self._context.texture, self.size, 4)

    @cached_property
    def picture(self) -> moderngl.Framebuffer:
        return self._framebuffer(self.color)

    @cached_property
    def shared_picture(self) -> moderngl.Framebuffer:
        """The picture with a depth buffer, for splats that are drawn with their light."""
        return self._framebuffer(self.color, depth=self._allocate(self._context.depth_renderbuffer, self.size))

    def read(self, out: np.ndarray | None = None) -> np.ndarray:
        """The picture as (h, w, 4) uint8, top row first, in a new array or in one of this shape, in C order."""
        width, height = self.size
        picture = np.empty((height, width, 4), np.uint8) if out is None else out
        self.color.read_into(picture)
        check_memory(self._context)  # some drivers take it only when they draw
        return picture


class Canvas(NamedTuple):
    """The image that receives the light of a picture."""

    image: moderngl.Framebuffer
    adding: AdditiveBlend | None = None  # None: sRGB, emptied first; else linear light is added to what is there
    is_masked: bool = False  # only pixels are drawn whose depth is far: their depth stays

    @property
    def linear(self) -> bool:
        return self.adding is not None

    def opened(self, window: Box) -> AbstractContextManager[moderngl.Framebuffer]:
        """Let a pass draw on this window of the image inside the context."""
        if self.adding is not None:
            return self._opened(self.adding, window)
        empty(self.image, window)
        return nullcontext(self.image)

    @managed
    def _opened(self, adding: AdditiveBlend, window: Box) -> Generator[moderngl.Framebuffer, None, None]:
        confine(self.image, window)
        if self.is_masked:
            self.image.depth_mask = False
        with adding.on(), enabled(self.image.ctx, *[DEPTH_TEST] * self.is_masked):
            yield self.image
