"""Saves the OpenGL state of a caller's context before our passes run, and restores it afterwards.

It is read and set by GL itself, because others than moderngl may have set it (PyOpenGL, imgui). Our passes rely on GL's
defaults. Not covered: queries, conditional rendering and transform feedback in progress, and arrays of viewports.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl

from ...notes.notes import print_warning
from .raw_gl import GL
from .state_parts import UPLOAD_UNIT, all_parts

# What makes GL note an error again, and does nothing else: a function and its arguments.
AGAIN = {0x0500: ("Enable", 0), 0x0501: ("Viewport", 0, 0, -1, -1), 0x0502: ("BindVertexArray", 0xFFFFFFFF)}


class CallersState:
    """The OpenGL state of a context that the caller also uses."""

    def __init__(self, context: moderngl.Context):
        self._context: Any = context
        self._gl = GL(context)
        self._parts = all_parts(self._gl, context)
        self._told: set[int] = set()  # errors that there was a warning about

    @contextmanager
    def set_aside(self) -> Iterator[None]:
        """Set GL's defaults inside; restore everything afterwards, including the errors that GL has noted."""
        context, errors = self._context, self._take_errors()
        known_to_moderngl = context.fbo, context.mglo.fbo, context.default_texture_unit
        taken = [part.take() for part in self._parts]
        context.default_texture_unit = UPLOAD_UNIT
        try:
            yield
        finally:
            for part, value in zip(self._parts, taken, strict=True):
                part.put_back(value)
            context.fbo, context.mglo.fbo, context.default_texture_unit = known_to_moderngl
            self._note_again(errors)

    def _take_errors(self) -> list[int]:
        """Return the errors that GL noted before, so that none is taken for ours."""
        errors = []
        while (error := self._gl.GetError()) and error not in errors:  # a lost context says so for ever
            errors.append(error)
        return errors

    def _note_again(self, errors: list[int]) -> None:
        """Let GL note the caller's errors again. Those that no call can repeat become a warning, each once."""
        for error in errors:
            if error in AGAIN:
                name, *arguments = AGAIN[error]
                getattr(self._gl, name)(*arguments)
            elif error not in self._told:
                self._told.add(error)
                print_warning(f"OpenGL had noted error {error:#06x} before this call")


@contextmanager
def enabled(context: moderngl.Context, *switches: int) -> Iterator[None]:
    """Enable switches of GL inside, and disable them afterwards. What moderngl has noted of them stays."""
    for switch in switches:
        context.enable_direct(switch)
    try:
        yield
    finally:
        for switch in switches:
            context.disable_direct(switch)
