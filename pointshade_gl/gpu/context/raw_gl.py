"""Calls OpenGL functions that moderngl does not offer: reading and setting state."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import moderngl

from ...notes.errors import ContextError

BLEND, DEPTH_TEST, PROGRAM_POINT_SIZE = 0x0BE2, 0x0B71, 0x8642

C_TYPES = {
    "-": None, "b": ctypes.c_ubyte, "u": ctypes.c_uint, "i": ctypes.c_int, "q": ctypes.c_int64, "f": ctypes.c_float,
    "d": ctypes.c_double, "p": ctypes.c_void_p,
}  # fmt: skip
FUNCTIONS = {  # what each returns, then what it takes
    "ActiveTexture": "-u", "BindBuffer": "-uu", "BindBufferBase": "-uuu", "BindBufferRange": "-uuuqq",
    "BindFramebuffer": "-uu", "BindImageTexture": "-uuibiuu", "BindRenderbuffer": "-uu", "BindSampler": "-uu",
    "BindTexture": "-uu",
    "BindVertexArray": "-u", "BlendEquationSeparate": "-uu", "BlendEquationSeparatei": "-uuu",
    "BlendFuncSeparate": "-uuuu", "BlendFuncSeparatei": "-uuuuu",
    "ClearColor": "-ffff", "ClearDepth": "-d", "ClipControl": "-uu", "ColorMask": "-bbbb",
    "ColorMaski": "-ubbbb", "DepthFunc": "-u", "DepthMask": "-b", "DepthRange": "-dd", "Disable": "-u",
    "Enable": "-u", "Enablei": "-uu", "GetBooleani_v": "-uup", "GetDoublev": "-up", "GetError": "u",
    "GetFloatv": "-up", "GetInteger64i_v": "-uup", "GetIntegeri_v": "-uup", "GetIntegerv": "-up", "IsEnabled": "bu",
    "IsEnabledi": "buu", "IsProgram": "bu", "IsTexture": "bu", "PixelStorei": "-ui", "PolygonMode": "-uu",
    "Scissor": "-iiii", "UseProgram": "-u", "Viewport": "-iiii",
}  # fmt: skip


def _loader(context: moderngl.Context) -> Callable[[str], int]:
    """Return what gives the addresses of a context's functions."""
    loader: Any = context.mglo._context  # type: ignore[attr-defined]
    return getattr(loader, "load_opengl_function", None) or loader.load


def finisher(context: moderngl.Context) -> Callable[[], None]:
    """Return glFinish. Other threads of Python run while it waits; moderngl's `finish` keeps them waiting, too."""
    address = _loader(context)("glFinish")
    if not address:
        raise ContextError("this OpenGL context has no function glFinish: it must be current")
    return ctypes.CFUNCTYPE(None)(address)


class GL:
    """The functions of a context, by their names without the prefix gl."""

    def __init__(self, context: moderngl.Context):
        load = _loader(context)
        for name, types in FUNCTIONS.items():
            if address := load(f"gl{name}"):
                # PYFUNCTYPE keeps the GIL: these calls are shorter than letting it go.
                returns, *takes = (C_TYPES[letter] for letter in types)
                setattr(self, name, ctypes.PYFUNCTYPE(returns, *takes)(address))

    def __getattr__(self, name: str) -> Any:
        raise ContextError(f"this OpenGL context has no function gl{name}")
