"""The one file of a page: page.html with its places filled, shaders, and what it knows of the command line."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..gpu.core.programs import splice
from ..notes.notes import print_note
from ..notes.words import printable
from ..scene.appearance import Appearance
from .page_contents import Showing
from .parts import encoded, pack

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


FOLDER = Path(__file__).resolve().parent
SCRIPTS = (
    "state.js", "decode.js", "programs.js", "lights.js", "shadows.js", "samples.js", "upload.js", "paint.js",
    "around.js", "clouds.js", "outlines.js", "draw.js", "film.js", "player.js", "pointers.js", "lamp_box.js",
    "command.js", "controls.js",
)  # fmt: skip
STILL = 85  # quality of the still's WebP


def filled(
    title: str, still: NDArray[np.uint8], data: dict[str, Any], body: bytes, frames: Sequence[bytes] = ()
) -> str:
    """The template with its places filled, which look like {{title}}. A note names each thing that the page leaves out.

    body    of all things
    frames  of a film: each frame's, which the page decodes when it comes to it
    """
    for sentence in data["leftOut"]:
        print_note(f"in the page {sentence}")
    places = {
        "title": html.escape(printable(title.encode("utf-8", "backslashreplace").decode())),  # it may be no text
        "still": f"data:image/webp;base64,{_base64(encoded(still, 'WEBP', quality=STILL))}",
        "data": _json(data),
        "shaders": _base64(pack(json.dumps(shader_texts()).encode())),
        "parts": _base64(pack(body)),
        "frames": "\n".join(f'<script type="text/plain" class="frame">{_base64(one)}</script>' for one in frames),
        "script": "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS),
    }
    text = (FOLDER / "page.html").read_text(encoding="utf-8")
    return re.sub(r"{{(.*?)}}", lambda place: places[place[1]], text, flags=re.DOTALL)


def _json(data: Any) -> str:
    """JSON that no HTML parser takes for the end of its script."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


CLOSE = 1e-3  # pixels: a camera that differs by less is the same


def command_of(showing: Showing, line: str | None) -> dict[str, Any] | None:
    """Return it for the JSON; None without a line, and where no `--picture-size` leads to the camera of the page.

    line  `pointshade render ...`, without lights, shading, view, size and samples

    isOwn means that the page's home is where the line looks from without `--pose`; turns, that the page turns around
    the same point as `--yaw`.
    """
    own, scene = showing.scene.camera, showing.scene
    assert own is not None, "scenes of requests have one"
    fitted = showing.camera.fitted(own.width, own.height)
    if line is None or not np.allclose(fitted.intrinsics, own.intrinsics, 0, CLOSE):
        return None
    is_own = bool(np.allclose(showing.home, scene.pose, 0, 1e-12))
    is_frame = showing.frame is not None and scene.instances[0].content.is_single
    return {
        "line": line,
        "shading": Appearance().shading,
        "isScene": showing.frame is None,
        "isOwn": is_own,
        "turns": is_own and is_frame,
        "home": np.asarray(showing.home).tolist(),
    }
