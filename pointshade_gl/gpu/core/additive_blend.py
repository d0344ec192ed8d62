"""Switches additive blending on: each draw adds to what the render target holds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_int

import moderngl

from ..context.raw_gl import BLEND, GL

ADD, ONE = 0x8006, 1
FACTORS = 0x80C9, 0x80C8, 0x80CB, 0x80CA  # of the source and of the target, for colour, then for alpha
EQUATIONS = 0x8009, 0x883D  # for colour, for alpha
BUFFERS = 3  # colours of a target that are added to


class AdditiveBlend:
    """Additive blending. Afterwards the caller's own factors and equations are back: no other pass changes them."""

    def __init__(self, context: moderngl.Context):
        self._context, self._gl = context, GL(context)
        self._is_indexed = context.version_code >= 400  # each buffer has its own

    @contextmanager
    def on(self) -> Iterator[None]:
        """Add draws to their target inside the context."""
        before = [[self._asked(name, k) for name in (*FACTORS, *EQUATIONS)] for k in range(BUFFERS)]
        for k in range(BUFFERS):
            self._set(k, [ONE] * 4 + [ADD] * 2)
        self._context.enable_direct(BLEND)
        try:
            yield
        finally:
            self._context.disable_direct(BLEND)
            for k, values in enumerate(before):
                self._set(k, values)

    def _asked(self, name: int, k: int) -> int:
        answer = c_int()
        if self._is_indexed:
            self._gl.GetIntegeri_v(name, k, byref(answer))
        else:
            self._gl.GetIntegerv(name, byref(answer))
        return answer.value

    def _set(self, k: int, values: list[int]) -> None:
        if self._is_indexed:
            self._gl.BlendFuncSeparatei(k, *values[:4])
            self._gl.BlendEquationSeparatei(k, *values[4:])
        else:
            self._gl.BlendFuncSeparate(*values[:4])
            self._gl.BlendEquationSeparate(*values[4:])
