"""Saves the OpenGL state of a caller's context before our passes run, and restores it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from functools import partial, wraps
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar

import moderngl

from ...notes.errors import ContextError
from ...notes.notes import print_warning

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


UNITS = 8  # texture and image units from which our passes read, from 0 on
UPLOAD_UNIT = UNITS  # through which moderngl uploads, while it is us who draw
STORAGE_BUFFERS = 4  # bindings that our compute shaders use, from 0 on
DRAW_BUFFERS = 8  # each has its own blending and colour mask

SWITCHES = {  # off for our passes
    "DEPTH_TEST": DEPTH_TEST, "PROGRAM_POINT_SIZE": PROGRAM_POINT_SIZE, "STENCIL_TEST": 0x0B90, "CULL_FACE": 0x0B44,
    "RASTERIZER_DISCARD": 0x8C89, "COLOR_LOGIC_OP": 0x0BF2, "FRAMEBUFFER_SRGB": 0x8DB9, "DEPTH_CLAMP": 0x864F,
    "POLYGON_SMOOTH": 0x0B41, "POLYGON_OFFSET_FILL": 0x8037, "POLYGON_OFFSET_LINE": 0x2A02,  # llvmpipe heeds all three
    "POLYGON_OFFSET_POINT": 0x2A01, "PRIMITIVE_RESTART": 0x8F9D, "SAMPLE_MASK": 0x8E51, "SAMPLE_COVERAGE": 0x80A0,
    "SAMPLE_ALPHA_TO_COVERAGE": 0x809E, **{f"CLIP_DISTANCE{k}": 0x3000 + k for k in range(8)},
}  # fmt: skip
PRIMITIVE_RESTART_FIXED_INDEX = 0x8D69  # another of them, from OpenGL 4.3 on
SET_BY_US = (  # the number's name, and what sets it: a function and its first argument
    (0x8CA6, "BindFramebuffer", 0x8CA9),  # to draw
    (0x8CAA, "BindFramebuffer", 0x8CA8),  # to read
    (0x8CA7, "BindRenderbuffer", 0x8D41),
    (0x85B5, "BindVertexArray"),
    (0x8894, "BindBuffer", 0x8892),  # vertices
    (0x0B72, "DepthMask"),
    (0x0CF5, "PixelStorei", 0x0CF5),  # alignment of rows, uploaded
    (0x0D05, "PixelStorei", 0x0D05),  # and read
)
NEEDED_BY_US = (  # the same
    (0x0B74, "DepthFunc"),
    (0x88ED, "BindBuffer", 0x88EB),  # pixels are read into it
    (0x88EF, "BindBuffer", 0x88EC),  # pixels are uploaded from it
    # SWAP_BYTES, LSB_FIRST, ROW_LENGTH, SKIP_ROWS and SKIP_PIXELS of pixels that are uploaded, and read
    *((name, "PixelStorei", name) for first in (0x0CF0, 0x0D00) for name in range(first, first + 5)),
)
SCISSOR, LESS = 0x0C11, 0x0201
NEEDED = [LESS] + [0] * (len(NEEDED_BY_US) - 1)
VECTORS = (  # the name, of which numbers and how many, what sets it, and the value that we need, if we do not set it
    (0x0BA2, ctypes.c_int, 4, "Viewport", None),
    (0x0C10, ctypes.c_int, 4, "Scissor", None),
    (0x0C22, ctypes.c_float, 4, "ClearColor", None),
    (0x0B73, ctypes.c_double, 1, "ClearDepth", None),
    (0x0B70, ctypes.c_double, 2, "DepthRange", [0.0, 1.0]),
)
GETTERS = {ctypes.c_int: "GetIntegerv", ctypes.c_float: "GetFloatv", ctypes.c_double: "GetDoublev"}


class StatePart(NamedTuple):
    """A part of the state: `take` reads it and sets what our passes need, `put_back` restores what was read."""

    take: Callable[[], Any]
    put_back: Callable[[Any], None]


def all_parts(gl: GL, context: moderngl.Context) -> list[StatePart]:
    """Return the parts that a context has."""
    is_430, has_clip_control = context.version_code >= 430, "GL_ARB_clip_control" in context.extensions
    parts = [
        switches(gl, [*SWITCHES.values(), *[PRIMITIVE_RESTART_FIXED_INDEX] * is_430]),
        StatePart(partial(gl.IsEnabled, SCISSOR), lambda on: (gl.Enable if on else gl.Disable)(SCISSOR)),
        numbers(gl, SET_BY_US, None), numbers(gl, NEEDED_BY_US, NEEDED),
        *(vector(gl, *names) for names in VECTORS),
        color_masks(gl), polygon_mode(gl), program(gl), texture_units(gl),
    ]  # fmt: skip
    if is_430:
        parts += storage_buffers(gl), image_units(gl)
    if context.version_code >= 450 or has_clip_control:
        # where y and depth begin: a caller with reversed depth sets it
        ask = asking(gl, 0x935C, 0x935D)
        parts.append(set_if_needed(ask, lambda value: gl.ClipControl(*value), [0x8CA1, 0x935E]))
    return parts


def asking(gl: GL, *names: int) -> Callable[[], list[int]]:
    """Return a function that asks for numbers by their names."""
    get, answers = gl.GetIntegerv, (ctypes.c_int * (len(names) + 3))()  # some drivers give more than one
    questions = [(name, ctypes.byref(answers, 4 * k)) for k, name in enumerate(names)]

    def ask() -> list[int]:
        for name, answer in questions:
            get(name, answer)
        return answers[: len(questions)]

    return ask


def set_if_needed(ask: Callable[[], Any], write: Callable[[Any], None], needed: Any) -> StatePart:
    """needed: the value that our passes need; None where they set it themselves."""
    if needed is None:
        return StatePart(ask, write)

    def take() -> Any:
        theirs = ask()
        if theirs != needed:
            write(needed)
        return theirs

    def put_back(theirs: Any) -> None:
        if theirs != needed:
            write(theirs)

    return StatePart(take, put_back)


def switches(gl: GL, names: list[int]) -> StatePart:
    """The switches of these names, and blending, which each draw buffer has."""
    each = [(partial(gl.IsEnabled, name), name, partial(gl.Enable, name)) for name in names]
    each += [(partial(gl.IsEnabledi, BLEND, k), BLEND, partial(gl.Enablei, BLEND, k)) for k in range(DRAW_BUFFERS)]

    def take() -> list[Callable[[], None]]:
        on = [(name, enable) for is_enabled, name, enable in each if is_enabled()]
        for name, _ in on:
            gl.Disable(name)
        return [enable for _, enable in on]

    def put_back(on: list[Callable[[], None]]) -> None:
        for enable in on:
            enable()

    return StatePart(take, put_back)


def numbers(gl: GL, table: tuple[tuple[Any, ...], ...], needed: list[int] | None) -> StatePart:
    setters = [partial(getattr(gl, setter), *on) for _, setter, *on in table]

    def write(values: list[int]) -> None:
        for setter, value in zip(setters, values, strict=True):
            setter(value)

    return set_if_needed(asking(gl, *(name for name, *_ in table)), write, needed)


def vector(gl: GL, name: int, kind: Any, count: int, setter: str, needed: list[float] | None) -> StatePart:
    get, write, answer = getattr(gl, GETTERS[kind]), getattr(gl, setter), (kind * count)()

    def ask() -> list[float]:
        get(name, answer)
        return answer[:]

    return set_if_needed(ask, lambda value: write(*value), needed)


def color_masks(gl: GL) -> StatePart:
    get, answers = gl.GetBooleani_v, (ctypes.c_ubyte * (4 * DRAW_BUFFERS))()
    questions = [(k, ctypes.byref(answers, 4 * k)) for k in range(DRAW_BUFFERS)]

    def take() -> bytes:
        for k, answer in questions:
            get(0x0C23, k, answer)
        return bytes(answers)

    def put_back(masks: bytes) -> None:
        if masks == masks[:4] * DRAW_BUFFERS:
            gl.ColorMask(*masks[:4])
        else:
            for k in range(DRAW_BUFFERS):
                gl.ColorMaski(k, *masks[4 * k : 4 * k + 4])

    return StatePart(take, put_back)


def polygon_mode(gl: GL) -> StatePart:
    """Filled, lines or points, of both sides; only old contexts tell them apart."""
    front, back, both, fill = 0x0404, 0x0405, 0x0408, 0x1B02
    answer = (ctypes.c_int * 2)()

    def ask() -> tuple[int, int]:
        answer[1] = 0
        gl.GetIntegerv(0x0B40, answer)
        return answer[0], answer[1] or answer[0]

    def write(modes: tuple[int, int]) -> None:
        if modes[0] == modes[1]:
            gl.PolygonMode(both, modes[0])
        else:
            gl.PolygonMode(front, modes[0])
            gl.PolygonMode(back, modes[1])

    return set_if_needed(ask, write, (fill, fill))


def program(gl: GL) -> StatePart:
    """A program that was deleted while in use is gone as soon as ours is used."""

    def put_back(names: list[int]) -> None:
        gl.UseProgram(names[0] if gl.IsProgram(names[0]) else 0)

    return StatePart(asking(gl, 0x8B8D), put_back)


def texture_units(gl: GL) -> StatePart:
    """2D textures, and samplers: these filter in place of the textures' own settings."""
    ask_active, ask_bound = asking(gl, 0x84E0), asking(gl, 0x8069, 0x8919)
    first, texture_2d, activate, units = 0x84C0, 0x0DE1, gl.ActiveTexture, (*range(UNITS), UPLOAD_UNIT)

    def take() -> tuple[int, list[list[int]]]:
        active, bound = ask_active()[0], []
        for unit in units:
            activate(first + unit)
            bound.append(ask_bound())
            if bound[-1][1]:
                gl.BindSampler(unit, 0)
        return active, bound

    def put_back(value: tuple[int, list[list[int]]]) -> None:
        for unit, (texture, sampler) in zip(units, value[1], strict=True):
            activate(first + unit)
            gl.BindTexture(texture_2d, texture if texture and gl.IsTexture(texture) else 0)  # ours may be gone by now
            if sampler:
                gl.BindSampler(unit, sampler)
        activate(value[0])

    return StatePart(take, put_back)


