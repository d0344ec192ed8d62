"""Pages in which the frames of a sequence play: each seen by its own camera, in the light that the mouse holds."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from ..checks.arguments import Count, check_fps, is_a
from ..files.frame_sources import open_source
from ..gpu.points.point_objects import ShownPoints
from ..notes.notes import print_note
from ..notes.words import option, shown
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import sequence_jobs
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.viewpoint import View
from .contents import Surface, surfaces_of
from .film_coding import FILM_QUALITIES, FilmCoder
from .page_scene import Showing, arranged, look_of
from .parts import Part, QualityName
from .reduced_frames import reduced
from .template import filled

MOST_FRAMES = 300  # that a page takes unless more are asked for


def frames_of(source: Any, count: int | None = None) -> Sequence[Frame]:
    """Return the frames that play: of a path those of its sequence. count: only so many.

    Raises TypeError or ValueError for what has no frames to play, and what `open_source` raises.
    """
    if is_a(source, str, PathLike):
        source = open_source(source)
    if isinstance(source, Frame):
        raise ValueError(f"a single frame does not play: leave out {option('fps')}")
    if not is_a(source, Sequence):
        raise TypeError(f"what plays must be a sequence of frames, got {shown(source)}")
    if count is None and len(source) > MOST_FRAMES:
        more = f"the page has the first {MOST_FRAMES} of {len(source)} frames; {option('frames', 'N')} takes N"
        print_note(more)
    return source[: count or MOST_FRAMES]


def draw_film(
    renderer: Renderer,
    frames: Sequence[Frame],
    view: View,
    fps: float,
    *,
    camera: Camera | None = None,
    quality: QualityName,
    largest: int,
    title: str,
    count: Count,
    skipped: Callable[[str], None] = lambda text: print_note(f"skipped {text}"),
) -> str:
    """The text of a page in which frames play, `fps` a second, again and again.

    They are seen as in a film of `view`: each from its own camera, all in the exposure of the first.

    camera  who looks; None: that of the view, or of the frames
    """
    fps, count.all = check_fps(fps, option("fps"), "frames"), len(frames) + 1
    film = _Film(renderer, quality, count)
    parts = film.parts(_small(sequence_jobs(frames, view, skipped, renderer), largest, camera))
    bodies = list(parts)
    if film.first is None:
        raise ValueError("the page has nothing to show: no frame could be read")
    data: dict[str, Any] = film.values | {"film": {"fps": fps, "frames": film.heads}}
    for sentence in data["leftOut"]:
        print_note(f"in the page {sentence}")
    return filled(title, film.still, data, b"", bodies)


def _small(
    jobs: Generator[tuple[int, RenderRequest], None, None], largest: int, camera: Camera | None
) -> Generator[RenderRequest, None, None]:
    for _, request in jobs:
        source = reduced(request.source, largest, largest**2)
        yield replace(request, source=source, camera=camera or request.camera)


class _Film:
    """What the page of a film is filled with, frame by frame.

    first  what the page shows first, once there is something
    """

    def __init__(self, renderer: Renderer, quality: QualityName, count: Count):
        self._renderer, self._quality, self._count = renderer, FILM_QUALITIES[quality], count
        self._coder: FilmCoder | None = None
        self.first: Showing | None = None
        self.heads: list[dict[str, Any]] = []

    def parts(self, requests: Iterable[RenderRequest]) -> Generator[bytes, None, None]:
        """The packed bytes of each frame; their heads are in `heads`."""
        for request in requests:
            showing = arranged(request)
            if self.first is None:
                self.still = self._renderer.render(request)
                self._count.step()
                self.first = showing = replace(showing, around=self._renderer.surroundings)
                self.values = showing.values() | {"exposure": 2.0**self._renderer.exposure}
            head, body = self._part(showing, self.first)
            self.heads.append(head)
            self._count.step()
            yield body

    def _part(self, showing: Showing, first: Showing) -> Part:
        home = np.linalg.inv(first.home)
        with self._renderer.prepared(showing.scene, showing.camera, showing.home) as things:
            ((placed, thing),) = things.items()
            (surface,) = surfaces_of(thing, is_cut=False)
            noise = thing.textures.choice.noise if isinstance(thing, ShownPoints) else None
        if self._coder is None:
            known = surface.depth[surface.depth != 0]
            nearest = float(np.abs(known).min()) if known.size else 1.0
            self._coder = FilmCoder(self._quality, noise.relative if noise else 0.0, nearest)
            own = {} if showing.shading == "phong" else {"shading": "phong"}
            more = {"lobe": first.lobe_of(placed), "depthStep": self._coder.step, "nearest": nearest}
            self._thing = _thing_of(surface) | look_of(placed) | own | more
            self.values["things"] = [self._thing]
        size = surface.depth.shape[::-1]
        if size != (self._thing["width"], self._thing["height"]):
            raise ValueError(
                f"the frames of a page have one size: frame {len(self.heads)} has {size[0]}x{size[1]} pixels, the "
                f"first {self._thing['width']}x{self._thing['height']}"
            )
        head, body = self._coder.code(surface)
        seen_from_first = replace(showing, home=first.home)
        return head | {
            "axes": (home @ surface.axes).tolist(),
            "way": (home @ showing.home).tolist(),
            "middle": placed.content.frame.scale,
            "bounds": seen_from_first.bounds,
            "distance": seen_from_first.distance,
        }, body


def _thing_of(surface: Surface) -> dict[str, Any]:
    """What all frames of a film have in common."""
    height, width = surface.depth.shape
    if surface.sizes.size > 1:
        raise ValueError(f"sizes of each point are of one frame, here many play: leave out {option('point_size')}")
    return {
        "kind": "points",
        "isFilm": True,
        "width": width,
        "height": height,
        "color": {"width": surface.colors.shape[1], "height": surface.colors.shape[0]},
        "size": float(surface.sizes[0]),
        "hasRims": not surface.is_round and bool((surface.sizes == 1).all()),
        "isRound": surface.is_round,
        "stride": surface.stride,
        "scale": surface.scale,
        "behind": surface.behind,
    }
