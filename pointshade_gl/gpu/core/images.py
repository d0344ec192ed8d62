"""Images on the GPU: textures and framebuffers of one size, and what is done to any of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

import moderngl
import numpy as np

from .memory import Owner, check_memory
from .steps import Versioned

_Images = TypeVar("_Images", bound="Images")
Box = tuple[int, int, int, int]  # left, top, width, height


class Images(Versioned, Owner):
    """Textures and framebuffers of one size, each made when it is first used, all released together.

    Raises ValueError when the driver cannot hold a picture of that size.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        check_size(context, *size)
        super().__init__(context)
        self.size = size
        self.window: Box = 0, 0, *size  # the part in which something can be seen: no other is looked at

    def _texture(self, components: int, dtype: str = "f1", size: tuple[int, int] | None = None) -> moderngl.Texture:
        texture = self._allocate(self._context.texture, size or self.size, components, dtype=dtype, alignment=1)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _framebuffer(self, *textures: moderngl.Texture, depth: Any = None) -> moderngl.Framebuffer:
        return self._allocate(self._context.framebuffer, textures, depth)


class Fitted(Generic[_Images]):
    """Images of the size that was asked for last. Those of another size are freed before: both might not fit."""

    def __init__(self, context: moderngl.Context, make: Callable[[moderngl.Context, tuple[int, int]], _Images]):
        self._context, self._make = context, make
        self._images: _Images | None = None

    def fit(self, size: tuple[int, int]) -> _Images:
        if self._images is None or self._images.size != size:
            self.release()
            self._images = self._make(self._context, size)
        return self._images

    def release(self) -> None:
        before, self._images = self._images, None
        if before is not None:
            before.release()


def empty(target: moderngl.Framebuffer, window: Box | None = None) -> None:
    """Nothing anywhere, all depths far; from now on only a window of the target is drawn to, or all of it."""
    confine(target, None)
    target.use()  # its scissor counts from here on; clear() alone would heed that of the target used before
    target.clear(depth=1.0)
    confine(target, window)


def confine(target: moderngl.Framebuffer, window: Box | None) -> None:
    """From now on only a window of the target is drawn to, or all of it."""
    target.scissor = window  # type: ignore[assignment]  # None is allowed, its annotation forgets it


def check_size(context: moderngl.Context, width: int, height: int) -> None:
    """Raises ValueError for a picture larger than the driver's textures."""
    limit = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(width, height) > limit:
        raise ValueError(
            f"a picture of {width}x{height} pixels is larger than this GPU's textures ({limit}): scale it down"
        )


def read_texture(context: moderngl.Context, texture: moderngl.Texture, dtype: type) -> np.ndarray:
    """A texture of four components as (h, w, 4), top row first."""
    values = np.frombuffer(texture.read(), dtype).reshape(texture.height, texture.width, 4)
    check_memory(context)  # some drivers take it only when they draw
    return values
