"""Writes many pictures to a film or to numbered files, and contact sheets of frames."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count, Progress, check_type
from ..files.access.known_names import is_numbered, numbered
from ..files.frame_sources import prefetched
from ..files.pictures.picture_files import normals_to_rgb, save_image
from ..files.writing.film import Film
from ..notes.notes import print_note
from ..notes.words import counted, option
from ..scene.appearance import SurfaceOptions
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.option_fields import keys_of
from ..scene.viewpoint import TURN, TURNTABLES, View, views_of_turn
from .renderer import Renderer
from .requests import RenderRequest

# to decode, and as many to encode; more than cores, because they often wait for Python's lock, which drawing holds
THREADS = min(16, 2 * (os.cpu_count() or 2))
Job = tuple[int, RenderRequest]  # number of the picture
Made = TypeVar("Made")  # of a job: a picture, depth, normals or points


def jobs_of(
    source: Frame | Scene | Sequence[Frame], view: View, turntable: str | None, count: int | None,
    skipped: Callable[[str], None], renderer: Renderer | None = None,
) -> tuple[Generator[Job, None, None], int]:  # fmt: skip
    """The jobs of a film of the source, and how many there are.

    turntable  moves the light or the camera in `count` pictures (default 75), see `views_of_turn`; of a sequence, while
               its first `count` frames play. None shows these as they are
    renderer   that corrects the poses of a sequence, if its look asks for it; None leaves them

    Raises ValueError if nothing moves: for a single frame or a scene without a turntable.
    """
    if isinstance(source, Frame | Scene):
        if turntable is None:
            turn = option("turntable", *TURNTABLES[:2])
            raise ValueError(f"a single frame cannot become a film: pass {turn}, or write a single picture")
        views = views_of_turn(source, view, turntable, count or TURN)
        return ((k, RenderRequest.seen(source, view)) for k, view in enumerate(views)), count or TURN
    source = source[:count]
    turn = None if turntable is None else partial(views_of_turn, view=view, what=turntable, count=len(source))
    return sequence_jobs(source, view, skipped, renderer, turn), len(source)


def sequence_jobs(
    source: Iterable[Frame], view: View, skipped: Callable[[str], None], renderer: Renderer | None = None,
    turn: Callable[[Frame], Iterator[View]] | None = None,
) -> Generator[Job, None, None]:  # fmt: skip
    """The frames of a source with their numbers. A frame that cannot be read leaves a gap.

    turn  gives views around the first frame, in place of the one view of all

    The camera turns around a point as far ahead as the first frame's pivot: from frame to frame the pivot jitters.
    """
    number, ahead, views = 0, None, repeat(view)

    def skip(sentence: str) -> None:
        nonlocal number
        number += 1
        skipped(sentence)

    with closing(prefetched(source, skip, THREADS)) as frames:
        surface = {name: getattr(view.look, name) for name in keys_of(SurfaceOptions)}
        moves = Corrections()
        for frame in moves.noted(renderer, frames, surface) if renderer and view.look.align else frames:
            check_type(frame, Frame, "what the source gives")
            if ahead is None:
                ahead = frame.pose[:3, :3].T @ (frame.pivot - frame.pose[:3, 3])
                views = views if turn is None else turn(frame)
            yield number, RenderRequest.seen(frame, next(views), frame.pose[:3, :3] @ ahead + frame.pose[:3, 3])
            number += 1
    if moves.count > 1:
        print_note(moves.sentence)


class Corrections:
    """By how much poses of a sequence were corrected."""

    def __init__(self) -> None:
        self.count, self._farthest, self._widest = 0, 0.0, 0.0

    def noted(
        self, renderer: Renderer, frames: Iterable[Frame], surface: dict[str, Any]
    ) -> Generator[Frame, None, None]:
        """Yield the frames with corrected poses."""
        given: deque[NDArray[np.float64]] = deque()

        def read() -> Generator[Frame, None, None]:
            for frame in frames:
                given.append(frame.pose)
                yield frame

        for frame in renderer.align_sequence(read(), **surface):
            between = np.linalg.inv(given.popleft()) @ frame.pose
            angle = float(np.degrees(np.arccos(np.clip((np.trace(between[:3, :3]) - 1) / 2, -1, 1))))
            self.count += 1
            self._farthest = max(self._farthest, float(np.linalg.norm(between[:3, 3])))
            self._widest = max(self._widest, angle)
            yield frame

    @property
    def sentence(self) -> str:
        """What was done, in one sentence."""
        how = f"by up to {1e3 * self._farthest:.3g} mm and {self._widest:.2g} degrees"
        return f"{counted(self.count - 1, 'pose')} corrected {how}; that of the first frame stays"


def write_series(
    renderer: Renderer, jobs: Generator[Job, None, None], path: Path, fps: float, progress: Progress | None = None,
    all: int = 0,
) -> tuple[int, tuple[int, int]]:  # fmt: skip
    """Draws and writes the pictures of all jobs, in the exposure of the first. Returns how many, and (width, height) of
    the first.

    path      a film, or a name in which each job's number replaces %04d
    progress  called with two ints after each picture: its job's number and one, and `all`. If it returns False, the
              work ends with `Cancelled`: there is no film, and numbered files are there up to that picture.
    all       how many jobs there are
    """
    count, found = Count(progress, all), list[tuple[float, float]]()

    def draw(request: RenderRequest) -> NDArray[np.uint8]:
        if found:
            request = replace(request, finish=replace(request.finish, exposure=found[0][0], fill=found[0][1]))
        image = renderer.render(request)
        found[:] = [(renderer.exposure, renderer.fill)]
        return image

    if is_numbered(path):
        written, first = write_numbered(jobs, draw, save_image, path, count)
    else:
        with Film(path, fps) as film:
            written, first = _write_all(jobs, draw, lambda _, image: film.add(image), 1, path, count)
    return written, (first.shape[1], first.shape[0])


def write_numbered(
    jobs: Generator[Job, None, None], draw: Callable[[RenderRequest], Made], save: Callable[[Path, Made], None],
    path: Path, count: Count,
) -> tuple[int, Made]:  # fmt: skip
    """Draws all jobs and saves each in a file: each job's number replaces %04d. Returns how many, and the first."""
    return _write_all(jobs, draw, lambda number, made: save(numbered(path, number), made), THREADS, path, count)


