"""Many pictures by many processes, in order; and a stage of Ray Data, whose rows get their pictures."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from contextlib import closing
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from ..checks import arguments as checks
from ..checks.arguments import Count, Progress
from ..checks.foreign_arrays import way_to
from ..files.access.known_names import builtin_folder, builtin_name
from ..files.frame_sources import open_source
from ..files.frames.sequences import FrameSequence
from ..files.input_kinds import Kind
from ..notes.errors import Bug, ShaderError, check_function, error_text, is_expected
from ..notes.notes import Note, once, print_note, taken
from ..notes.words import shown
from ..renderer.functions import renderer_here
from ..renderer.requests import FilePath, Picture, RenderRequest, Source, loaded
from ..scene.appearance import Appearance
from ..scene.camera import Camera
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.objects import check_frames
from ..scene.viewpoint import View
from .jobs import Job, Parts, read
from .on_ray import device_here, on_ray
from .processes import on_processes, usable_cores, whole

AHEAD = 4  # pictures for each worker that may wait for their turn


@overload
def map(
    frames: Iterable[Source] | FilePath, look: Appearance | None = None, view: View | None = None, *,
    workers: int | None = None, ray: str | None = None, num_gpus: float = 0.0, device: int = 0,
    return_exceptions: Literal[False] = False, notes: Note | None = None, progress: Progress | None = None,
) -> Iterator[NDArray[np.uint8]]: ...  # fmt: skip
@overload
def map(
    frames: Iterable[Source] | FilePath, look: Appearance | None = None, view: View | None = None, *,
    workers: int | None = None, ray: str | None = None, num_gpus: float = 0.0, device: int = 0,
    return_exceptions: bool, notes: Note | None = None, progress: Progress | None = None,
) -> Iterator[NDArray[np.uint8] | Exception]: ...  # fmt: skip
def map(
    frames: Iterable[Source] | FilePath, look: Appearance | None = None, view: View | None = None, *,
    workers: int | None = None, ray: str | None = None, num_gpus: float = 0.0, device: int = 0,
    return_exceptions: bool = False, notes: Note | None = None, progress: Progress | None = None,
) -> Iterator[Any]:  # fmt: skip
    """Draw many frames with several processes, and give the pictures in order.

    Processes are started, so a script calls it below `if __name__ == "__main__":`.

    Parameters
    ----------
    frames : iterable or path
        Of what `render` takes: frames, sequences of frames that are drawn as one object, scenes, point clouds, paths.
        Or one path, as of a folder with a sequence, which the workers read.
    look : Appearance, optional
        How the frames are drawn; None: as the view says.
    view : View, optional
        From where and under which lights; None: from each frame's own camera.
    workers : int, optional
        How many processes; None: one a processor.
    ray : str, optional
        "local", or the address of a Ray cluster, as "auto" or "host:6379", to draw there. A Ray that the program is
        connected to is used whatever the address.
    num_gpus : float
        GPUs that Ray reserves for each worker, which draws on that GPU; 0.25 lets four share one.
    device : int
        Which GPU, counted by EGL (Linux); with num_gpus Ray chooses.
    return_exceptions : bool
        True gives, in place of a picture that cannot be drawn, the exception.
    notes : callable, optional
        Called with one sentence for each kind of note; None logs them ("pointshade_gl").
    progress : callable, optional
        Called with two ints before each picture is given: how many there are with it, and how many will be; of frames
        without a length, as many as were taken so far. If it returns False, the iteration ends with `Cancelled`, and
        its processes end.

    Returns
    -------
    iterator of (h, w, 4) uint8
        What `render` draws of each frame. Nothing is read or drawn before the first picture is asked for, and no more
        than four pictures for each worker are kept for later.

    Raises
    ------
    TypeError, ValueError
        At once, for arguments that make no sense. What `render` raises for a frame is raised when its picture is due.
    RuntimeError
        For a frame that has killed several workers; then the iteration ends.

    Notes
    -----
    The pictures are those of a single process, to the bit where the same driver draws them. Each frame is judged
    alone, as a picture of its own.

    Examples
    --------
    >>> for k, picture in enumerate(ps.batch.map("my_sequence")):
    ...     ps.save_image(f"lit_{k:04d}.png", picture)
    """
    view = check_view(look, view)
    if workers is not None:
        checks.check_count(workers, "workers", 1)
    checks.check_count(device, "device")
    checks.check_flag(return_exceptions, "return_exceptions")
    if not checks.is_a(ray, str, type(None)):
        raise TypeError(f"ray must be 'local' or an address, got {shown(ray)}")
    if checks.check_number(num_gpus, "num_gpus", 0) and ray is None:
        raise ValueError("num_gpus is of a Ray cluster: pass ray='local' or an address")
    if not checks.is_a(frames, str, PathLike, Iterable):
        raise TypeError(f"frames must be an iterable of frames, or the path of a sequence, got {shown(frames)}")
    note, count = once(print_note if notes is None else check_function(notes, "notes")), Count(progress)
    drawings = (Drawing(source, view) for source in _counted(_sources(frames, note, count), count))
    if ray is None:
        if isinstance(frames, Sized) and not checks.is_a(frames, str):
            workers = max(1, min(workers or usable_cores(), len(frames)))
        results = on_processes(_in_parts, drawings, workers, device, AHEAD)
    else:
        results = on_ray(_drawn, drawings, ray, workers, num_gpus, device, AHEAD)
    return _pictures(results, note, count, return_exceptions)


def check_view(look: Appearance | None, view: View | None) -> View:
    """The view, with this look if there is one. Raises TypeError or ValueError for what no single picture can have."""
    view = checks.check_type(View() if view is None else view, View, "view")
    view = view if look is None else replace(view, look=checks.check_type(look, Appearance, "look"))
    if view.look.temporal:
        raise ValueError("temporal averages a stream from frame to frame, and here each is drawn alone: leave it out")
    return view


def _pictures(
    results: Generator[tuple[int, Any], None, None], note: Note, count: Count, return_exceptions: bool
) -> Generator[Any, None, None]:
    """The pictures in order, as arrays of their own."""
    early: dict[int, Any] = {}  # by number: they come as they are drawn
    due = 0
    with closing(results):
        for number, drawn in results:
            early[number] = drawn
            while due in early:
                yield _picture(early.pop(due), note, count, return_exceptions)
                due += 1


def _picture(drawn: Drawn | Exception, note: Note, count: Count, return_exceptions: bool) -> Any:
    if isinstance(drawn, Exception) and not return_exceptions:
        raise drawn
    count.step()
    if isinstance(drawn, Exception):
        return drawn
    for sentence in drawn.notes:
        note(sentence)
    return np.array(drawn.picture).view(Picture)  # what Ray hands out lies in its store, and is read-only


@dataclass(frozen=True)
class Drawing:
    """A picture to draw: of what `render` takes, of a job's source, or of an error that reading it has raised."""

    source: Any
    view: View


