"""Writes pages, as one file or into a notebook's cell."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks.arguments import Count, Progress, check_choice, check_count, check_path, is_a
from ..files.access.atomic_write import check_place, written_whole
from ..files.access.known_names import PAGES, check_suffix
from ..files.frame_sources import prefetched
from ..gpu.clouds.splat_layer import PlacedSplats
from ..notes.notes import Note, taken_by
from ..notes.words import option, shown
from ..pipeline.light_setup import roughness_of
from ..renderer.renderer import Renderer
from ..renderer.requests import GROUPS, FilePath, RenderRequest, RequestOptions, Source, turnable
from ..scene.appearance import NOT_LIT
from ..scene.frame import Frame
from ..scene.option_fields import takes
from .films import draw_film, frames_of
from .page_contents import Showing, arranged, cloud_points, command_of, look_of, reduced
from .parts import QUALITIES, Part, Quality, QualityName, filled, parts_of, splats_part

if TYPE_CHECKING:
    from typing_extensions import Unpack

ONE_SURFACE = "several frames are one surface, the same from everywhere, without points that other frames contradict"
LARGEST = 2048  # pixels a side: so many have the textures of every browser


@takes(RequestOptions, *GROUPS, like=Renderer.render)
def write_page(
    renderer: Renderer, path: FilePath, source: Source, *, fps: float | None = None, quality: QualityName = "exact",
    largest: int = LARGEST, title: str | None = None, command: str | None = None, notes: Note | None = None,
    progress: Progress | None = None, **options: Unpack[RequestOptions],
) -> None:  # fmt: skip
    """Write a frame, several frames of one thing, a scene or a cloud as one HTML file, in which the light can be moved.

    The file asks for nothing from outside. It needs a browser with WebGL 2 (all since 2023); others show a picture.
    Depths and normals are those that `render` draws with: "auto" smooths noise in the page, too. Where something cannot
    be shown (grounds, triangles between pixels), a note says so, and the page's help. Several frames without noise are
    drawn as `render` draws them. Of others each part of the surface is sent once: from the frame that sees it best, the
    mean of all that see it.

    The page begins with the picture that `render` gives. The mouse holds the first light, the others stay where they
    are. Where nothing moves it shows the mean of 16 samples, or as many as are asked for, with smooth outlines and soft
    shadows. The ground is in the picture for browsers without WebGL 2 only.

    Parameters
    ----------
    path : path
        The file, .html or .htm; it is written completely or not at all.
    source : Frame, sequence of Frame, Scene, PointCloud, path or RenderRequest
        What is shown, as `render` takes it.
    fps : float, optional
        Frames per second: the frames of a sequence play, again and again, each seen by its own camera, instead of being
        drawn as one object; a path is read as its sequence. Each frame takes at most about 300 kB at 640x480: depths
        are kept to a sixth of their noise or better, normals to about half a degree, colours to about 37 dB (35 if
        "small"); lit pictures agree with stills of the frames to about 38 dB from their own cameras, 36 from elsewhere.
    quality : {"exact", "small"}
        "exact": colours without loss, depths to 0.5 millionths, normals to 0.02 degrees, of clouds an even sample of up
        to 250 000 points, of a million trained splats those that show most. "small": about a third smaller, colours as
        JPEG, depths to 10 millionths, normals to 0.25 degrees, 125 000 points and splats.
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
        renderer, source, fps=fps, quality=quality, largest=largest, title=title, command=command, notes=notes,
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
    renderer: Renderer, source: Source, *, fps: float | None = None, quality: QualityName = "exact",
    largest: int = LARGEST, title: str | None = None, command: str | None = None, notes: Note | None = None,
    progress: Progress | None = None, **options: Unpack[RequestOptions],
) -> str:  # fmt: skip
    """The text of the page that `save_page` writes."""
    check_choice(option("quality"), quality, tuple(QUALITIES))
    check_count(largest, "largest", 1, "of pixels ")
    if not is_a(title, str, type(None)):
        raise TypeError(f"title must be a text, got {shown(title)}")
    if title is None:
        title = "pointshade" if not isinstance(source, str | PathLike) else Path(source).stem or str(source)
    with taken_by(notes):
        if fps is not None:
            frames = frames_of(source)
            request = RenderRequest.of(_first_of(frames), **options)
            return draw_film(
                renderer, frames, request.view, fps, camera=request.camera, quality=quality, largest=largest,
                title=title, count=Count(progress),
            )  # fmt: skip
        request = RenderRequest.of(turnable(source, options), **options)
        whole = arranged(request)
        points, splats = cloud_points(whole.scene)
        smaller = reduced(request, largest, QUALITIES[quality].points, points, QUALITIES[quality].splats)
        if isinstance(request.finish.exposure, str) and smaller is not request:  # whose noise is another
            renderer.draw(request)
            smaller = replace(smaller, finish=replace(request.finish, exposure=renderer.exposure, fill=renderer.fill))
        showing, count = arranged(smaller), Count(progress)
        surfaces = len(showing.scene.instances)

        def drawn(done: int, all: int) -> None:
            count.all = all + surfaces
            count.step(done - count.done)

        still = renderer.render(smaller, progress=drawn if progress else None)
        gain = 2.0**renderer.exposure
        with renderer.prepared(showing.scene, showing.camera, showing.home) as things:
            roughness = roughness_of(things)
        showing = replace(showing, environment_light=renderer.surroundings, fill=renderer.fill, roughness=roughness)
        parts: list[Part] = []
        for part in _parts(renderer, showing, QUALITIES[quality]):
            parts.append(part)
            count.step()
        data: dict[str, Any] = showing.values(points, splats) | {"exposure": gain}
        data["things"] = [head for head, _ in parts]
        if any(head.get("isExact") is False for head, _ in parts):
            data["leftOut"].append(ONE_SURFACE)
        data["command"] = command_of(whole, command)
        return filled(title, still, data, b"".join(body for _, body in parts))


