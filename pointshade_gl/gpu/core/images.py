"""Images on the GPU: textures and framebuffers of one size, and what is allocated and freed with them."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import cached_property
from typing import Any, Generic, ParamSpec, TypeVar

import moderngl
import numpy as np

from ..context.caller_state import DEPTH_TEST, enabled, managed
from .steps import Versioned

_Item = TypeVar("_Item")
_P = ParamSpec("_P")
NO_MEMORY = "the GPU has no memory left for these pictures: scale them down, or free memory on it"


class Owner:
    """Owns what it has made on the GPU, and frees it in reverse order."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._made: list[Any] = []

    def release(self) -> None:
        while self._made:
            self._made.pop().release()

    def _allocate(self, make: Callable[_P, _Item], *args: _P.args, **options: _P.kwargs) -> _Item:
        """Return make(...), such as a texture or a buffer. Raises MemoryError where it does not fit."""
        return self._keep(allocate(self._context, make, *args, **options))

    def _keep(self, item: _Item) -> _Item:
        self._made.append(item)
        return item

    @managed
    def _all_or_nothing(self, kept: int = 0) -> Generator[None, None, None]:
        """Frees what was made when something inside fails: for constructors, after which nobody else could.

        kept  how many of the things that were made before stay
        """
        try:
            yield
        except BaseException:
            while len(self._made) > kept:
                self._made.pop().release()
            raise


def allocate(context: moderngl.Context, make: Callable[_P, _Item], *args: _P.args, **options: _P.kwargs) -> _Item:
    """Return make(...), something on the GPU. Raises MemoryError where it does not fit."""
    try:
        item: Any = make(*args, **options)
    except moderngl.Error as error:
        raise MemoryError(f"{NO_MEMORY} ({error})") from error
    try:
        check_memory(context)
    except MemoryError:
        item.release()
        raise
    return item


def check_memory(context: moderngl.Context) -> None:
    """Raises MemoryError when the GPU could not hold what was made last: GL itself only notes it."""
    if context.error == "GL_OUT_OF_MEMORY":
        raise MemoryError(NO_MEMORY)


_Images = TypeVar("_Images", bound="Images")
Box = tuple[int, int, int, int]  # left, top, width, height
Format = tuple[int, str]  # components, and their type as moderngl calls it
RGBA32F, RG32F, R32F, RGBA16F = (4, "f4"), (2, "f4"), (1, "f4"), (4, "f2")
RGBA16, RG16, RGBA8, RG8 = (4, "nu2"), (2, "nu2"), (4, "f1"), (2, "f1")
_DTYPES = {"f4": np.float32, "nu2": np.uint16, "f1": np.uint8}


class Images(Versioned, Owner):
    """Textures and framebuffers of one size, each made when it is first used, all released together.

    Raises ValueError when the driver cannot hold a picture of that size.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        check_size(context, *size)
        super().__init__(context)
        self.size = size
        self.window: Box = 0, 0, *size  # the part in which something can be seen: no other is looked at

    def free(self) -> None:
        """Free the textures: each is made again when it is next used. For classes that make all of theirs so."""
        if self._made:
            self.release()
            for name in [name for name in vars(self) if isinstance(getattr(type(self), name, None), cached_property)]:
                del vars(self)[name]
            self.raise_version()

    def _texture(self, components: int, dtype: str = "f1", size: tuple[int, int] | None = None) -> moderngl.Texture:
        texture = self._allocate(self._context.texture, size or self.size, components, dtype=dtype, alignment=1)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _depth_texture(self) -> moderngl.Texture:
        """Return a depth buffer that is read as numbers."""
        texture = self._allocate(self._context.depth_texture, self.size)
        texture.compare_func = ""  # read as numbers
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _framebuffer(self, *textures: moderngl.Texture, depth: Any = None) -> moderngl.Framebuffer:
        return self._allocate(self._context.framebuffer, textures, depth)


class Image(Images):
    """A texture and the framebuffer that draws to it; or several textures that are drawn to at once.

    Made when it is first used. Without formats it is one RGBA32F.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int], *formats: Format):
        super().__init__(context, size)
        self._formats = formats or (RGBA32F,)

    @cached_property
    def textures(self) -> tuple[moderngl.Texture, ...]:
        with self._all_or_nothing(len(self._made)):
            return tuple(self._texture(*one) for one in self._formats)

    @property
    def texture(self) -> moderngl.Texture:
        """The first of them."""
        return self.textures[0]

    @cached_property
    def target(self) -> moderngl.Framebuffer:
        return self._framebuffer(*self.textures)

    def read(self) -> np.ndarray:
        """Return the first texture as (h, w, components), read-only."""
        return read_texture(self._context, self.texture)

    def read_all(self) -> np.ndarray:
        """Return textures of one format as (n, h, w, components), read-only: the GPU is waited for once."""
        first, size = self.texture, self._for_reading.size // len(self.textures)
        for k, texture in enumerate(self.textures):
            texture.read_into(self._for_reading, alignment=1, write_offset=k * size)
        values = np.frombuffer(self._for_reading.read(), _DTYPES[first.dtype])
        check_memory(self._context)  # some drivers take it only when they draw
        return values.reshape(-1, first.height, first.width, first.components)

    @cached_property
    def _for_reading(self) -> moderngl.Buffer:
        size = sum(np.dtype(_DTYPES[one.dtype]).itemsize * one.components for one in self.textures)
        return self._allocate(self._context.buffer, reserve=size * self.size[0] * self.size[1])


class Fitted(Generic[_Images]):
    """Images of the size that was asked for last. Those of another size are freed before: both might not fit."""

    def __init__(self, context: moderngl.Context, make: Callable[..., _Images], *formats: Format):
        self._context, self._make, self._formats = context, make, formats
        self._images: _Images | None = None

    def fit(self, size: tuple[int, int]) -> _Images:
        if self._images is None or self._images.size != size:
            self.release()
            self._images = self._make(self._context, size, *self._formats)
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


def empty_part(target: moderngl.Framebuffer, window: Box) -> None:
    """The same of a window alone: what lies around it stays."""
    confine(target, None)
    target.use()
    target.clear(depth=1.0, viewport=window)
    confine(target, window)


def confine(target: moderngl.Framebuffer, window: Box | None) -> None:
    """From now on only a window of the target is drawn to, or all of it."""
    target.scissor = window  # type: ignore[assignment]  # None is allowed, its annotation forgets it


@managed
def depth_tested(context: moderngl.Context, target: moderngl.Framebuffer, window: Box) -> Generator[None, None, None]:
    """Draw on a window of the target inside, where only the nearest stays."""
    confine(target, window)
    with enabled(context, DEPTH_TEST):
        yield
    confine(target, None)


def check_size(context: moderngl.Context, width: int, height: int) -> None:
    """Raises ValueError for a picture larger than the driver's textures."""
    limit = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(width, height) > limit:
        size = f"a picture of {width}x{height} pixels"
        raise ValueError(f"{size} is larger than this GPU's textures ({limit}): scale it down")


def read_texture(context: moderngl.Context, texture: moderngl.Texture) -> np.ndarray:
    """Return a texture as (h, w, components), top row first, read-only."""
    values = np.frombuffer(texture.read(alignment=1), _DTYPES[texture.dtype])
    values = values.reshape(texture.height, texture.width, texture.components)
    check_memory(context)  # some drivers take it only when they draw
    return values
