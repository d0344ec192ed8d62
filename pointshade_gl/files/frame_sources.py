"""Opens sources of frames: a sequence on disk, a generator, a camera; anything that `for frame in source:` accepts."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from itertools import islice, repeat
from typing import TYPE_CHECKING, Any, TypeGuard, cast

import numpy as np

from ..checks.arguments import is_a
from ..notes.errors import check_process
from ..notes.notes import Note, once, print_note
from ..notes.words import option, shown
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.objects import MOST_FRAMES
from ..scene.option_fields import takes
from .access.content import FilePath
from .access.known_names import builtin_folder, builtin_name
from .clouds import load_cloud
from .clouds.load_cloud import OF_MESHES, AnyOptions
from .frames.frame_files import load_frame, open_given
from .frames.frame_parts import LoadOptions, ReadOptions
from .frames.sequences import FrameSequence, first_readable, open_frames
from .gltf import load_scene
from .input_kinds import Kind, names_scene
from .networks.model_options import is_model

if TYPE_CHECKING:
    from typing_extensions import Unpack

_unsaid: Note = lambda _: None  # noqa: E731  # how built-in files were understood is no news
_END = object()  # of an iterator, which may give anything else, None included


def is_scene(source: FilePath | None) -> TypeGuard[FilePath]:
    """Return whether it is the name of a built-in scene or a glTF file's.

    Parameters
    ----------
    source : path or None
        A name; the file is not read.
    """
    return names_scene(source)


@takes(LoadOptions, like=load_frame)
def open_source(path: FilePath | None, **load_options: Unpack[LoadOptions]) -> Frame | FrameSequence:
    """Open the frame, or the sequence of frames, of a folder, a depth file or a built-in name.

    Parameters
    ----------
    path : path or None
        As `folder` of `load_frame`.

    Returns
    -------
    Frame or FrameSequence
        A sequence reads each frame when it is asked for; its slices are sequences, too. With depth or color the result
        is a single frame, or the six of a panorama.

    Raises
    ------
    ValueError, TypeError, OSError
        As `load_frame`; for a sequence, if none of its first, middle and last frame can be read.

    Notes
    -----
    Pictures, cameras and poses are found by the patterns in files/access/known_names.py. Where several views
    overlap, their depths show how poses are to be understood, see files/cameras/pose_files.py. Of each kind of note
    only the first is printed.
    """
    options: dict[str, Any] = {name: value for name, value in load_options.items() if value is not None}
    if is_model(options.get("depth")):
        options["depth_model"] = options.pop("depth")
    depth, color = options.pop("depth", None), options.pop("color", None)
    is_given = depth is not None or color is not None
    if (path is None or is_given) and "depth_model" in options:
        return load_frame(path, depth=depth, color=color, **options)
    note = once(options.pop("notes", print_note if builtin_name(path) is None else _unsaid))
    outside = options.pop("allow_outside", False)
    read = ReadOptions(**options)
    if path is None or is_given:
        sequence = open_given(path, depth, color, read, outside, note)
    else:
        sequence = open_frames(builtin_folder(path), outside, read, note)
    _, first = first_readable(sequence)
    return first.frame if len(sequence) == 1 else sequence


@takes(AnyOptions)
def load_any(source: FilePath | None, **load_options: Unpack[AnyOptions]) -> Frame | Scene | PointCloud:
    """Load what a folder, a file or a built-in name holds: a frame, the first of a sequence, a scene or a point cloud.

    The options are those of `load_frame` and `load_cloud`; None counts as not given.

    Parameters
    ----------
    source : path
        What is loaded.

    Raises
    ------
    ValueError, TypeError, OSError
        As `load_frame`, `load_cloud` and `load_scene`.
    """
    options: dict[str, Any] = {name: value for name, value in load_options.items() if value is not None}
    kind, file = Kind.of(source), cast("FilePath", source)
    if load_cloud.is_mesh(source):
        load_cloud.check_fitting(options, OF_MESHES, f"{source} is a mesh")
        return load_cloud.load_mesh(source, **options)
    if kind is Kind.SCENE:
        load_cloud.check_fitting(options, (), f"{source} is a scene, which names the files of its frames")
        return load_scene(file, **options)
    if kind is Kind.CLOUD:
        load_cloud.check_cloud_options(options, file)
        options.pop("allow_outside", None)
        return load_cloud.load_cloud(file, **options)
    load_cloud.check_frame_options(options, source)
    return load_frame(source, **options)


def views_of(
    source: Frame | FrameSequence, count: int | Sequence[int] | None, note: Note = print_note
) -> dict[int, Frame]:
    """Read the frames of a sequence that are drawn as one object: those that `sources.choose_views` chooses.

    Parameters
    ----------
    source : FrameSequence
        What `open_source` opens; a single frame is an error.
    count : int or sequence of int, optional
        How many frames, or their numbers; None: all.
    note : callable
        Called with one sentence for what is left out because it cannot be read.

    Returns
    -------
    dict of int to Frame
        The frames by their numbers.

    Raises
    ------
    ValueError
        Where fewer than two are left: then there is nothing to merge.
    """
    if isinstance(source, Frame):
        raise ValueError(f"{option('views')} merges the frames of a sequence, and this is a single frame: leave it out")
    chosen = choose_views(source, count, note)
    found: dict[int, Frame] = {}
    for k in chosen:
        try:
            found[k] = source[k]
        except (ValueError, OSError) as error:
            note(f"{error}: left out")
    if len(found) < 2:
        raise ValueError(f"{source.folder}: fewer than two of the {len(chosen)} chosen frames can be read")
    return found


def choose_views(
    source: Sequence[Frame], count: int | Sequence[int] | None, note: Note = print_note, among: int | None = None
) -> list[int]:
    """Choose which frames of a sequence are drawn as one object: evenly, 200 at most.

    Parameters
    ----------
    source : sequence of Frame
        Of files, frames without a pose are left out.
    count : int or sequence of int, optional
        How many frames, or their numbers; None: all.
    note : callable
        Called with one sentence for what is left out.
    among : int, optional
        A frame that is chosen in any case, if it has a pose.

    Returns
    -------
    list of int
        The numbers of the frames.

    Raises
    ------
    ValueError
        For fewer than two frames, and for a number that no frame with a pose has.
    """
    posed, name = list(range(len(source))), "the source"
    if isinstance(source, FrameSequence):
        posed, name = [k for k, one in enumerate(source.parts) if one.pose is not None], str(source.folder)
    if 0 < len(posed) < len(source):
        note(f"{name}: {len(source) - len(posed)} of {len(source)} frames have no pose: they are left out")
    if len(posed) < 2:
        raise ValueError(f"{name} has poses for {len(posed)} frames: {option('views')} needs two at least")
    if count is not None and not isinstance(count, int):
        if strange := [k for k in count if k not in posed]:
            raise ValueError(f"{name} has no frame {strange[0]} with a pose: it has {len(source)}, counted from 0")
        return list(dict.fromkeys(count))
    wanted = len(posed) if count is None else min(count, len(posed))
    if wanted > MOST_FRAMES:
        note(f"{name}: only {MOST_FRAMES} of {wanted} frames are merged, evenly chosen")
    most = min(wanted, MOST_FRAMES)
    chosen = [posed[k * (len(posed) - 1) // (most - 1)] for k in range(most)]
    if among in posed:
        chosen[int(np.argmin(np.abs(np.array(chosen) - among)))] = among
    return chosen


def prefetched(source: Iterable[Frame], skipped: Callable[[str], None], ahead: int = 2) -> Generator[Frame, None, None]:
    """Yield the frames of a source in order, decoded by threads while the consumer works on earlier ones.

    Parameters
    ----------
    source : iterable of Frame
        A sequence is read by `ahead` threads, any other iterable by one.
    skipped : callable
        Called in the consumer's thread with one sentence for each frame that raises ValueError or OSError. Any other
        exception is raised.
    ahead : int
        How many frames may wait.

    Raises
    ------
    ContextError
        In a process that was forked since the first frame.
    TypeError
        For a source that is not iterable, with the first frame.

    Notes
    -----
    The threads end with the iteration, even if the consumer leaves it early.
    """
    if not is_a(source, Iterable):
        raise TypeError(f"source must be an iterable of frames, got {shown(source)}")
    if isinstance(source, Sequence):
        jobs: Iterator[Callable[[], Any]] = (partial(source.__getitem__, k) for k in range(len(source)))
        workers = max(1, ahead)
    else:
        frames = iter(source)
        jobs, workers = repeat(lambda: next(frames, _END)), 1
    waiting: deque[Future[Any]] = deque()
    process = os.getpid()
    pool = ThreadPoolExecutor(workers, thread_name_prefix="pointshade-decode")
    try:
        while True:
            check_process(process, "iteration")
            waiting.extend(pool.submit(copy_context().run, job) for job in islice(jobs, ahead + 1 - len(waiting)))
            if not waiting:
                return
            try:
                frame = waiting.popleft().result()
            except (ValueError, OSError) as error:
                skipped(str(error))
                continue
            if frame is _END:
                return
            yield frame
    finally:
        pool.shutdown(cancel_futures=True)


def check_posed(sources: Iterable[Any]) -> None:
    """Raise ValueError for a sequence without poses among several sources.

    Parameters
    ----------
    sources : iterable
        What `open_source` opens, or other iterables of frames, which pass.

    Raises
    ------
    ValueError
        It names the folder and the option `poses`.
    """
    for source in sources:
        if isinstance(source, FrameSequence) and not source.is_placed:
            way_out = f"several INPUTs are merged by their poses, pass those as {option('poses', 'FILE')}"
            raise ValueError(f"{source.folder} has no poses: {way_out}")