def _first_of(frames: Sequence[Frame]) -> Frame:
    """The first frame that can be read. Raises ValueError if there is none."""
    with closing(prefetched(frames, lambda _: None)) as read:
        first = next(read, None)
    if first is None:
        raise ValueError("the page has nothing to show: no frame could be read")
    return first


def largest_of(request: RenderRequest) -> int:
    """Return how many pixels a side a page of this request has at most: a smaller picture makes it smaller."""
    camera = request.camera
    return LARGEST if camera is None else min(max(camera.width, camera.height), LARGEST)


def _parts(renderer: Renderer, showing: Showing, quality: Quality) -> Iterator[Part]:
    """The things of the scene."""
    to_home = np.linalg.inv(showing.home).astype(np.float64)
    with renderer.prepared(showing.scene, showing.camera, showing.home) as things:
        trained = {placed: thing for placed, thing in things.items() if isinstance(thing, PlacedSplats)}
        for placed, thing in things.items():
            if placed in trained:
                continue
            middle = placed.content.frame.scale if placed.content.frames else None  # in its unit
            for head, body in parts_of(thing, quality):
                for one in head, *head.get("views", ()):
                    one |= {"axes": (to_home @ one["axes"]).tolist(), "middle": middle}
                yield head | look_of(placed, showing) | {"lobe": showing.lobe_of(placed)}, body
    if trained:
        looks = {placed: look_of(placed, showing) for placed in trained}
        lit = {placed: look["shading"] not in NOT_LIT for placed, look in looks.items()}
        head, body = splats_part(
            [(thing, lit[placed]) for placed, thing in trained.items()], to_home, quality.jpeg is None
        )
        first = max(trained, key=lambda placed: (lit[placed], looks[placed]["shading"] == "edl"))
        yield head | looks[first] | {"lobe": showing.lobe_of(first), "middle": None}, body


HEIGHT = 480  # CSS pixels
MIN_HEIGHT = 120
MAX_CELL_BYTES = 2_500_000  # bytes: Jupyter drops outputs of 3 million bytes and more in its first setting


class Cell:
    """What a notebook shows as a page. `html` is the page itself."""

    def __init__(self, page: str, title: str, height: int):
        self.html, self._title, self._height = page, title, height

    def _repr_html_(self) -> str:
        """A frame whose scripts run and save pictures, and that can reach neither the notebook nor anything else."""
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" title="{html.escape(self._title)}" '
            'sandbox="allow-scripts allow-downloads" allow="clipboard-write" allowfullscreen '
            f'style="display: block; width: 100%; height: {self._height}px; border: 0"></iframe>'
        )

    def __repr__(self) -> str:
        return f"Cell({len(self.html) / 1e6:.1f} MB, {self._height} pixels high)"


@takes(RequestOptions, *GROUPS, like=Renderer.render)
def draw_cell(
    renderer: Renderer, source: Source, *, height: int = HEIGHT, quality: QualityName | None = None,
    title: str = "pointshade", notes: Note | None = None, progress: Progress | None = None,
    **options: Unpack[RequestOptions],
) -> Cell:  # fmt: skip
    """Show a frame, several frames of one thing, a scene or a cloud in a notebook: the light is under the mouse.

    As the last line of a cell it shows itself.

    Parameters
    ----------
    source : Frame, sequence of Frame, Scene, PointCloud, path or RenderRequest
        What is shown, as `render` takes it.
    height : int
        Of the cell, CSS pixels; it is as wide as the notebook.
    quality : {"exact", "small"}, optional
        As for `save_page`; None: "exact", or "small" where that would be more than 2.5 MB. Notebooks keep each page,
        and Jupyter drops outputs of 3 MB and more unless ServerApp.iopub_data_rate_limit is raised.
    title : str
        What the page says below its picture.

    Raises
    ------
    ValueError, TypeError
        For arguments that do not fit.
    """
    height = check_count(height, "height", MIN_HEIGHT, "of pixels ")
    draw = partial(draw_page, renderer, source, title=title, notes=notes, progress=progress, **options)
    page = draw(quality=quality or "exact")
    if quality is None and len(page) > MAX_CELL_BYTES:
        page = draw(quality="small")
    return Cell(page, title, height)
