"""Programs from shader files, and the full-screen passes that are made of them."""

from __future__ import annotations

import re
from collections.abc import Generator, Sequence
from ctypes import byref, c_int
from functools import cache
from marshal import dumps
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from ...notes.errors import ShaderError
from ...scene.camera import Camera
from ..context.caller_state import BLEND, GL, UNITS, managed, textures
from ..context.context import signals_later
from ..context.software_driver import (
    IMAGE_2D,
    IMAGES,
    by_copies,
    by_flat_inputs,
    by_images,
    reads_images,
    wants_software,
)
from .images import Owner, allocate

Origin = list[tuple[str, Sequence[int]]]  # where the lines of a text come from: a file, and their numbers in it
Spliced = tuple[str, Origin]
_INCLUDE = re.compile(r'\n[ \t]*#include[ \t]+"([^"]+)".*')  # quicker to find than ^
# Mesa "0:12(5): error", NVIDIA "0(12) : error", macOS and Intel "ERROR: 0:12: "
_DRIVER_LINE = re.compile(r"(?:ERROR: )?\b0[:(](\d+)\)?(?:\(\d+\))?\s*:\s*(?:error)?:?\s*(.*)", re.IGNORECASE)


@cache
def shader_folder() -> Path:
    """Return the folder of the shaders: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[2]
    for folder in (package / "shaders", package.parent / "shaders"):
        if folder.is_dir():
            return folder
    raise ShaderError(f"no folder 'shaders' in {package} or beside it: the installation is incomplete")


def splice(name: str, folder: Path | None = None) -> Spliced:
    """Return the text of a shader with its includes in place, and where its lines come from."""
    pieces = _pieces if folder is None else _pieces.__wrapped__  # files of other folders may change
    folder = folder or shader_folder()
    texts: list[str] = []
    origin: Origin = []
    done: set[str] = set()

    def take(part: str, wanted_by: str) -> None:
        if part in done:
            return
        done.add(part)
        try:
            found = pieces(folder / part)
        except (FileNotFoundError, IsADirectoryError):
            raise ShaderError(f'{wanted_by}: cannot include "{part}": no such file') from None
        for text, numbers, include in found:
            if text:
                texts.append(text)
                origin.append((part, numbers))
            if include:
                take(include, f"{part}:{numbers.stop}")

    take(name, name)
    return "".join(texts), origin


@cache
def _pieces(path: Path) -> list[tuple[str, range, str]]:
    """Return a file, cut at its includes: text, the numbers of its lines, and what is included behind it ("": none)."""
    found, first = [], 1
    *parts, last = _INCLUDE.split("\n" + path.read_text(encoding="utf-8").rstrip("\n"))
    for text, include in zip([*parts[::2], last], [*parts[1::2], ""], strict=True):
        text = f"{text[1:]}\n" if text else ""
        after = first + text.count("\n")
        found.append((text, range(first, after), include))
        first = after + 1
    return found


def _begin(context: moderngl.Context, name: str, spliced: Spliced, lines: list[str], version: int = 0) -> Spliced:
    """Insert lines after the first, the #version, or change it; for software drivers see software_driver.py."""
    text, origin = spliced
    if reads_images(context):
        text, reads = by_images(text)
        lines, version = [*lines, *reads], 430 if reads else version
    first, rest = text.split("\n", 1)
    first = f"#version {version} core" if version else first
    numbers = origin[0][1]
    return "\n".join([first, *lines, rest]), [(name, [1] * (1 + len(lines))), (name, numbers[1:]), *origin[1:]]


