"""Writes pages: what they show, and the parts that page.html is filled with, as one file."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..files.access.atomic_write import check_place, written_whole
from ..files.access.written_suffixes import PAGES, check_suffix
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.drawables import Drawable
from ..gpu.meshes.mesh_objects import PlacedMesh
from ..messages.formatting import option, shown
from ..messages.notes import Note, print_note, taken_by
from ..messages.progress import Count, Progress
from ..messages.validation import check_choice, check_count, check_path, is_a
from ..rendering.renderer import Renderer
from ..rendering.request import GROUPS, STRAIGHT, FilePath, RenderRequest, RequestOptions, Scenes, Source
from ..scene.graph import Scene
from ..scene.option_fields import takes
from ..scene.placed import Placed
from ..scene.point_cloud import PointCloud
from ..scene.point_object import PointObject
from .cloud_parts import cloud_part
from .contents import surfaces_of
from .page_command import command_of
from .page_scene import Showing, look_of
from .parts import QUALITIES, Part, Quality, QualityName, encoded, mesh_part, surface_part
from .picture_coding import pack
from .reduced_frames import cloud_points, reduced
from .shaders import shader_texts

if TYPE_CHECKING:
    from typing_extensions import Unpack

FOLDER = Path(__file__).resolve().parent
SCRIPTS = (
    "state.js", "decode.js", "programs.js", "lights.js", "shadows.js", "samples.js", "upload.js", "paint.js",
    "around.js", "clouds.js", "draw.js", "pointers.js", "lamp_box.js", "command.js", "controls.js",
)  # fmt: skip
STILL = 85  # quality of the still's WebP
LARGEST = 2048  # pixels a side: so many have the textures of every browser


@takes(RequestOptions, *GROUPS, like=Renderer.render)
def write_page(
    renderer: Renderer,
    path: FilePath,
    source: Source,
    *,
    quality: QualityName = "exact",
    largest: int = LARGEST,
    title: str | None = None,
    command: str | None = None,
    notes: Note | None = None,
    progress: Progress | None = None,
    **options: Unpack[RequestOptions],
) -> None:
    """Write a frame, several frames of one thing, a scene or a cloud as one HTML file, in which the light can be moved.

    The file asks for nothing from outside. It needs a browser with WebGL 2 (all since 2023); others show a picture.
    Depths and normals are those that `render` draws with: "auto" smooths noise in the page, too. Where something cannot
    be shown (grounds, triangles between pixels, the mean of several frames), a note says so, and the page's help.

    The page begins with the picture that `render` gives. The mouse holds the first light, the others stay where they
    are. Where nothing moves it shows the mean of 16 samples, or as many as are asked for, with smooth outlines and soft
    shadows. The ground is in the picture for browsers without WebGL 2 only.

    Parameters
    ----------
    path : path
        The file, .html or .htm; it is written completely or not at all.
    source : Frame, sequence of Frame, Scene, PointCloud, path or RenderRequest
        What is shown, as `render` takes it.
    quality : {"exact", "small"}
        "exact": colours without loss, depths to 0.5 millionths, normals to 0.02 degrees, of clouds an even sample of up
        to 250 000 points. "small": about a third smaller, colours as JPEG, depths to 10 millionths, normals to 0.25
        degrees, half as many points.
    largest : int
        Pixels a side that depths and colours may have; of larger ones the page has every second, third, ... depth. Its
        square is the most points of clouds.
    title : str, optional
        What the page calls itself; None is the name of a path, or "pointshade".
    command : str, optional
        A line `pointshade render ...` that draws the source, without lights, shading, view and sizes: with these, the
        page copies the line of the picture that it shows. None: it has no button for that.
    progress : callable, optional
        As for `render`; the steps are those of the first picture, and each surface of the page. After `Cancelled` there
        is no file, or the one that was there before.

    Raises
    ------
    ValueError, TypeError
        For arguments that do not fit.
    OSError
        For a path that cannot be written.
    """
    path = check_page_path(path)
    text = draw_page(
        renderer, source, quality=quality, largest=largest, title=title, command=command, notes=notes,
        progress=progress, **options,
    )  # fmt: skip
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def check_page_path(path: FilePath) -> Path:
    """The path, if a page can be written there. Raises ValueError for another suffix, OSError for no such place."""
    path = check_path(path)
    check_suffix(path, PAGES, "the suffix of a page")
    return check_place(path)


@takes(RequestOptions, *GROUPS, like=Renderer.render)
def draw_page(
    renderer: Renderer,
    source: Source,
    *,
    quality: QualityName = "exact",
    largest: int = LARGEST,
    title: str | None = None,
    command: str | None = None,
    notes: Note | None = None,
    progress: Progress | None = None,
    **options: Unpack[RequestOptions],
) -> str:
    """The text of the page that `save_page` writes."""
    check_choice(option("quality"), quality, tuple(QUALITIES))
    check_count(largest, "largest", 1, "of pixels ")
    named = "pointshade" if not isinstance(source, str | PathLike) else Path(source).stem or str(source)
    if not is_a(title, str, type(None)):
        raise TypeError(f"title must be a text, got {shown(title)}")
    with taken_by(notes):
        request = RenderRequest.of(source, **options)
        whole, request = request, replace(request, source=reduced(request.source, largest, QUALITIES[quality].points))
        if isinstance(request.finish.exposure, str) and request.source is not whole.source:  # whose noise is another
            renderer.draw(whole)
            request = replace(request, finish=replace(request.finish, exposure=renderer.exposure))
        showing, count = replace(arranged(request), points=cloud_points(whole.source)), Count(progress)

        def drawn(done: int, all: int) -> None:
            count.all = all + _surfaces_in(showing.scene)
            count.step(done - count.done)

        still = renderer.render(request, progress=drawn if progress else None)
        gain, showing = 2.0**renderer.exposure, replace(showing, around=renderer.surroundings)
        parts: list[Part] = []
        for part in _parts(renderer, showing, QUALITIES[quality]):
            parts.append(part)
            count.step()
        data: dict[str, Any] = showing.values() | {"exposure": gain, "things": [head for head, _ in parts]}
        data["command"] = command_of(whole, command)
        for sentence in data["leftOut"]:
            print_note(f"in the page {sentence}")
    return _filled(named if title is None else title, still, data, b"".join(body for _, body in parts))


def largest_of(request: RenderRequest) -> int:
    """Return how many pixels a side a page of this request has at most: a smaller picture makes it smaller."""
    camera = request.camera
    return LARGEST if camera is None else min(max(camera.width, camera.height), LARGEST)


def arranged(request: RenderRequest) -> Showing:
    """Return what a page shows first."""
    scene = Scenes().of(request)
    lights, (camera, seen) = request.lights_of(scene), request.seen_by(scene)
    if isinstance(request.source, Scene | PointCloud):
        shading = request.source.shading if isinstance(request.source, PointCloud) else "phong"
        return Showing(scene, scene, camera, seen, STRAIGHT, lights, shading, request.finish)
    frame = scene.things[0].content.frame
    home, turns = (frame.pose, request.turns) if request.pose is None else (seen, STRAIGHT)
    return Showing(frame, scene, camera, home, turns, lights, request.look.shading, request.finish)


def _surfaces_in(scene: Scene) -> int:
    """How many parts a page of a scene has."""
    contents = (placed.content for placed in scene.things)
    return sum(len(content.frames) if isinstance(content, PointObject) else 1 for content in contents)


def _parts(renderer: Renderer, showing: Showing, quality: Quality) -> Iterator[Part]:
    """The things of the scene."""
    own = {} if showing.shading == "phong" else {"shading": "phong"}  # the page's shading is that of a thing alone
    with renderer.prepared(showing.scene, showing.camera, showing.home) as things:
        for placed, thing in things.items():
            for head, body in _parts_of(thing, quality):
                axes = np.linalg.inv(showing.home) @ head["axes"]  # to home axes
                more = {"axes": axes.tolist(), "lobe": showing.lobe_of(placed), "middle": _middle(placed)}
                yield head | look_of(placed) | own | more, body


def _middle(placed: Placed) -> float | None:
    """How far the points of a frame are, in its unit."""
    return placed.content.frame.scale if isinstance(placed.content, PointObject) else None


def _parts_of(thing: Drawable, quality: Quality) -> Iterator[Part]:
    if isinstance(thing, PlacedMesh):
        yield mesh_part(thing, quality)
    elif isinstance(thing, PlacedCloud):
        yield cloud_part(thing, quality)
    else:
        yield from (surface_part(surface, quality) for surface in surfaces_of(thing))


def _filled(title: str, still: NDArray[np.uint8], data: dict[str, Any], body: bytes) -> str:
    """The template with its places filled, which look like {{title}}."""
    places = {
        "title": html.escape(title),
        "still": f"data:image/webp;base64,{_base64(encoded(still, 'WEBP', quality=STILL))}",
        "data": _json(data),
        "shaders": _base64(pack(json.dumps(shader_texts()).encode())),
        "parts": _base64(pack(body)),
        "script": "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS),
    }
    text = (FOLDER / "page.html").read_text(encoding="utf-8")
    return re.sub(r"{{(.*?)}}", lambda place: places[place[1]], text, flags=re.DOTALL)


def _json(data: Any) -> str:
    """JSON that no HTML parser takes for the end of its script."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
