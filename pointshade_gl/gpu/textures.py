"""Where the data lives on the GPU: the textures of a frame, and the images that are drawn into."""

from __future__ import annotations

from functools import cached_property
from typing import Any, TypeVar

import moderngl
import numpy as np

from ..frame import Frame

_Item = TypeVar("_Item")
Box = tuple[int, int, int, int]  # left, top, width, height
NEUTRAL = np.full((1, 1, 3), 204, np.uint8)  # light grey: the colour of a frame without colours


class FrameTextures:
    """Depth (R32F), colour (RGB8 or RGBA8) and surface (RGBA32F: unit normal, depth) of one frame.

    For flat and gouraud shading also the light of its points (RGBA16, linear).

    Raises ValueError when the driver cannot hold a picture of that size.
    """

    def __init__(self, context: moderngl.Context, frame: Frame):
        color = NEUTRAL if frame.color is None else frame.color
        self.depth_size = frame.depth.shape[1], frame.depth.shape[0]
        self.color_size = color.shape[1], color.shape[0], color.shape[2]
        for width, height in (self.depth_size, self.color_size[:2]):
            check_size(context, width, height)
        self.depth = context.texture(self.depth_size, 1, dtype="f4")
        self.color = context.texture(self.color_size[:2], self.color_size[2], alignment=1)
        self.surface = context.texture(self.depth_size, 4, dtype="f4")
        for texture in (self.depth, self.color, self.surface):
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.surface_target = context.framebuffer([self.surface])
        self._context = context
        self.frame: Frame | None = None  # whose textures these are
        self.window: Box = 0, 0, 0, 0  # the part with points: the only one that its passes write
        empty(self.surface_target, self.window)
        try:
            check_memory(context)
        except MemoryError:
            self.release()
            raise

    @cached_property
    def open_pixels(self) -> moderngl.Renderbuffer:
        return self._context.depth_renderbuffer(self.depth_size)

    @cached_property
    def staged_target(self) -> moderngl.Framebuffer:
        """The surface with a depth buffer, for estimators that answer in several draws."""
        return self._context.framebuffer([self.surface], self.open_pixels)

    @cached_property
    def lit(self) -> moderngl.Texture:
        texture = self._context.texture(self.depth_size, 4, dtype="nu2")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    @cached_property
    def lit_target(self) -> moderngl.Framebuffer:
        return self._context.framebuffer([self.lit])

    def fits(self, frame: Frame) -> bool:
        color = NEUTRAL if frame.color is None else frame.color
        return (*self.depth_size, *self.color_size) == (*frame.depth.shape[::-1], *_size(color))

    def upload(self, frame: Frame) -> None:
        self.frame = None
        left, top, right, bottom = frame.box
        if self.window != (window := (left, top, right - left, bottom - top)):
            self.window = window
            empty(self.surface_target, window)
        self.depth.write(frame.depth)
        self.color.write(NEUTRAL if frame.color is None else frame.color)
        self.frame = frame

    def write_normals(self, normals: np.ndarray, depth: np.ndarray) -> None:
        """normals (h, w, 3), (0, 0, 0) where missing, and depth (h, w), both float32."""
        known = np.where(normals.any(-1), depth, np.float32(0))
        self.surface.write(np.concatenate([normals, known[..., None]], -1))

    def read_normals(self) -> np.ndarray:
        """(h, w, 3) float32"""
        width, height = self.depth_size
        return np.frombuffer(self.surface.read(), np.float32).reshape(height, width, 4)[..., :3].copy()

    def release(self) -> None:
        for name in ("lit_target", "lit", "staged_target", "open_pixels"):  # if they were ever used
            if name in self.__dict__:
                self.__dict__[name].release()
        for item in (self.surface_target, self.surface, self.color, self.depth):
            item.release()


