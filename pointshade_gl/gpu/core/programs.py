"""Builds programs from shader files: splices includes, and names file and line in the driver's errors."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from ...notes.errors import ShaderError
from ...scene.camera import Camera
from ..context.context import signals_later
from ..context.software_driver import by_flat_inputs, by_images, reads_images, wants_software

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
    context: moderngl.Context,
    vertex: str,
    fragment: str,
    folder: Path | None = None,
    version: int = 330,
    **constants: int,
) -> moderngl.Program:
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


def build_compute(context: moderngl.Context, name: str, **constants: int) -> moderngl.ComputeShader:
    """A compute program from one shader file. Raises ShaderError with file and line of the driver's complaints."""
    defines = [f"#define {constant} {value}" for constant, value in constants.items()]
    text, origin = _begin(context, name, splice(name), defines)
    try:
        with signals_later():
            return context.compute_shader(text)
    except moderngl.Error as error:
        raise ShaderError(translate_log(str(error), origin) or f"{name}: {error}") from error


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
    """Set uniforms by name. A name that the program does not have raises KeyError."""
    for name, value in values.items():
        uniform = program[name]
        if isinstance(value, bytes):
            uniform.write(value)  # type: ignore[union-attr]
        else:
            uniform.value = value  # type: ignore[union-attr]


def source_and_target(source: Camera, target: Camera, view: np.ndarray) -> dict[str, Any]:
    """Return the uniforms of every warp; view (4, 4) takes source axes to target axes."""
    return {"source": source.intrinsics, "target": target.intrinsics, "view": view.T.astype("f4").tobytes()}