class Drawn(NamedTuple):
    """A picture (h, w, 4), and what there is to note about it."""

    picture: NDArray[np.uint8]
    notes: list[str]


def draw(drawing: Drawing, device: int) -> Parts[Drawn]:
    """The picture of a source, each frame judged alone: it is of no stream. Raises what `render` raises."""
    if isinstance(drawing.source, Exception):
        raise drawing.source
    with taken() as notes:
        source = drawing.source
        if isinstance(source, Job):
            source = read(source)
        elif checks.is_a(source, str, PathLike) and Kind.of(source) is Kind.FRAMES:
            source = loaded(source)  # others, which may be large, are read when it is their turn
        yield
        source = loaded(source)
        if not isinstance(source, Scene | PointCloud):
            source = [replace(frame, source=None) for frame in check_frames(source)]
        renderer = renderer_here(device)
        renderer.steps.waits = True  # the next one is read meanwhile
        picture = np.asarray(renderer.render(RenderRequest.seen(source, drawing.view)))
    yield
    return Drawn(picture, notes)


def _drawn(drawing: Drawing, device: int) -> Drawn | Exception:
    """The same; what it raises is returned, as something that can be sent to another process."""
    return whole(_in_parts(drawing, device))


def _in_parts(drawing: Drawing, device: int) -> Parts[Drawn | Exception]:
    try:
        return (yield from draw(drawing, device))
    except Exception as error:
        is_own = is_expected(error) or isinstance(error, Bug | ShaderError)
        return error if is_own else RuntimeError(error_text(error))


def _counted(sources: Iterable[Any], count: Count) -> Iterator[Any]:
    """The sources; they are as many as were taken, where it is not known how many there are."""
    for number, source in enumerate(sources, 1):
        count.all = max(count.all, number)
        yield source