def storage_buffers(gl: GL) -> StatePart:
    """Of compute shaders, and the one that says how many of them run."""
    target, indirect = 0x90D2, 0x90EE
    ask_bound, answer = asking(gl, 0x90D3, 0x90EF), (ctypes.c_int64 * 1)()

    def ask(name: int, k: int) -> int:
        gl.GetInteger64i_v(name, k, answer)
        return answer[0]

    def take() -> tuple[list[int], list[list[int]]]:
        return ask_bound(), [[ask(name, k) for name in (0x90D3, 0x90D4, 0x90D5)] for k in range(STORAGE_BUFFERS)]

    def put_back(value: tuple[list[int], list[list[int]]]) -> None:
        for k, (buffer, start, size) in enumerate(value[1]):
            if size:
                gl.BindBufferRange(target, k, buffer, start, size)
            else:
                gl.BindBufferBase(target, k, buffer)
        gl.BindBuffer(target, value[0][0])
        gl.BindBuffer(indirect, value[0][1])

    return StatePart(take, put_back)


def image_units(gl: GL) -> StatePart:
    """What is bound as an image: texture, level, whether in layers, layer, access and format."""
    names, answer = (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E), (ctypes.c_int * 1)()

    def ask(name: int, unit: int) -> int:
        gl.GetIntegeri_v(name, unit, answer)
        return answer[0]

    def put_back(bound: list[list[int]]) -> None:
        for unit, (texture, *how) in enumerate(bound):
            gl.BindImageTexture(unit, texture if texture and gl.IsTexture(texture) else 0, *how)

    return StatePart(lambda: [[ask(name, unit) for name in names] for unit in range(UNITS)], put_back)


