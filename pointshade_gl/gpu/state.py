"""The OpenGL state of a caller's context: set aside for our passes, and put back as it was.

It is read and set by GL itself, because others than moderngl may have set it (PyOpenGL, imgui). Our passes rely on GL's
defaults. Not covered: queries, conditional rendering and transform feedback in progress, and arrays of viewports.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl

from .raw_gl import GL
from .state_parts import all_parts

# What makes GL note an error again, and does nothing else: a function and its arguments.
AGAIN = {0x0500: ("Enable", 0), 0x0501: ("Viewport", 0, 0, -1, -1), 0x0502: ("BindVertexArray", 0xFFFFFFFF)}


class CallersState:
    """The state of a context that is not ours alone."""

    def __init__(self, context: moderngl.Context):
        self._context: Any = context
        self._gl = gl = GL(context)
        self._parts = all_parts(gl, context.version_code, context.default_texture_unit)

    @contextmanager
    def set_aside(self) -> Iterator[None]:
        """GL's defaults inside; afterwards all is as it was, also the errors that GL has noted."""
        context, errors = self._context, self._take_errors()
        fbo, bound = context.fbo, context.mglo.fbo  # what moderngl takes for bound
        taken = [part.take() for part in self._parts]
        try:
            yield
        finally:
            for part, value in zip(self._parts, taken, strict=True):
                part.put_back(value)
            context.fbo, context.mglo.fbo = fbo, bound
            self._note_again(errors)

    def _take_errors(self) -> list[int]:
        """Those that GL noted before, so that none is taken for ours."""
        errors = []
        while (error := self._gl.GetError()) and error not in errors:  # a lost context says so for ever
            errors.append(error)
        return errors

    def _note_again(self, errors: list[int]) -> None:
        """The caller finds their errors where they were; two kinds can only be told of in a warning."""
        for error in errors:
            if error in AGAIN:
                name, *arguments = AGAIN[error]
                getattr(self._gl, name)(*arguments)
            else:
                warnings.warn(f"OpenGL had noted error {error:#06x} before this call", RuntimeWarning, stacklevel=5)


@contextmanager
def enabled(context: moderngl.Context, *switches: int) -> Iterator[None]:
    """Switches of GL on inside and off afterwards. moderngl's own notes of the caller's switches stay as they are."""
    for switch in switches:
        context.enable_direct(switch)
    try:
        yield
    finally:
        for switch in switches:
            context.disable_direct(switch)
