"""Runs one function of shaders/common on the GPU for many arguments at once, to compare it with its mirror."""

from __future__ import annotations

import re
from pathlib import Path

import moderngl
import numpy as np

from pointshade_gl.gpu.core.programs import bind_texture, build_program, shader_folder

COMMON = sorted((shader_folder() / "common").glob("*.glsl"))
_KIND = r"void|bool|u?int|float|[iub]?vec[234]|mat[234](?:x[34])?|[A-Z]\w+"
_FUNCTION = re.compile(rf"^(?:{_KIND})(?:\[\w+\])?\s+(\w+)\s*\(", re.MULTILINE)


def functions_of(path: Path) -> list[str]:
    """The names of the functions that a shader file defines."""
    return _FUNCTION.findall(re.sub(r"//.*", "", path.read_text()))


def evaluate(
    context: moderngl.Context,
    tmp_path: Path,
    include: str,
    expression: str,
    before: str = "",
    **inputs: np.ndarray | int,
) -> np.ndarray:
    """`expression`, a vec4, for each row of the inputs: float arrays (n, 1..4), available by their names.

    A name that ends in `_map` is a texture (h, w) or (h, w, 2 or 4), float32 or int32, the same for all rows; an int is
    a constant of the shader. before: GLSL statements
    """
    constants = {name: value for name, value in inputs.items() if isinstance(value, int)}
    inputs = {name: value for name, value in inputs.items() if name not in constants}
    count = max(len(x) for name, x in inputs.items() if not name.endswith("_map"))
    declarations, body, textures = [], [], {}
    for name, values in inputs.items():
        is_int = getattr(values, "dtype", None) == np.int32
        array = np.asarray(values, np.int32 if is_int else np.float32)
        declarations.append(f"uniform {'i' * is_int}sampler2D {name if name.endswith('_map') else name + '_rows'};")
        if not name.endswith("_map"):
            array = np.broadcast_to(array, (count, array.shape[-1]))[None]
            kind = ("float", "vec2", "vec3", "vec4")[array.shape[-1] - 1]
            swizzle = "rgba"[: array.shape[-1]]
            body.append(f"    {kind} {name} = texelFetch({name}_rows, ivec2(gl_FragCoord.xy), 0).{swizzle};")
        if array.ndim == 2:
            array = array[..., None]
        kind, data = "i4" if is_int else "f4", np.ascontiguousarray(array).tobytes()
        texture = context.texture(array.shape[1::-1], array.shape[2], data, dtype=kind)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        textures[name if name.endswith("_map") else f"{name}_rows"] = texture
    lines = ["#version 330 core", f'#include "common/{include}"', *declarations, "out vec4 result;", "void main() {"]
    (tmp_path / "call.frag").write_text("\n".join([*lines, *body, before, f"    result = vec4({expression});", "}"]))
    (tmp_path / "fullscreen.vert").write_text((shader_folder() / "fullscreen.vert").read_text())
    if not (tmp_path / "common").exists():
        (tmp_path / "common").symlink_to(shader_folder() / "common")
    program = build_program(context, "fullscreen.vert", "call.frag", tmp_path, **constants)
    for unit, (name, texture) in enumerate(textures.items()):
        if name in program:  # the compiler drops what the expression does not use
            bind_texture(program, name, texture, unit)
            program[name].value = unit
    output = context.texture((count, 1), 4, dtype="f4")
    target = context.framebuffer([output])
    target.use()
    array = context.vertex_array(program, [])
    array.render(moderngl.TRIANGLES, 3)
    answer = np.frombuffer(output.read(), np.float32).reshape(count, 4).copy()
    for item in (array, target, output, program, *textures.values()):
        item.release()
    return answer