# What makes GL note an error again, and does nothing else: a function and its arguments.
AGAIN = {0x0500: ("Enable", 0), 0x0501: ("Viewport", 0, 0, -1, -1), 0x0502: ("BindVertexArray", 0xFFFFFFFF)}


class BoundTextures:
    """Whose textures are bound, of all contexts in all threads."""

    program: Any = None  # the last that has bound some; None is not known


textures = BoundTextures()
_P = ParamSpec("_P")
_Given = TypeVar("_Given")
_begun: set[Generator[Any, None, None]] = set()  # what is inside, or was never left


class _Managed(AbstractContextManager[_Given], Generic[_Given]):
    def __init__(self, run: Generator[_Given, None, None]):
        self._run = run

    def __enter__(self) -> _Given:
        _begun.add(self._run)
        try:
            return next(self._run)
        except BaseException:
            if self._run.gi_frame is None:  # type: ignore[attr-defined]
                _begun.discard(self._run)
            raise

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        try:
            if error is None:
                next(self._run, None)
            else:
                self._run.throw(error)
        except BaseException as raised:
            if raised is not error:
                raise
        finally:  # one that a signal's handler has kept from its end stays begun
            if self._run.gi_frame is None:  # type: ignore[attr-defined]
                _begun.discard(self._run)


def managed(work: Callable[_P, Generator[_Given, None, None]]) -> Callable[_P, AbstractContextManager[_Given]]:
    """As contextmanager, for what changes the state of OpenGL: its end never runs late.

    A signal's handler that raises may end a `with` statement on its way in. The collector then closes the generator at
    any time, and its end would restore states or free textures in the middle of another call, even of another context.
    """

    @wraps(work)
    def opened(*args: _P.args, **options: _P.kwargs) -> AbstractContextManager[_Given]:
        return _Managed(work(*args, **options))

    return opened


class CallersState:
    """The OpenGL state of a context that the caller also uses."""

    def __init__(self, context: moderngl.Context):
        self._context: Any = context
        self._gl = GL(context)
        self._parts = all_parts(self._gl, context)
        self._noted: set[int] = set()  # errors that there was a warning about

    @managed
    def set_aside(self) -> Generator[None, None, None]:
        """Set GL's defaults inside; restore everything afterwards, including the errors that GL has noted."""
        context, errors = self._context, list[int]()
        while (error := self._gl.GetError()) and error not in errors:  # a lost context says so for ever
            errors.append(error)
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

    def _note_again(self, errors: list[int]) -> None:
        """Let GL note the caller's errors again. Those that no call can repeat become a warning, each once."""
        for error in errors:
            if error in AGAIN:
                name, *arguments = AGAIN[error]
                getattr(self._gl, name)(*arguments)
            elif error not in self._noted:
                self._noted.add(error)
                print_warning(f"OpenGL had noted error {error:#06x} before this call")


@managed
def enabled(context: moderngl.Context, *switches: int) -> Generator[None, None, None]:
    """Enable switches of GL inside, and disable them afterwards. What moderngl has noted of them stays."""
    for switch in switches:
        context.enable_direct(switch)
    try:
        yield
    finally:
        for switch in switches:
            context.disable_direct(switch)