def build_program(
    context: moderngl.Context, vertex: str, fragment: str, folder: Path | None = None, version: int = 330,
    **constants: int,
) -> moderngl.Program:  # fmt: skip
    """A program from two shader files; `constants` are defined in both. For software drivers see software_driver.py.

    version  of GLSL for the fragment shader; what needs more than 330 is a constant's part

    Raises ShaderError with file and line of the driver's complaints.
    """
    defines = [f"#define {constant} {value}" for constant, value in constants.items()]
    (vertex_text, vertex_origin), (fragment_text, fragment_origin) = splice(vertex, folder), splice(fragment, folder)
    flat: list[str] = []
    if wants_software(context) and vertex == "fullscreen.vert":
        vertex_text, fragment_text, flat = by_flat_inputs(vertex_text, fragment_text)
    vertex_text, vertex_origin = _begin(context, vertex, (vertex_text, vertex_origin), defines, 330)
    spliced = fragment_text, fragment_origin
    fragment_text, fragment_origin = _begin(context, fragment, spliced, defines + flat, version)
    try:
        with signals_later():
            return context.program(vertex_shader=vertex_text, fragment_shader=fragment_text)
    except moderngl.Error as error:
        log = str(error)
        origin = vertex_origin if "vertex_shader" in log else fragment_origin
        raise ShaderError(translate_log(log, origin) or f"{vertex}, {fragment}: {log}") from error


def build_compute(
    context: moderngl.Context, name: str, added: Sequence[str] = (), /, **constants: int
) -> moderngl.ComputeShader:
    """A compute program from one shader file, also from a fragment shader: see `by_compute`.

    Raises ShaderError with file and line of the driver's complaints.
    """
    lines, spliced, version = [f"#define {constant} {value}" for constant, value in constants.items()], splice(name), 0
    if name.endswith(".frag"):
        lines, spliced, version = [*lines, *_FRAGMENT], by_compute(name, spliced, added), 430
    elif wants_software(context):
        spliced = by_copies(spliced[0]), spliced[1]
    text, origin = _begin(context, name, spliced, lines, version)
    try:
        with signals_later():
            return context.compute_shader(text)
    except moderngl.Error as error:
        raise ShaderError(translate_log(str(error), origin) or f"{name}: {error}") from error


_OUTS = re.compile(r"^#(?:if|el|endif).*|^(?:layout\(location = (\d)\) )?out (float|vec[234]) (\w+);", re.MULTILINE)
_FUNCTION = re.compile(r"^(\w+) (\w+)\(.*\) {$", re.MULTILINE)
_FILLED = {"float": "vec4({})", "vec2": "vec4({}, 0.0, 0.0)", "vec3": "vec4({}, 1.0)", "vec4": "{}"}
_FRAGMENT = (
    "layout(local_size_x = 8, local_size_y = 8) in;",
    "uniform ivec4 fragment_window;  // left, top, right, bottom",
    "uniform int fragment_outs;  // as many of the values are stored",
    "vec4 fragment_coord; float fragment_depth; bool is_discarded = false;",
)
_MAIN = """void main() {
    ivec2 place = fragment_window.xy + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(place, fragment_window.zw))) return;
    fragment_coord = vec4(vec2(place) + 0.5, 0.5, 1.0);
    fragment_main();
    if (is_discarded) return;"""


def by_compute(fragment: str, spliced: Spliced, added: Sequence[str] = ()) -> Spliced:
    """Return a fragment shader, to follow `_FRAGMENT`, as a compute shader that stores in images what it would draw.

    added  the formats of images that the values are added to; without them, they take the place of what is there
    """
    text, origin = spliced
    text = text.replace("gl_FragCoord", "fragment_coord").replace("gl_FragDepth", "fragment_depth")
    head, main = text.split("void main() {", 1)
    leaving = []  # functions that discard
    while "discard;" in head:
        before, after = head.split("discard;", 1)
        kind, function = _FUNCTION.findall(before, before.rindex("\n}"))[0]
        head = f"{before}{{ is_discarded = true; {kind} nothing; return nothing; }}{after}"
        leaving.append(function)
    main = main.replace("discard;", "{ is_discarded = true; return; }")
    if leaving:
        main = re.sub(rf"(\b(?:{'|'.join(leaving)})\(.*?\);)", r"\1 if (is_discarded) return;", main)
    stores = [_MAIN]

    def declare(match: re.Match[str]) -> str:
        number, kind, name = match.groups()
        if kind is None:
            stores.append(match[0])  # an #if round a value is one round its store
            return match[0]
        k, value = int(number or 0), _FILLED[kind].format(name)
        how = f"layout(binding = {k}) uniform writeonly"
        if k < len(added):
            how, value = f"layout({added[k]}, binding = {k}) uniform", f"imageLoad(image_{k}, place) + {value}"
        stores.append(f"    if (fragment_outs > {k}) imageStore(image_{k}, place, {value});")
        return f"{kind} {name}; {how} image2D image_{k};"

    head = _OUTS.sub(declare, head)
    # never done: without it the uniforms that only depth needs would be gone
    stores += ["    if (fragment_outs == 0) imageStore(image_0, place, vec4(fragment_depth));", "}"]
    lines = "\n".join(stores).split("\n")
    text = "\n".join([f"{head}void fragment_main() {{{main.rstrip()}", *lines, ""])
    return text, [*origin, (fragment, [1] * len(lines))]


