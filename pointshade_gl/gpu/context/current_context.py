"""Remembers which OpenGL context is current in this thread, and makes it current again after ours was used.

Only for Linux. There moderngl leaves none current after it has used one of EGL; and while GLX holds one current, EGL
cannot, but does not say so. Elsewhere moderngl itself restores what was current.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from typing import Any

import moderngl


class WindowSystem:
    """EGL or GLX, and what it makes current: a display, surfaces to draw into and to read from, and a context.

    loader  the module of moderngl's loaders for it
    """

    def __init__(self, loader: str, library: str, prefix: str, surfaces: tuple[tuple[Any, ...], ...], make: str):
        self.loader = loader
        functions = ctypes.CDLL(library)

        def asking(what: str, *arguments: int) -> Callable[[], int | None]:
            function = functions[f"{prefix}GetCurrent{what}"]
            function.restype = ctypes.c_void_p
            return partial(function, *arguments)

        self.context = asking("Context")  # None if none is current
        self._questions = [asking("Display"), *(asking(*surface) for surface in surfaces), self.context]
        self._make_current = functions[make]
        self._make_current.argtypes = [ctypes.c_void_p] * 4

    def held(self) -> list[int | None]:
        """Return what is current, as `hold` takes it."""
        return [ask() for ask in self._questions]

    def hold(self, held: list[int | None]) -> None:
        """Make a context current."""
        self._make_current(*held)

    def let_go(self) -> None:
        """Leave no context current."""
        self._make_current(self._questions[0](), None, None, None)


KINDS: tuple[tuple[Any, ...], ...] = (
    ("egl", "libEGL.so.1", "egl", (("Surface", 0x3059), ("Surface", 0x305A)), "eglMakeCurrent"),
    ("x11", "libGL.so.1", "glX", (("Drawable",), ("ReadDrawable",)), "glXMakeContextCurrent"),
)


@cache
def window_systems() -> dict[str, WindowSystem]:
    """Return the window systems of this machine, by the names of moderngl's loaders."""
    found = {}
    for kind in KINDS if sys.platform.startswith("linux") else ():
        try:
            found[kind[0]] = WindowSystem(*kind)
        except (OSError, AttributeError):  # it is not installed
            continue
    return found


def current_context() -> tuple[str, int] | None:
    """Return the name of the window system and the context that is current in it; None where neither has one."""
    for name, system in window_systems().items():
        if context := system.context():
            return name, context
    return None


def loader_of(context: moderngl.Context) -> str:
    """Return the name of the window system in which moderngl makes this context current; '' for any other."""
    return type(context.mglo._context).__module__  # type: ignore[attr-defined]


@contextmanager
def kept(loader: str | None) -> Iterator[None]:
    """Restore what is current at the end; inside, contexts of this window system, or any, can be made current."""
    systems = window_systems()
    before = {name: system.held() for name, system in systems.items() if system.context()}
    for name in before:
        if loader is None or (loader in systems and name != loader):
            systems[name].let_go()
    try:
        yield
    finally:
        for name, system in systems.items():
            if name not in before and system.context():
                system.let_go()
        for name, held in before.items():
            if systems[name].held() != held:
                systems[name].hold(held)
