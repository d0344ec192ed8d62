"""Writes pages: what they show, and the parts that page.html is filled with, as one file."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import FilePath, Scenes, loaded, seen_by
from ..checks import check_choice, check_path, shown
from ..files.whole import check_place, written_whole
from ..finish import Finish
from ..frame import Frame
from ..gpu.mesh_objects import PlacedMesh
from ..ground import LIGHT as GROUND_LIGHT
from ..light import check_lights
from ..look import Look
from ..renderer import Renderer
from ..scene import Scene
from .coding import pack
from .contents import surfaces_of
from .parts import QUALITIES, Part, Quality, mesh_part, surface_part
from .shaders import shader_texts
from .showing import Showing, look_of

FOLDER = Path(__file__).resolve().parent
SCRIPTS = "state.js", "decode.js", "programs.js", "lights.js", "shadows.js", "take.js", "paint.js", "draw.js", "controls.js"
SUFFIXES = ".html", ".htm"
STILL = 85  # quality of the still's WebP

Source = Frame | Sequence[Frame] | Scene | FilePath


def write_page(renderer: Renderer, path: FilePath, source: Source, **options: Any) -> None:
    """Writes what `draw_page` makes, completely or not at all."""
    path = check_page_path(path)
    text = draw_page(renderer, source, **options)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def check_page_path(path: FilePath) -> Path:
    """The path, if a page can be written there. Raises ValueError for another suffix, OSError for no such place."""
    path = check_path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"cannot write {path}: a page's suffix is .html")
    return check_place(path)


def draw_page(
    renderer: Renderer, source: Source, *, quality: str = "exact", title: str = "pointshade", **options: Any
) -> str:
    """The page as a text."""
    check_choice("quality", quality, tuple(QUALITIES))
    if not isinstance(title, str):
        raise TypeError(f"title must be a text, got {shown(title)}")
    source = loaded(source)
    still = renderer.render(source, **options)
    showing = arranged(source, dict(options))
    parts = list(_parts(renderer, showing, QUALITIES[quality]))
    data = showing.values() | {"things": [head for head, _ in parts], "background": _css(options)}
    body = b"".join(content for _, content in parts)
    return _filled(title, still, data, body)


def arranged(source: Frame | Sequence[Frame] | Scene, options: dict[str, Any]) -> Showing:
    """What a page of these options of `Renderer.render` shows first."""
    look = Look(**{field.name: options[field.name] for field in fields(Look) if options.get(field.name) is not None})
    scene = Scenes().of(source, tuple(look.options.values()))
    names = ("samples", "background", "ground")
    finish = Finish(**{name: options[name] for name in names if name in options})
    lights = options.get("light")
    lights = lights if lights is not None else scene.lights or (GROUND_LIGHT if finish.ground else None)
    turn = tuple(options.get(name, 0.0) for name in ("yaw", "pitch", "dolly"))
    camera, seen = seen_by(source, scene, options.get("camera"), options.get("pose"), *turn)
    mover = scene if isinstance(source, Scene) else scene.things[0].content.frame
    is_own = isinstance(mover, Frame) and options.get("pose") is None
    home, turn = (mover.pose, turn) if is_own else (seen, (0.0, 0.0, 0.0))
    shading = "phong" if isinstance(source, Scene) else look.shading
    return Showing(mover, scene, camera, np.asarray(home), turn, check_lights(lights), shading)


def _parts(renderer: Renderer, showing: Showing, quality: Quality) -> Iterator[Part]:
    """The things of the scene."""
    with renderer.prepared(showing.scene, showing.camera, showing.home) as things:
        for placed, thing in things.items():
            meshes = [mesh_part(thing, quality)] if isinstance(thing, PlacedMesh) else []
            for head, body in meshes or (surface_part(surface, quality) for surface in surfaces_of(thing)):
                yield head | look_of(placed) | {"axes": showing.axes_of(head["axes"]).tolist()}, body


def _css(options: dict[str, Any]) -> str | None:
    """The background as CSS writes colours."""
    linear = Finish(background=options.get("background")).background
    if linear is None:
        return None
    encoded = (12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055 for c in linear)
    return f"rgb({', '.join(f'{255 * c:.0f}' for c in encoded)})"


def _filled(title: str, still: NDArray[np.uint8], data: dict[str, Any], body: bytes) -> str:
    """The template with its places filled, which look like {{title}}."""
    places = {
        "title": html.escape(title),
        "still": f"data:image/webp;base64,{_base64(_webp(still))}",
        "data": _json(data),
        "shaders": _base64(pack(json.dumps(shader_texts()).encode())),
        "parts": _base64(pack(body)),
        "script": "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS),
    }
    text = (FOLDER / "page.html").read_text(encoding="utf-8")
    pieces = text.split("{{")
    filled = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        filled += [places[name], rest]
    return "".join(filled)


def _json(data: Any) -> str:
    """JSON that no HTML parser takes for the end of its script."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _webp(image: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(file, "WEBP", quality=STILL)
    return file.getvalue()
