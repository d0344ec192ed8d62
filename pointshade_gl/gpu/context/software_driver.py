"""What software drivers need: shaders rewritten so that they run faster, and freed memory kept between calls."""

from __future__ import annotations

import ctypes
import os
import re
import sys
from functools import cache
from typing import Any

import moderngl

SOFTWARE = (  # drivers that draw on the CPU, also under zink: "zink (llvmpipe (LLVM 15.0.6, 256 bits))"
    "llvmpipe", "softpipe", "swrast", "software rasterizer", "swiftshader", "lavapipe", "microsoft basic render",
    "apple software renderer", "gdi generic",
)  # fmt: skip
IMAGES = {  # pictures that are read texel by texel, and their formats
    **dict.fromkeys(("depth_map", "triangle_map", "weight_map", "active_map"), "r32f"),
    **dict.fromkeys(("calm_depth", "strength_map", "scatter_map"), "rg32f"),
    **dict.fromkeys(("patches", "planes", "patch_steps", "lights", "views", "materials"), "rgba32f"),
    **dict.fromkeys(("light_map", "albedo_map", "surface_map", "gain_map", "hue_map", "light_normals"), "rgba32f"),
    **dict.fromkeys(("near_planes", "other_planes", "colors_map", "evidence_map", "completed_map"), "rgba32f"),
    **dict.fromkeys(("point_map", "plane_map", "mean_map", "numbers_map"), "rgba32f"),
    **dict.fromkeys(("witness_map", "joined_map", "doubt_map"), "rgba32f"),
    **dict.fromkeys(("shade_map", "shine_map"), "rgba16f"),
    **dict.fromkeys(("other_map", "mixed_map"), "rgba32f"),  # what is passed on as a surface_map is one, too
}
IMAGE_2D = 0x904D  # type of a uniform
READS = (  # of an image; outside of it, imageLoad gives 0
    "#define IMAGE_SIZE(map, lod) imageSize(map)",
    "#define IMAGE_TEXEL(map, pixel, lod) imageLoad(map, pixel)",
    "vec4 texel_at(readonly image2D map, ivec2 pixel) { return imageLoad(map, pixel); }",
    "vec4 texel_or_zero(readonly image2D map, ivec2 pixel) { return imageLoad(map, pixel); }",
    "float depth_at(readonly image2D map, ivec2 p, ivec2 offset) { return imageLoad(map, p + offset).r; }",
    "vec2 depth_and_noise_at(readonly image2D map, ivec2 p, ivec2 offset) { return imageLoad(map, p + offset).rg; }",
)
# Patterns that begin with letters are searched ten times as fast.
_UNIFORM = re.compile(r"\nuniform (float|u?int|[iu]?vec[234]|mat[34]) (\w+);")
_NAMES = "|".join(IMAGES)
_ARGUMENT = re.compile(rf"sampler2D ({_NAMES})\b")
_SIZE = re.compile(rf"textureSize\(({_NAMES}),")
_TEXEL = re.compile(rf"texelFetch\(({_NAMES}),")


def is_software(renderer: str) -> bool:
    """Return whether this is the name of a driver that draws on the CPU."""
    return any(name in renderer.lower() for name in SOFTWARE)


def wants_software(context: moderngl.Context) -> bool:
    """Return whether to build programs for a software driver; POINTSHADE_PROGRAMS=software or =hardware overrides."""
    told = os.environ.get("POINTSHADE_PROGRAMS")
    return told == "software" if told else is_software(context.info["GL_RENDERER"])


def reads_images(context: moderngl.Context) -> bool:
    return context.version_code >= 430 and wants_software(context)


def by_flat_inputs(vertex: str, fragment: str) -> tuple[str, str, list[str]]:
    """Return the shaders of a full-screen pass with the fragment shader's uniforms as flat inputs from the vertex
    shader.

    Also returns the lines that go before the fragment shader.
    """
    found = {name: kind for kind, name in _UNIFORM.findall(fragment)}
    handed = [f"uniform {kind} {name}; flat out {kind} flat_{name};" for name, kind in found.items()]
    copies = " ".join(f"flat_{name} = {name};" for name in found)
    vertex = vertex.replace("void main() {", f"{' '.join(handed)} void main() {{ {copies}")
    fragment = _UNIFORM.sub(r"\nflat in \1 \2;", fragment)
    return vertex, fragment, [f"#define {name} flat_{name}" for name in found]


def by_copies(text: str) -> str:
    """Return a compute shader that reads each uniform once, at its beginning: llvmpipe reads it anew, lane by lane,
    wherever it stands, also in loops.
    """
    names = [name for _, name in _UNIFORM.findall(text)]
    if names:
        text = re.sub(rf"\b({'|'.join(names)})\b", r"own_\1", text)
    return _UNIFORM.sub(_copied, text)


def _copied(declared: re.Match[str]) -> str:
    """Return the declarations of a uniform and of its copy, whose bits take a way through another type: a plain copy
    would be replaced by what it is a copy of."""
    kind, own = declared.groups()
    name = own.removeprefix("own_")
    if kind[0] in "iu":
        other = {"i": "u", "u": "i"}[kind[0]] + kind[1:] if "vec" in kind else {"int": "uint", "uint": "int"}[kind]
        parts = f"{other}({name})"
    elif kind[0] == "m":
        parts = ", ".join(f"uintBitsToFloat(floatBitsToUint({name}[{k}]))" for k in range(int(kind[3])))
    else:
        parts = f"uintBitsToFloat(floatBitsToUint({name}))"
    return f"\nuniform {kind} {name}; {kind} {own} = {kind}({parts});"


def by_images(text: str) -> tuple[str, list[str]]:
    """Return a shader that reads the textures IMAGES as images, and the lines that go before it, if it reads any."""
    images = {
        f"uniform sampler2D {name};": f"layout({kind}) uniform readonly image2D {name};"
        for name, kind in IMAGES.items()
    }
    found = [uniform for uniform in images if uniform in text]
    if not found:
        return text, []
    for uniform in found:
        text = text.replace(uniform, images[uniform])
    text = _ARGUMENT.sub(r"readonly image2D \1", text)
    text = _SIZE.sub(r"IMAGE_SIZE(\1,", text)
    return _TEXEL.sub(r"IMAGE_TEXEL(\1,", text), list(READS)


M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # their numbers in malloc.h


def keep_freed_memory() -> None:
    """Ask glibc to keep up to 256 MB of freed memory for this process instead of returning it to the system.

    A software driver takes and frees about 60 MB for each picture of 300 000 points. Given back each time, that memory
    costs 15 000 page faults a picture, a quarter of the time; and the arrays of a frame and its picture, each mapped
    anew beyond 128 kB, another 1000, a tenth of it. On a GPU these are most of what reading a picture takes.
    """
    _call_malloc("mallopt", M_TRIM_THRESHOLD, 256 << 20)
    _call_malloc("mallopt", M_MMAP_THRESHOLD, 32 << 20)  # the most that it takes


def return_freed_memory() -> None:
    """Ask glibc to return all freed memory to the system."""
    _call_malloc("malloc_trim", 0)


def _call_malloc(name: str, *arguments: int) -> None:
    function = _of_glibc(name) if os.environ.get("POINTSHADE_MALLOC") != "default" else None
    if function is not None:
        function(*arguments)


@cache
def _of_glibc(name: str) -> Any:
    """Return one of its functions; None where there is none, as in musl and on other systems."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None
