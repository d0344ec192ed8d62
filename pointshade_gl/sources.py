"""Streams of frames. A stream is whatever `for frame in source:` accepts: a sequence on disk, a generator, a camera."""

from __future__ import annotations

import re
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import islice, repeat
from pathlib import Path
from typing import Any, overload

from .folders import Pair, builtin_folder, check_folder, find_pairs
from .frame import Frame
from .images import FilePath
from .intrinsics import Note
from .readers import load_frame, print_note
from .trajectories import Poses, find_poses


class FolderSequence(Sequence[Frame]):
    """The frames of a folder, each read when it is asked for; slices are sequences too.

    [k] raises ValueError or OSError, in one sentence, for a frame that cannot be read.
    """

    def __init__(self, folder: Path, pairs: Sequence[Pair], poses: Poses, options: dict[str, Any]):
        self.folder = folder
        self._pairs, self._poses, self._options = pairs, poses, options

    def __len__(self) -> int:
        return len(self._pairs)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FolderSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FolderSequence:
        if isinstance(index, slice):
            return FolderSequence(self.folder, self._pairs[index], self._poses[index], self._options)
        depth, color, _ = self._pairs[index]
        pose = self._poses[index]
        try:
            return load_frame(self.folder, **{"depth": depth, "color": color, "pose": pose} | self._options)
        except (ValueError, TypeError) as error:
            raise ValueError(f"frame {index}: {_naming(depth, error)}") from None
        except OSError as error:
            raise OSError(f"frame {index}: {_naming(depth, error)}") from None


def open_source(path: FilePath | None, **load_options: Any) -> Frame | FolderSequence:
    """The frame or the sequence of frames of a folder, or of a built-in name.

    A sequence lies in folders depth/ and color/, in the lists of the TUM benchmark or in numbered files (see
    `find_pairs`). It has one camera for all; the poses are those of the folder (see `find_poses`).

    load_options  as for `load_frame`; with depth= or color= it is one frame. Of each kind of note the first is told.

    Raises ValueError, TypeError or OSError as `load_frame`, for a sequence when not even its first, middle or last
    frame can be read.
    """
    options = {name: value for name, value in load_options.items() if value is not None}
    if path is None or options.keys() & {"depth", "color"}:
        return load_frame(path, **options)
    folder = check_folder(builtin_folder(path))
    note = options["notes"] = _once(options.get("notes", print_note))
    pairs = find_pairs(folder, note)
    if not pairs:
        return load_frame(folder, **options)
    sequence = FolderSequence(folder, pairs, find_poses(folder, pairs, note), options)
    first = _first_readable(sequence)
    return first if len(pairs) == 1 else sequence


def prefetched(source: Iterable[Frame], skipped: Callable[[str], None], ahead: int = 2) -> Generator[Frame, None, None]:
    """The frames of a source in their order, decoded by threads while the consumer works on the ones before.

    source   a Sequence is read by `ahead` threads, any other iterable by one
    skipped  called in the consumer's thread with one sentence for each frame that raises ValueError or OSError;
             any other exception goes through
    ahead    how many frames may wait

    The threads end with the iteration, also when the consumer leaves it early.
    """
    if isinstance(source, Sequence):
        jobs: Iterator[Callable[[], Frame | None]] = (partial(source.__getitem__, k) for k in range(len(source)))
        workers = max(1, ahead)
    else:
        jobs, workers = repeat(partial(next, iter(source), None)), 1
    waiting: deque[Future[Frame | None]] = deque()
    pool = ThreadPoolExecutor(workers, thread_name_prefix="pointshade-decode")
    try:
        while True:
            waiting.extend(pool.submit(job) for job in islice(jobs, ahead + 1 - len(waiting)))
            if not waiting:
                return
            try:
                frame = waiting.popleft().result()
            except (ValueError, OSError) as error:
                skipped(str(error))
                continue
            if frame is None:
                return
            yield frame
    finally:
        pool.shutdown(cancel_futures=True)


def _first_readable(sequence: FolderSequence) -> Frame:
    """One frame as a proof that camera and options are right; raises the first one's error if there is none."""
    for index in (0, len(sequence) // 2, len(sequence) - 1):
        try:
            return sequence[index]
        except (ValueError, OSError):
            continue
    return sequence[0]


def _naming(depth: Path, error: Exception) -> str:
    """The error's sentence, with the file if it does not name one."""
    return str(error) if depth.name in str(error) else f"{depth}: {error}"


def _once(note: Note) -> Note:
    """Tells each kind of note once: those that differ only in numbers are of one kind."""
    told: set[str] = set()
    lock = threading.Lock()

    def tell(text: str) -> None:
        kind = re.sub(r"\d+", "#", text)
        with lock:
            if kind not in told:
                told.add(kind)
                note(text)

    return tell
