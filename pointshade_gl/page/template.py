"""The one file of a page: page.html with its places filled."""

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

from ..notes.words import printable
from .parts import encoded
from .picture_coding import pack
from .shaders import shader_texts

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
    """The template with its places filled, which look like {{title}}.

    body    of all things
    frames  of a film: each frame's, which the page decodes when it comes to it
    """
    places = {
        "title": html.escape(
            printable(title.encode("utf-8", "backslashreplace").decode())
        ),  # a file's name may be no text
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