def translate_log(log: str, origin: Origin) -> str:
    """Return the driver's complaints with lines of files, `common/phong.glsl:3: error: ...`; '' if none is found."""
    places = [f"{file}:{number}" for file, numbers in origin for number in numbers]
    found = []
    for match in _DRIVER_LINE.finditer(log):
        number = int(match[1])
        if 0 < number <= len(places):
            found.append(f"{places[number - 1]}: error: {match[2]}")
    return "\n".join(found)


def set_uniforms(program: moderngl.Program | moderngl.ComputeShader, **values: Any) -> None:
    """Set uniforms by name, those that are others than before. A name that the program does not have raises KeyError.

    Nobody else sets them. What was set is kept to the bit: 0.0 is not -0.0.
    """
    before: dict[str, Any] = program.extra or _known_of(program)
    for name, value in values.items():
        if name in before and before[name][0] is value:
            continue
        known = value if type(value) is bytes or type(value) is int else dumps(value, 2)
        if name in before and before[name][1] == known:
            continue
        uniform = program[name]
        if type(value) is bytes:
            uniform.write(value)  # type: ignore[union-attr]
        else:
            uniform.value = value  # type: ignore[union-attr]
        before[name] = None if type(value) in (list, np.ndarray) else value, known  # those may be written into


def source_and_target(source: Camera, target: Camera, view: np.ndarray) -> dict[str, Any]:
    """Return the uniforms of every warp; view (4, 4) takes source axes to target axes."""
    global _last_way
    last = _last_way  # other threads have theirs
    if last[0] is not source or last[1] is not target or last[2] is not view or view.flags.writeable:
        way = {
            "source": last[3]["source"] if last[0] is source else source.intrinsics,
            "target": last[3]["target"] if last[1] is target else target.intrinsics,
            "view": view.T.astype("f4").tobytes(),
        }
        last = _last_way = source, target, view, way
    return {**last[3]}


_last_way: tuple[Any, Any, Any, dict[str, Any]] = None, None, None, {}  # several programs ask for one after the other


class FullscreenPass(Owner):
    """A fragment shader drawn over a whole target."""

    _program: moderngl.Program | moderngl.ComputeShader
    _array: moderngl.VertexArray

    def __init__(self, context: moderngl.Context, fragment: str, version: int = 330, **constants: int):
        super().__init__(context)
        with self._all_or_nothing():
            program = build_program(context, "fullscreen.vert", fragment, None, version, **constants)
            self._program = self._keep(program)
            self._array = self._allocate(context.vertex_array, program, [])

    def draw(self, target: moderngl.Framebuffer, textures: dict[str, moderngl.Texture], /, **uniforms: Any) -> None:
        """Draw onto the target. textures: by the names of their samplers; they may also be among the uniforms."""
        set_inputs(self._program, textures | uniforms)
        self.draw_again(target)

    def draw_again(self, target: moderngl.Framebuffer) -> None:
        """Draw with the inputs of the last time, while `holds_inputs`."""
        target.use()
        self._array.render(moderngl.TRIANGLES, 3)

    @property
    def holds_inputs(self) -> bool:
        """Return whether no other program has bound textures since this was drawn."""
        return textures.program is self._program