def _sources(frames: Iterable[Any] | FilePath, note: Note, count: Count) -> Iterator[Any]:
    """What is drawn, one after the other. `count` gets how many they are, if that is known."""
    count.all = len(frames) if isinstance(frames, Sized) and not checks.is_a(frames, str) else 1
    if isinstance(frames, str | PathLike):
        opened = open_source(frames, notes=note) if Kind.of(frames) is Kind.FRAMES else frames
        if isinstance(opened, FrameSequence):
            folder, count.all = str(builtin_folder(frames).absolute()), len(opened)
            yield from (Job(folder, Path(), number=one.number) for one in opened.parts)
        else:
            yield _sendable(opened)
    elif isinstance(frames, FrameSequence):
        yield from (_or_error(frames.__getitem__, k) for k in range(len(frames)))
    else:
        yield from (_sendable(source) for source in frames)


def _sendable(source: Any) -> Any:
    """A source as workers can take it: paths from the root, as they may stand in another folder."""
    if isinstance(source, FrameSequence):
        return _or_error(list, source)
    if checks.is_a(source, str, PathLike) and builtin_name(source) is None:
        return str(Path(source).absolute())
    return source


def _or_error(read: Callable[[Any], Any], what: Any) -> Any:
    """What is read here, as it cannot be read by workers; or why it cannot be read."""
    try:
        return read(what)
    except (ValueError, OSError) as error:
        return error


class Stage:
    """A stage of `map_batches` of a Ray Dataset: each row gets its "picture", (h, w, 4) uint8, as `render` draws it.

    A row has a "path", of a frame's folder or file; or "depth", (h, w) floats in metres, and beside it, if there are,
    "color", (h, w, 3|4) uint8, "intrinsics", (fx, fy, cx, cy), and "pose", (4, 4) camera-to-world.

    It keeps no renderer, so it may be called from any thread: each thread has its own, on the GPU that Ray has handed
    to the process.

    Parameters
    ----------
    look : Appearance, optional
        As for `batch.map`.
    view : View, optional
        As for `batch.map`.
    camera : Camera, optional
        Of rows without intrinsics.

    Raises
    ------
    ValueError
        Where it is called with a row that cannot be drawn.
    """

    def __init__(self, look: Appearance | None = None, view: View | None = None, camera: Camera | None = None):
        self._view = check_view(look, view)
        self._camera = None if camera is None else checks.check_type(camera, Camera, "camera")

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        device = device_here()
        rows = [dict(zip(batch, values, strict=True)) for values in zip(*batch.values(), strict=True)]
        return {**batch, "picture": _column([self._picture(k, row, device) for k, row in enumerate(rows)])}

    def _picture(self, number: int, row: dict[str, Any], device: int) -> NDArray[np.uint8]:
        try:
            drawn = whole(draw(Drawing(self._source(row), self._view), device))
        except (ValueError, TypeError, OSError) as error:
            raise ValueError(f"row {number} of a batch: {error}") from error
        for sentence in drawn.notes:
            print_note(sentence)
        return drawn.picture

    def _source(self, row: dict[str, Any]) -> Frame | str:
        if "path" in row:
            return str(row["path"])
        if "depth" not in row:
            raise ValueError(f"it has {', '.join(row)}: expected path or depth")
        depth = checks.as_given(row["depth"], "depth must have shape (h, w)")
        if depth.ndim != 2:
            raise ValueError(f"depth must have shape (h, w), got {depth.shape}{way_to(depth.shape, 'depth', depth)}")
        camera = self._camera
        if "intrinsics" in row:
            complaint = "intrinsics must be four numbers (fx, fy, cx, cy)"
            fx, fy, cx, cy = checks.check_numbers(row["intrinsics"], 4, complaint)
            camera = Camera(fx, fy, cx, cy, depth.shape[1], depth.shape[0])
        if camera is None:
            raise ValueError("it has no intrinsics: add a column (fx, fy, cx, cy), or pass camera to the stage")
        return Frame(row.get("color"), depth, camera, row.get("pose"))


def _column(pictures: list[NDArray[np.uint8]]) -> NDArray[Any]:
    """One array; of pictures of several sizes, an array of arrays."""
    if len({picture.shape for picture in pictures}) == 1:
        return np.stack(pictures)
    column = np.empty(len(pictures), object)
    column[:] = pictures
    return column