class Target:
    """The images of one view: the lit picture (RGBA8), and what it is made from, each made when it is first used."""

    def __init__(self, context: moderngl.Context, width: int, height: int):
        check_size(context, width, height)
        self._context = context
        self.size = width, height
        self.window: Box = 0, 0, width, height  # the part in which something can be seen: no other is looked at
        self._made: list[Any] = []

    @cached_property
    def color(self) -> moderngl.Texture:
        """RGBA8, the picture. Written by `picture`."""
        return self._keep(self._context.texture(self.size, 4))

    @cached_property
    def picture(self) -> moderngl.Framebuffer:
        return self._keep(self._context.framebuffer([self.color]))

    @cached_property
    def source_ids(self) -> moderngl.Texture:
        """R32I: the source pixel seen, counted from 1; 0 is none. Written by `visible`."""
        return self._nearest(self._context.texture(self.size, 1, dtype="i4"))

    @cached_property
    def visible(self) -> moderngl.Framebuffer:
        """Source ids, with a depth buffer."""
        return self._keep(self._context.framebuffer([self.source_ids], self.depth))

    @cached_property
    def depth(self) -> moderngl.Texture:
        """1 - near/z of what `visible` shows."""
        texture = self._keep(self._context.depth_texture(self.size))
        texture.compare_func = ""  # read as numbers
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    @cached_property
    def nearest(self) -> moderngl.Buffer:
        """One uint a pixel, rows from the top: the bits of the nearest 1/z; 0 is none."""
        return self._keep(self._context.buffer(reserve=4 * self.size[0] * self.size[1]))

    @cached_property
    def surface(self) -> moderngl.Texture:
        """RGBA32F: unit normal and depth of the surface seen, target axes; depth 0 is none. Written by `surfaces`."""
        return self._nearest(self._context.texture(self.size, 4, dtype="f4"))

    @cached_property
    def albedo(self) -> moderngl.Texture:
        """RGBA16, linear. Written by `surfaces`."""
        return self._nearest(self._context.texture(self.size, 4, dtype="nu2"))

    @cached_property
    def surfaces(self) -> moderngl.Framebuffer:
        """What the light pass of `phong` reads."""
        return self._keep(self._context.framebuffer([self.surface, self.albedo]))

    @cached_property
    def shared_surfaces(self) -> moderngl.Framebuffer:
        """The same with a depth buffer, for the several objects of a scene."""
        depth = self._keep(self._context.depth_renderbuffer(self.size))
        return self._keep(self._context.framebuffer([self.surface, self.albedo], depth))

    def read(self) -> np.ndarray:
        """The picture as (h, w, 4) uint8, top row first."""
        width, height = self.size
        picture = np.empty((height, width, 4), np.uint8)
        self.color.read_into(picture)
        return picture

    def release(self) -> None:
        while self._made:
            self._made.pop().release()

    def _keep(self, item: _Item) -> _Item:
        self._made.append(item)
        check_memory(self._context)
        return item

    def _nearest(self, texture: moderngl.Texture) -> moderngl.Texture:
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._keep(texture)


def empty(target: moderngl.Framebuffer, window: Box | None = None) -> None:
    """Nothing anywhere, all depths far; from now on only a window of the target is drawn to, or all of it."""
    confine(target, None)
    target.use()  # its scissor counts from here on; clear() alone would heed that of who was in use before
    target.clear(depth=1.0)
    confine(target, window)


def confine(target: moderngl.Framebuffer, window: Box | None) -> None:
    """From now on only a window of the target is drawn to, or all of it."""
    target.scissor = window  # type: ignore[assignment]  # None is taken, which its annotation forgets


def check_size(context: moderngl.Context, width: int, height: int) -> None:
    """Raises ValueError for a picture larger than the driver's textures."""
    limit = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(width, height) > limit:
        raise ValueError(
            f"a picture of {width}x{height} pixels is larger than this GPU's textures ({limit}): scale it down"
        )


def check_memory(context: moderngl.Context) -> None:
    """Raises MemoryError when the GPU could not hold what was made last: GL itself only notes it."""
    if context.error == "GL_OUT_OF_MEMORY":
        raise MemoryError("the GPU has no memory left for these pictures: scale them down, or free memory on it")


def _size(color: np.ndarray) -> tuple[int, int, int]:
    return color.shape[1], color.shape[0], color.shape[2]
