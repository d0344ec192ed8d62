"""Allocates GPU memory: raises MemoryError where it runs out, and frees what was made before a failure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

import moderngl

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

    @contextmanager
    def _all_or_nothing(self, kept: int = 0) -> Iterator[None]:
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