_AFTER = (  # what may read or change an image that was stored in
    moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT
    | moderngl.TEXTURE_UPDATE_BARRIER_BIT | moderngl.FRAMEBUFFER_BARRIER_BIT
)  # fmt: skip


class ComputedPass(FullscreenPass):
    """The same for GPUs, some of which draw fragments with a few of their units only: a compute shader stores the
    values, where the target has images and no depth.
    """

    def __init__(self, context: moderngl.Context, fragment: str, version: int = 330, **constants: int):
        Owner.__init__(self, context)
        self._fragment, self._version, self._constants = fragment, version, constants
        self._programs: dict[Any, moderngl.Program | moderngl.ComputeShader] = {}  # made when they are first needed
        self._drawn_to: Any = None
        self._window = 0, 0, 0, 0

    def draw(self, target: moderngl.Framebuffer, textures: dict[str, moderngl.Texture], /, **uniforms: Any) -> None:
        formats = target.extra if target.color_attachments else ()
        if formats is None:
            formats = target.extra = stored_formats(target)
        is_added = self._context in _adding
        # sums of other formats are rounded, each driver in its own way
        can_store = bool(formats) and not (is_added and any(not one.endswith("32f") for one in formats))
        key = (formats if is_added else ()) if can_store else None
        self._program = self._programs.get(key) or self._built(key)
        super().draw(target, textures, **uniforms)

    def draw_again(self, target: moderngl.Framebuffer) -> None:
        program: Any = self._program
        if type(program) is moderngl.Program:
            super().draw_again(target)
            return
        drawn_to = target.viewport, target.scissor
        if drawn_to != self._drawn_to:
            (left, top, width, height), (x, y, w, h) = self._drawn_to = drawn_to
            self._window = max(left, x), max(top, y), min(left + width, x + w), min(top + height, y + h)
        left, top, right, bottom = self._window
        if left >= right or top >= bottom:
            return
        images: tuple[Any, ...] = target.color_attachments
        for unit, texture in enumerate(images):
            texture.bind_to_image(unit)
        set_uniforms(program, fragment_window=self._window, fragment_outs=len(images))
        program.run(-(-(right - left) // 8), -(-(bottom - top) // 8))
        self._context.memory_barrier(_AFTER)

    def _built(self, added: tuple[str, ...] | None) -> moderngl.Program | moderngl.ComputeShader:
        """added: see `by_compute`; None draws fragments."""
        if added is not None:
            program: Any = self._keep(build_compute(self._context, self._fragment, added, **self._constants))
        else:
            inputs = "fullscreen.vert", self._fragment, None, self._version
            with self._all_or_nothing(len(self._made)):
                program = self._keep(build_program(self._context, *inputs, **self._constants))
                self._array = self._allocate(self._context.vertex_array, program, [])
        self._programs[added] = program
        return program


def stored_formats(target: moderngl.Framebuffer) -> tuple[str, ...]:
    """Return the formats of a target's images; () if compute shaders cannot store all that is drawn to it."""
    formats = tuple([image_format(one) if type(one) is moderngl.Texture else "" for one in target.color_attachments])
    return formats if target.depth_attachment is None and all(formats) else ()


class FullscreenPasses(Owner):
    """Whatever draws full-screen passes: each is made when it is first asked for."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._passes: dict[Any, FullscreenPass] = {}

    def fullscreen(self, fragment: str, look_up: bool | None = None, **constants: int) -> FullscreenPass:
        """Return a pass. look_up: for shaders that find splats, whether compute shaders drew them (OpenGL 4.3)."""
        constants |= {} if look_up is None else {"LOOK_UP": int(look_up)}
        key = fragment, *constants.items()
        if key not in self._passes:
            computes = self._context.version_code >= 430 and not wants_software(self._context)
            kind, version = ComputedPass if computes else FullscreenPass, 430 if look_up else 330
            self._passes[key] = self._keep(kind(self._context, fragment, version, **constants))
        return self._passes[key]


def set_inputs(program: moderngl.Program | moderngl.ComputeShader, inputs: dict[str, Any]) -> None:
    """Set uniforms by name. Every texture among them is bound, as a sampler or as an image, and the number of its unit
    put in its place."""
    textures.program = program
    unit, images = 0, (program.extra or _known_of(program))[""]
    for name, value in inputs.items():
        if type(value) is moderngl.Texture:
            assert unit < UNITS, "more textures than a caller's state is kept for"
            if name in images:
                _bind_image(program, name, value, unit)
            else:
                value.use(unit)
            inputs[name] = unit
            unit += 1
    set_uniforms(program, **inputs)


def bind_texture(
    program: moderngl.Program | moderngl.ComputeShader, name: str, texture: moderngl.Texture, unit: int
) -> None:
    """Bind a texture as the program reads it: as a sampler, or as an image."""
    textures.program = None
    if name in _known_of(program)[""]:
        _bind_image(program, name, texture, unit)
    else:
        texture.use(unit)


def _bind_image(
    program: moderngl.Program | moderngl.ComputeShader, name: str, texture: moderngl.Texture, unit: int
) -> None:
    if name not in program.extra:  # for the first time
        is_as_said = image_format(texture) == IMAGES[name]
        assert is_as_said, f"{name} must be {IMAGES[name]}: software drivers read it as an image"
    texture.bind_to_image(unit, read=True, write=False)


def image_format(texture: moderngl.Texture) -> str:
    """Return the name of a texture's format in GLSL; "" if images have none such."""
    bits = {"f4": "32f", "f2": "16f", "nu2": "16", "f1": "8"}.get(texture.dtype)
    return "rgba"[: texture.components] + bits if bits and texture.components != 3 else ""


def _known_of(program: moderngl.Program | moderngl.ComputeShader) -> dict[str, Any]:
    """Return the values of a program's uniforms that were set; under no name, those that it reads as images."""
    if program.extra is None:
        images = [name for name in program if name in IMAGES and getattr(program[name], "gl_type", 0) == IMAGE_2D]
        program.extra = {"": images}
    return program.extra


def data_texture(context: moderngl.Context, width: int, height: int, components: int) -> moderngl.Texture:
    """Return a float32 texture that is read texel by texel. Raises MemoryError where it does not fit."""
    texture = allocate(context, context.texture, (width, height), components, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


ADD, ONE, REST = 0x8006, 1, 0x0303  # what is there counts by the rest of the alpha
FACTORS = 0x80C9, 0x80C8, 0x80CB, 0x80CA  # of the source and of the target, for colour, then for alpha
EQUATIONS = 0x8009, 0x883D  # for colour, for alpha
BUFFERS = 3  # colours of a target that are added to


_adding: set[moderngl.Context] = set()  # whose draws are added to their target


class AdditiveBlend:
    """Additive blending. Afterwards the caller's own factors and equations are back: no other pass changes them.

    covers  draws hide what is there by their alpha, by which their colours are multiplied already
    """

    def __init__(self, context: moderngl.Context, covers: bool = False):
        self._context, self._gl = context, GL(context)
        self._factors = [ONE, REST if covers else ONE] * 2
        self._is_indexed = context.version_code >= 400  # each buffer has its own

    @managed
    def on(self) -> Generator[None, None, None]:
        """Add draws to their target inside the context."""
        before = [[self._asked(name, k) for name in (*FACTORS, *EQUATIONS)] for k in range(BUFFERS)]
        for k in range(BUFFERS):
            self._set(k, [*self._factors, ADD, ADD])
        self._context.enable_direct(BLEND)
        _adding.add(self._context)
        try:
            yield
        finally:
            _adding.discard(self._context)
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
