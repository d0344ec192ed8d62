"""The shaders of a page: the files of shaders/ as they are, for WebGL 2."""

from __future__ import annotations

import re

from ..gpu.core.programs import splice

ENTRIES = (
    "fullscreen.vert", "points/splats.vert", "points/splats.frag", "points/rims.vert", "points/rims.frag",
    "points/resolve_surfaces.frag", "shading/light.frag", "surface/hidden_in_plane.frag", "surface/mean_hidden.frag",
    "surface/visibility.frag", "shading/view_visibility.frag", "shading/shadow.frag", "surface/hidden_planes.frag",
    "meshes/mesh.vert", "meshes/mesh.frag", "meshes/mesh_lit.vert", "meshes/mesh_lit.frag", "meshes/mesh_shadow.frag",
    "clouds/splat.vert", "clouds/depth.frag", "clouds/front.frag", "clouds/blend.frag", "clouds/resolve.frag",
    "clouds/ball.frag", "surface/film_surface.frag", "surface/film_colors.frag", "surface/film_change.frag",
    "output/resolve_samples.frag", "points/view_insides.frag", "points/outline_points.frag", "points/kept_points.frag",
)  # fmt: skip
PRECISION = "".join(f"precision highp {kind};\n" for kind in ("float", "int", "sampler2D", "isampler2D"))
_COMMENT = re.compile(r"[ \t]*//[^\n]*")


def shader_texts() -> dict[str, str]:
    """The text of each shader by its name. `#version 300 es` and constants go before it."""
    return {name: as_es(splice(name)[0]) for name in ENTRIES}


def as_es(text: str) -> str:
    """A shader without its first line, its comments and empty lines, with the precision that GLSL ES asks for."""
    body = _COMMENT.sub("", text.split("\n", 1)[1])
    return PRECISION + re.sub(r"\n+", "\n", body)
