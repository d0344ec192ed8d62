"""Programs for software drivers: the same shaders, in words for which these make faster code.

llvmpipe (Mesa) compiles shaders for eight pixels at a time. A uniform of a fragment shader it gathers pixel by pixel,
but not a flat input; a sampler is a function call, but not an image whose format is known. The values are the same, bit
by bit: other drivers get the shaders as they stand in their files.
"""

from __future__ import annotations

import os
import re

import moderngl

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer", "swiftshader", "microsoft basic render")
IMAGES = {  # pictures that are read texel by texel, and their formats
    "depth_map": "r32f",
    "surface_map": "rgba32f",
    "other_map": "rgba32f",  # what is passed on as a surface_map is one, too
    "mixed_map": "rgba32f",
    "calm_depth": "rg32f",
    "strength_map": "rg32f",
    "lights": "rgba32f",
    "views": "rgba32f",
    "materials": "rgba32f",
}
IMAGE_2D = 0x904D  # type of a uniform
READS = (  # of an image; outside of it, imageLoad gives 0
    "#define IMAGE_SIZE(map, lod) imageSize(map)",
    "#define IMAGE_TEXEL(map, pixel, lod) imageLoad(map, pixel)",
    "vec4 texel_at(readonly image2D map, ivec2 pixel) { return imageLoad(map, pixel); }",
    "float depth_at(readonly image2D map, ivec2 p, ivec2 offset) { return imageLoad(map, p + offset).r; }",
    "vec2 depth_and_noise_at(readonly image2D map, ivec2 p, ivec2 offset) { return imageLoad(map, p + offset).rg; }",
)
_UNIFORM = re.compile(r"^uniform (float|u?int|[iu]?vec[234]|mat[34]) (\w+);", re.MULTILINE)
_NAMES = "|".join(IMAGES)


def is_software(renderer: str) -> bool:
    """Whether this is a driver's name that draws on the CPU."""
    return any(name in renderer.lower() for name in SOFTWARE)


def wants_software(context: moderngl.Context) -> bool:
    """Whether programs are built for a software driver. POINTSHADE_PROGRAMS=software or =hardware says it otherwise."""
    told = os.environ.get("POINTSHADE_PROGRAMS")
    return told == "software" if told else is_software(context.info["GL_RENDERER"])


def reads_images(context: moderngl.Context) -> bool:
    return context.version_code >= 430 and wants_software(context)


def by_flat_inputs(vertex: str, fragment: str) -> tuple[str, str, list[str]]:
    """The shaders of a full-screen pass, where the vertex shader hands on the uniforms of the fragment shader.

    Also returns the lines that go before the fragment shader.
    """
    found = {name: kind for kind, name in _UNIFORM.findall(fragment)}
    handed = [f"uniform {kind} {name}; flat out {kind} flat_{name};" for name, kind in found.items()]
    copies = " ".join(f"flat_{name} = {name};" for name in found)
    vertex = vertex.replace("void main() {", f"{' '.join(handed)} void main() {{ {copies}")
    fragment = _UNIFORM.sub(r"flat in \1 \2;", fragment)
    return vertex, fragment, [f"#define {name} flat_{name}" for name in found]


def by_images(text: str) -> tuple[str, list[str]]:
    """A shader that reads the pictures IMAGES as images, and the lines that go before it: none if it reads no such."""
    if not re.search(rf"^uniform sampler2D (?:{_NAMES});", text, re.MULTILINE):
        return text, []
    for name, layout in IMAGES.items():
        text = text.replace(f"uniform sampler2D {name};", f"layout({layout}) uniform readonly image2D {name};")
    text = re.sub(rf"\bsampler2D ({_NAMES})\b", r"readonly image2D \1", text)
    text = re.sub(rf"\btextureSize\(({_NAMES}),", r"IMAGE_SIZE(\1,", text)
    return re.sub(rf"\btexelFetch\(({_NAMES}),", r"IMAGE_TEXEL(\1,", text), list(READS)
