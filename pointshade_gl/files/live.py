"""Live streams: of an Intel RealSense camera, and several at once, each at its own rate, combined into sets."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from ..checks.arguments import check_type, is_a
from ..notes.errors import check_process
from ..notes.notes import print_note
from ..notes.words import shown
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.objects import MOST_FRAMES
from .frame_sources import prefetched

__all__ = ["live_set"]  # of `ps.live`; RealSenseSource is a name of `ps` itself


class Item(NamedTuple):
    """What a source gives: a frame, a sentence about one that is missing, or nothing more, and the error of its end."""

    number: int
    frame: Frame | None = None
    sentence: str = ""
    is_last: bool = False
    error: BaseException | None = None


def live_set(
    sources: Sequence[Frame | Iterable[Frame]], skipped: Callable[[str], None] = print_note
) -> Generator[tuple[Frame, ...], None, None]:
    """Yield the newest frame of each source, in the order of the sources, whenever at least one of them has a new one.

    Parameters
    ----------
    sources : sequence of Frame or iterable of Frame
        1 to 200: sequences or any other iterables of frames; a Frame stays as it is.
    skipped : callable
        Called in the consumer's thread with one sentence for each frame of a sequence that cannot be read, and for each
        source that a ValueError or an OSError ends. Any other exception is raised. The default prints the sentence.

    Yields
    ------
    tuple of Frame
        A source that has given no frame yet is left out; one that has ended keeps its last frame.

    Raises
    ------
    ContextError
        In a process that was forked since the first frames.
    TypeError
        For sources of another kind, with the first frames.
    ValueError
        For none or too many, with the first frames.

    Notes
    -----
    A Renderer uploads, compares and votes again only what is new. Each source is read by its own thread and waits until
    its last frame was taken: no frame is lost here, and a slow source holds up no other. The iteration ends when all
    sources have ended, and so do its threads, even if the consumer leaves it early (see `contextlib.closing`).

    Examples
    --------
    >>> for frames in ps.live_set([camera, other, ps.open_source("recording")]):
    ...     picture = renderer.render(frames)
    """
    checked = _check_sources(sources)
    items: queue.Queue[Item] = queue.Queue()
    taken = [threading.Semaphore() for _ in checked]  # of each source: its last frame was
    stop = threading.Event()
    threads = [
        threading.Thread(target=_feed, args=(k, source, items, taken[k], stop), daemon=True, name="pointshade-live")
        for k, source in enumerate(checked)
    ]
    for thread in threads:
        thread.start()
    newest: dict[int, Frame] = {}
    process = os.getpid()
    living = len(checked)
    try:
        while living:
            check_process(process, "iteration")
            new = [items.get()]
            while not items.empty():  # at most one frame of each
                new.append(items.get())
            living -= sum(item.is_last for item in new)
            frames = {item.number: item.frame for item in new if item.frame is not None}
            for item in new:
                if item.sentence:
                    skipped(f"source {item.number}: {item.sentence}")
                if item.error is not None:
                    raise item.error
            newest |= frames
            if frames:
                yield tuple(newest[k] for k in sorted(newest))
            for k in frames:
                taken[k].release()
    finally:
        stop.set()
        for semaphore in taken:
            semaphore.release()
        for thread in threads:
            thread.join(timeout=2)  # a camera may never give another frame; daemon threads end with the process


def _check_sources(sources: Any) -> list[Iterable[Frame]]:
    expected = "sources must be a sequence, such as a list, of Frames and iterables of frames"
    if not is_a(sources, Sequence) or is_a(sources, str, bytes):
        raise TypeError(f"{expected}, got {shown(sources)}")
    if not 1 <= len(sources) <= MOST_FRAMES:
        raise ValueError(f"a live set has 1 to {MOST_FRAMES} sources, got {len(sources)}")
    for k, source in enumerate(sources):
        if is_a(source, str, bytes) or not is_a(source, Frame, Iterable):
            raise TypeError(f"{expected}, source {k} is {shown(source)}")
    return [[source] if isinstance(source, Frame) else source for source in sources]


def _feed(
    k: int, source: Iterable[Frame], items: queue.Queue[Item], taken: threading.Semaphore, stop: threading.Event
) -> None:
    """Put the frames of a source into the queue, each when the one before was taken; runs in a thread."""
    try:
        for frame in _decoded(k, source, items):
            taken.acquire()
            if stop.is_set():
                return
            items.put(Item(k, check_type(frame, Frame, f"what source {k} gives")))
        items.put(Item(k, is_last=True))
    except (ValueError, OSError) as error:
        items.put(Item(k, sentence=f"it ends: {error}", is_last=True))
    except BaseException as error:
        items.put(Item(k, is_last=True, error=error))


def _decoded(k: int, source: Iterable[Frame], items: queue.Queue[Item]) -> Generator[Frame, None, None]:
    """Return the source's frames; those of a sequence are decoded ahead."""
    if not isinstance(source, Sequence):
        yield from source
        return
    with closing(prefetched(source, lambda text: items.put(Item(k, sentence=text)))) as frames:
        yield from frames


class RealSenseSource(Iterator[Frame]):
    """The frames of an Intel RealSense camera from now on, without end; depth is aligned to the colour picture.

    Close it after use.

    Parameters
    ----------
    size : (2,) int
        Width and height of depth and colour, pixels; the camera must offer them at this fps.
    fps : int
        Pictures per second.
    sdk : module, optional
        The module pyrealsense2, or an object that behaves like it; None imports it.

    Attributes
    ----------
    camera : Camera
        Camera of all frames.

    Raises
    ------
    ValueError
        Without the extra `realsense`.
    OSError
        If no camera answers, and for a frame that does not come in time; the next one may come again.
    """

    def __init__(self, size: tuple[int, int] = (640, 480), fps: int = 30, sdk: Any = None):
        try:
            rs: Any = sdk or import_module("pyrealsense2")
        except ImportError:
            raise ValueError("a RealSense camera needs pyrealsense2: pip install '.[realsense]' in the clone") from None
        config, self._pipeline = rs.config(), rs.pipeline()
        config.enable_stream(rs.stream.depth, *size, rs.format.z16, fps)
        config.enable_stream(rs.stream.color, *size, rs.format.rgb8, fps)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise OSError(f"no RealSense camera gives {size[0]}x{size[1]} at {fps} fps: {error}") from None
        self._stream = object()  # what its frames have in common
        self._align = rs.align(rs.stream.color)
        self._metres = np.float32(profile.get_device().first_depth_sensor().get_depth_scale())
        seen = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
        self.camera = Camera(seen.fx, seen.fy, seen.ppx, seen.ppy, seen.width, seen.height)

    def __next__(self) -> Frame:
        try:
            pictures = self._align.process(self._pipeline.wait_for_frames())
        except RuntimeError as error:
            raise OSError(f"the RealSense camera gave no frame: {error}") from None
        depth = np.asanyarray(pictures.get_depth_frame().get_data()) * self._metres
        color = np.asanyarray(pictures.get_color_frame().get_data())
        return Frame(color, depth, self.camera, source=self._stream)

    def close(self) -> None:
        """Stop the camera."""
        self._pipeline.stop()
