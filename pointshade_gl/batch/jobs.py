"""One output of a batch as a plain value, and the function that makes it: the same in any process, on any machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

from ..files.access.atomic_write import naming_written, sha256_of
from ..files.access.known_names import BATCH_FILMS as FILMS
from ..files.access.known_names import BATCH_NORMALS as NORMALS
from ..files.access.known_names import BATCH_PAGE as PAGE
from ..files.access.known_names import builtin_folder
from ..files.frame_sources import load_any
from ..files.frames.frame_parts import ReadOptions
from ..files.frames.sequences import FrameSequence, first_readable, open_frames
from ..files.input_kinds import Kind
from ..files.pictures.picture_files import AxesName, save_image
from ..files.writing.maps_and_points import save_normals
from ..notes.notes import once, print_note, taken
from ..notes.words import option
from ..renderer.functions import renderer_here
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import jobs_of, write_series
from ..scene.appearance import Appearance
from ..scene.frame import Frame
from ..scene.graph import Scene, given_by, is_of_clouds, scene_of, shaded, styled
from ..scene.viewpoint import View

if TYPE_CHECKING:
    from ..page.parts import QualityName

OPENED = 2  # sequences that a process keeps open


@dataclass(frozen=True)
class Job:
    """One output: what is read, how it is drawn, where it is written. Small, and may be sent to another process."""

    # a folder, a file or a built-in name, as for `load_frame` and `load_scene`; absolute, as a worker may stand in
    # another folder
    source: str
    path: Path  # the file to write; folders are made
    kind: str = "png"  # one of BATCH (files/access/known_names.py): what the name ends with
    # of the frame in its sequence; None: the whole sequence for a film, else the first frame, or the scene
    number: int | None = None
    view: View = field(default_factory=View)  # from where, under which lights and how it is drawn
    reading: tuple[tuple[str, Any], ...] = ()  # options of `load_frame` by name, as pairs
    turntable: str | None = None  # as frames and fps of a film, see `pointshade render`
    frames: int | None = None
    fps: float = 25.0
    axes: AxesName | None = None  # as bits of normals, see `save_normals`
    bits: Literal[8, 16] = 8
    quality: QualityName = "exact"  # as title of a page, see `save_page`
    title: str | None = None

    @cached_property
    def reads(self) -> Kind:
        return Kind.of(self.source)

    @property
    def reads_ahead(self) -> bool:
        """Whether it is read while others are drawn: a still of a frame is soon done, and takes little memory."""
        return self.kind not in (PAGE, *FILMS) and self.reads is Kind.FRAMES


class LeftOut(ValueError):
    """There is nothing to draw, as the sequence leaves this frame out."""


class Done(NamedTuple):
    """What became of a job."""

    path: Path
    seconds: float  # reading, drawing and writing took together
    size: int  # of the file in bytes
    sha256: str  # of its bytes, hexadecimal
    renderer: str  # the driver that drew it
    notes: tuple[str, ...]  # sentences about what was guessed


_Result = TypeVar("_Result")
Parts = Generator[None, None, _Result]  # of work, which returns something at its end
Drawn = tuple[str, Callable[[], None] | None]  # the name of the driver; what writes the file, unless it is written


def run(job: Job, device: int = 0) -> Parts[Done]:
    """Makes the output of a job, whole or not at all, in three parts: reading, drawing, writing.

    Only the second needs OpenGL: of a renderer that its thread keeps. The output depends on the job and on nothing that
    was drawn before: a picture is the one that `render` makes of its frame alone, a film the one that `pointshade
    render` makes of the sequence.

    device  which GPU, counted by EGL (Linux)

    Raises ValueError, TypeError or OSError, in one sentence, for files that cannot be read or written (LeftOut for a
    frame that the sequence leaves out), and ContextError without OpenGL 3.3.
    """
    seconds = -time.perf_counter()  # a clock that stops between the parts
    with naming_written(job.path):
        job.path.parent.mkdir(parents=True, exist_ok=True)
    with taken() as notes:
        source = read(job) if job.reads_ahead else None
        seconds += time.perf_counter()
        yield
        seconds -= time.perf_counter()
        draw = _draw_film if job.kind in FILMS else _draw_normals if job.kind in NORMALS else _draw_picture
        renderer, write = draw(job, device, source)
        seconds += time.perf_counter()
        yield
        seconds -= time.perf_counter()
        if write is not None:
            write()
    size, digest = sha256_of(job.path)
    return Done(job.path, seconds + time.perf_counter(), size, digest, renderer, tuple(notes))


def read(job: Job) -> Frame | Scene:
    """The frame or the scene that a job draws; of a point cloud its scene. A frame of a sequence is judged alone: it
    belongs to no stream."""
    source, look = _load(job), job.view.look
    if job.reads is Kind.SCENE:
        return shaded(source, None if look.shading == Appearance().shading else look.shading)
    if job.reads is Kind.CLOUD:
        return scene_of(styled(source, {name: one for name, one in given_by(look).items() if is_of_clouds(name)}))
    return source


def _load(job: Job) -> Any:
    """A frame, or by the kind of the source a scene or a point cloud."""
    if job.reads is not Kind.FRAMES:
        return load_any(job.source, **dict(job.reading))
    sequence, places, first = _opened(job.source, job.reading)
    if job.number is None:
        return replace(first_readable(sequence)[1].frame, source=None)
    if job.number not in places:
        raise LeftOut(f"{job.source}: frame {job.number} is left out: its pose was lost when it was recorded")
    index = places[job.number]
    return replace(first.pop(index) if index in first else sequence[index], source=None)


@lru_cache(OPENED)
def _opened(
    source: str, reading: tuple[tuple[str, Any], ...]
) -> tuple[FrameSequence, dict[int, int], dict[int, Frame]]:
    """A sequence that is kept open, the places of its frames by their numbers, and the first frame by its place. All
    are read as that one is, which need not be read again."""
    sequence = _open(source, reading)
    index, read = first_readable(sequence)
    return sequence, {one.number: index for index, one in enumerate(sequence.parts)}, {index: read.frame}


def _open(source: str, reading: tuple[tuple[str, Any], ...]) -> FrameSequence:
    options = dict(reading)
    outside = options.pop("allow_outside", False)
    return open_frames(builtin_folder(source), outside, ReadOptions(**options), once(print_note))


def _draw_picture(job: Job, device: int, source: Frame | Scene | None) -> Drawn:
    renderer = renderer_here(device)
    source = read(job) if source is None else source
    if job.kind == PAGE:
        _write_page(job, renderer, source)
        return renderer.context.renderer, None
    renderer.steps.waits = True  # files are read and written meanwhile
    image = renderer.render(RenderRequest.seen(source, job.view))
    if not image.any():
        print_note(f"{job.path.name}: nothing is in view, the picture is empty")
    return renderer.context.renderer, partial(save_image, job.path, image)


def _write_page(job: Job, renderer: Renderer, source: Frame | Scene) -> None:
    from ..page.page_file import largest_of, write_page  # only here: it is large

    request, name = RenderRequest.seen(source, job.view), Path(job.source).stem
    of_frame = f"{name} {job.path.stem}" if job.path.parent.name == name else name
    title = of_frame if job.title is None else job.title
    write_page(renderer, job.path, request, quality=job.quality, largest=largest_of(request), title=title)


def _draw_normals(job: Job, device: int, source: Any) -> Drawn:
    renderer = renderer_here(device)
    source = _load(job) if source is None else source
    if job.reads is Kind.SCENE:
        raise ValueError(f"{job.source} is a scene: normals are estimated of frames")
    if job.reads is Kind.FRAMES:
        normals = renderer.estimate_normals(RenderRequest.seen(source, job.view))
        return renderer.context.renderer, partial(save_normals, job.path, normals, job.axes, job.bits)
    if not job.kind.endswith(".npy"):
        npy = option("to", NORMALS[-1])
        raise ValueError(f"{job.source} is a point cloud, whose normals no picture holds: use {npy}")
    return renderer.context.renderer, partial(save_image, job.path, renderer.estimate_normals(source))


def _draw_film(job: Job, device: int, source: Any) -> Drawn:
    """By a renderer of its own: streams are filtered over time, and one must not begin with the end of another."""
    is_turned = job.turntable is not None and not job.view.look.temporal
    if is_turned or job.reads is not Kind.FRAMES:
        source = read(job)
    else:
        source = _open(job.source, job.reading)
        first = first_readable(source)[1].frame
        source = first if len(source) == 1 else source
    with Renderer(device=device) as renderer:
        pictures, _ = jobs_of(
            source, job.view, job.turntable, job.frames, lambda text: print_note(f"skipped {text}"), renderer
        )
        write_series(renderer, pictures, job.path, job.fps)
        return renderer.context.renderer, None