def _write_all(
    jobs: Generator[Job, None, None], draw: Callable[[RenderRequest], Made], write: Callable[[int, Made], None],
    workers: int, path: Path, count: Count,
) -> tuple[int, Made]:  # fmt: skip
    """Draws in this thread, and gives what is drawn to other threads for encoding: to one for a film."""
    written, first = 0, None
    waiting: deque[Future[None]] = deque()
    with closing(jobs), ThreadPoolExecutor(workers) as pool:
        for number, request in jobs:
            made = draw(request)
            first = made if first is None else first
            waiting.append(pool.submit(write, number, made))
            while waiting and (len(waiting) > workers + 1 or waiting[0].done()):
                waiting.popleft().result()
            written += 1
            count.step(number + 1 - count.done)
        for job in waiting:
            job.result()
    if first is None:
        raise ValueError(f"nothing to write to {path}: no frame could be read")
    return written, first


WIDEST = 640  # pixels of one of the four pictures
_GAP = 4
CAPTION = 13  # pixels: height of the letters of a caption


def contact_sheet(renderer: Renderer, frame: Frame) -> NDArray[np.uint8]:
    """(h, w, 4) uint8: colour and depth above, normals and the lit frame below; depth as the window shows it."""
    c = frame.camera
    width = min(c.width, WIDEST)
    camera = c.resized(width, max(1, round(c.height * width / c.width)))
    plain = renderer.render(frame, camera=camera, shading="none")
    depth = renderer.render(frame, camera=camera, show="depth")
    scale = renderer.color_scale
    lit = renderer.render(frame, camera=camera, exposure="sensor")
    step_v, step_u = ((np.arange(n) + 0.5) * size / n for n, size in ((camera.height, c.height), (width, c.width)))
    normals = normals_to_rgb(renderer.estimate_normals(frame))[np.ix_(step_v.astype(int), step_u.astype(int))]
    of_depth = f"depth, {scale.low:.3g} m blue to {scale.high:.3g} m red" if scale else "depth"
    captions = "unlit" if frame.color is None else "colour", of_depth, "normals", "lit"
    sheet = np.zeros((2 * camera.height + _GAP, 2 * width + _GAP, 4), np.uint8)
    for k, (picture, caption) in enumerate(zip((plain, depth, normals, lit), captions, strict=True)):
        top, left = k // 2 * (camera.height + _GAP), k % 2 * (width + _GAP)
        sheet[top : top + camera.height, left : left + width] = _captioned(picture, caption)
    return sheet


def _captioned(picture: NDArray[np.uint8], caption: str) -> NDArray[np.uint8]:
    """A picture with a line of text in its lower left corner."""
    from PIL import Image, ImageDraw, ImageFont

    image, font = Image.fromarray(np.asarray(picture)), ImageFont.load_default(CAPTION)
    box = 0, image.height - 1.5 * CAPTION, font.getlength(caption) + CAPTION, image.height
    draw = ImageDraw.Draw(image)
    draw.rectangle(box, (16, 17, 20, 255))
    draw.text((CAPTION / 2, image.height - 0.75 * CAPTION), caption, (238, 238, 238, 255), font, anchor="lm")
    return np.asarray(image)
