"""Plays streams of frames, one or several at once, each at its own rate; and when a window is drawn."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from typing import Any

from ..checks.arguments import check_fps
from ..files.frames.sequences import FrameSequence
from ..notes.words import option, shown
from ..scene.frame import Frame
from .views import Views

SLOWEST, USUAL, FASTEST = 0.5, 30.0, 240.0  # frames per second that keys choose; beyond, they play as fast as they come
PATIENCE = 0.1  # seconds after which a waiting thread checks again whether it should stop


class Playback:
    """Plays a source of frames. `advance` gives the frame to show, and never waits.

    source  a Sequence, which repeats and can be stepped through, or any other iterable (a camera)
    fps     frames per second; None: as fast as they come
    skipped  called from the thread, with one sentence for each frame that cannot be read
    wake    called from the thread when a frame is ready; may be set
    """

    def __init__(
        self, source: Iterable[Frame], fps: float | None = None, skipped: Callable[[str], None] = lambda _: None
    ):
        self._pause = 0.0 if fps is None else 1 / check_fps(fps, option("fps"), "frames")
        self._source, self._skipped = source, skipped
        self.wake: Callable[[], None] = lambda: None
        self._due = 0.0
        self._owed = 0  # frames to show although it is paused
        self._thread: threading.Thread | None = None
        self.index = -1  # of the current frame in a Sequence, otherwise -1
        self.is_paused = False
        self.loops = True  # a Sequence begins again at its end
        self._start()

    def first(self) -> Frame:
        """Waits for the first frame. Raises ValueError if the source has none."""
        frame = self._take(self._queue.get())
        if frame is None:
            raise ValueError("the source has no frames")
        return frame

    def advance(self, now: float) -> Frame | None:
        """The frame that is due, or None. Raises what the source raised."""
        if (self.is_paused and not self._owed) or now < self._due:
            return None
        try:
            item = self._queue.get_nowait()
        except queue.Empty:
            return None
        if item is None and self.total:  # the end of one that does not loop
            self.close()
            self.is_paused = True
            return None
        frame = self._take(item)
        self._owed = max(self._owed - 1, 0)
        late = now - self._due > self._pause  # then the rate restarts from now: lost time is not made up
        self._due = (now if late else self._due) + self._pause
        return frame

    def patience(self, now: float) -> float | None:
        """Seconds until `advance` may give a frame; None: not before `wake` is called or a key is pressed."""
        if (self.is_paused and not self._owed) or self._queue.empty():
            return None
        return max(self._due - now, 0.0)

    @property
    def total(self) -> int | None:
        """How many frames there are; None where nobody knows."""
        return len(self._source) if isinstance(self._source, Sequence) else None

    @property
    def indices(self) -> list[int]:
        """Of each source its frame's: there is one."""
        return [self.index]

    @property
    def rate(self) -> float | None:
        """Frames per second; None: as fast as they come."""
        return 1 / self._pause if self._pause else None

    def change_rate(self, factor: float) -> None:
        """Plays faster (a factor above 1) or slower."""
        if self.rate is None and factor > 1:
            return
        rate = max((self.rate or USUAL / factor) * factor, SLOWEST)
        self._pause = 1 / rate if rate <= FASTEST else 0.0

    def toggle(self) -> None:
        """Pauses, or continues after the current frame."""
        self.is_paused = not self.is_paused
        if not self.is_paused and self._thread is None:
            self._start(self._following)

    def toggle_loop(self) -> None:
        """Whether a Sequence begins again at its end, or pauses there."""
        self.loops = not self.loops
        if self._thread is not None:  # it may have read the beginning already, or have ended
            self.close()
            self._start(self._following if self.loops else self.index + 1)

    def step(self, direction: int) -> Frame | None:
        """Pauses and steps one frame forwards or back, past unreadable frames. A camera only goes forwards."""
        self.is_paused = True
        if not isinstance(self._source, Sequence):
            self._owed += direction > 0
            return None
        self.close()
        return self._read_near(self.index + direction, direction)

    def seek(self, index: int) -> Frame | None:
        """The frame of a Sequence with this number, or the next readable one. Playing goes on there."""
        self.close()
        frame = self._read_near(index, 1)
        if not self.is_paused:
            self._start(self.index + 1)
        return frame

    def _read_near(self, index: int, direction: int) -> Frame | None:
        assert isinstance(self._source, Sequence)
        count = len(self._source)
        for way in range(count):
            found = (index + way * direction) % count
            try:
                frame = _checked(self._source[found])
            except (ValueError, OSError) as error:
                self._skipped(str(error))
                continue
            self.index = found
            return frame
        return None

    @property
    def _following(self) -> int:
        """The number of the next frame of a Sequence: after the last the first."""
        return (self.index + 1) % (self.total or 1)

    def close(self) -> None:
        """Stops the thread."""
        if self._thread is not None:
            self._stop.set()
            self._thread.join(timeout=2)  # a camera may never give another frame; daemon threads end with it
            self._thread = None

    def _start(self, index: int = 0) -> None:
        self._queue: queue.Queue[Any] = queue.Queue(maxsize=1)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._feed, args=(self._queue, self._stop, index), daemon=True)
        self._thread.start()

    def _take(self, item: Any) -> Frame | None:
        if isinstance(item, BaseException):
            raise item
        if item is None:
            return None
        self.index, frame = item
        return _checked(frame)

    def _feed(self, frames: queue.Queue[Any], stop: threading.Event, index: int) -> None:
        """In the thread: puts frames into the queue; then None at the end, or the exception that ended the source."""

        def hand_over(item: Any) -> None:
            while not stop.is_set():
                try:
                    frames.put(item, timeout=PATIENCE)
                except queue.Full:
                    continue
                self.wake()
                return

        try:
            self._read(hand_over, stop, index)
            hand_over(None)
        except BaseException as error:
            hand_over(error)

    def _read(self, hand_over: Callable[[Any], None], stop: threading.Event, index: int) -> None:
        from ..files.frame_sources import prefetched

        while True:
            came = False
            with closing(prefetched(_numbered(self._source, index), self._skipped)) as items:
                for item in items:
                    if stop.is_set():
                        return
                    came = True
                    hand_over(item)
            if self.total is None or stop.is_set() or not self.loops:
                return
            if not came and index == 0:
                raise ValueError(f"none of the {self.total} frames can be read")
            index = 0


def _checked(frame: Any) -> Frame:
    if not isinstance(frame, Frame):
        raise TypeError(f"source must give Frames, got {shown(frame)}")
    return frame


def _numbered(source: Iterable[Frame], start: int) -> Any:
    """Frames with their numbers: of a Sequence from one on, otherwise -1."""
    return _From(source, start) if isinstance(source, Sequence) else map(_live, source)


def _live(frame: Frame | None) -> tuple[int, Frame] | None:
    """None ends the stream."""
    return None if frame is None else (-1, frame)


class _From(Sequence[tuple[int, Frame]]):
    """The frames of a sequence from one of them on, each with its number in the whole sequence."""

    def __init__(self, source: Sequence[Frame], start: int):
        self._source, self._start = source, start

    def __len__(self) -> int:
        return max(len(self._source) - self._start, 0)

    def __getitem__(self, index: Any) -> Any:
        return self._start + index, self._source[self._start + index]


class MultiPlayback:
    """What Playback is for one source, for several: `advance` gives the Views to show, and never waits.

    sources  each a Frame, a Sequence of frames, which repeats, or any other iterable (a camera)
    fps      frames per second of each; None: as fast as they come
    skipped, wake  as for Playback
    """

    index, total = -1, None  # there is no common number

    def __init__(
        self,
        sources: Sequence[Frame | Iterable[Frame]],
        fps: Sequence[float | None],
        skipped: Callable[[str], None] = lambda _: None,
    ):
        self.wake: Callable[[], None] = lambda: None
        named = enumerate(sources)  # as the panel calls them
        self._names = tuple(s.folder.name if isinstance(s, FrameSequence) else f"source {k}" for k, s in named)
        self._players: list[Playback] = []
        self._views: Views | None = None
        for source, rate, name in zip(sources, fps, self._names, strict=True):
            stream = iter([source]) if isinstance(source, Frame) else source
            self._players.append(Playback(stream, rate, lambda sentence, name=name: skipped(f"{name}: {sentence}")))
            self._players[-1].wake = lambda: self.wake()

    @property
    def indices(self) -> list[int]:
        """Of each source its frame's, as for Playback."""
        return [player.index for player in self._players]

    def first(self) -> Views:
        """Waits for the first frame of each source. Raises ValueError for a source that has none."""
        frames = tuple(player.first() for player in self._players)
        self._views = Views(frames, self._names, frames[0], (True,) * len(frames), "")
        return self._views

    def advance(self, now: float) -> Views | None:
        """The views with every frame that is due, or None if none is. Raises what a source raised."""
        return self._with([player.advance(now) for player in self._players])

    def patience(self, now: float) -> float | None:
        """As Playback: of the source that is due first."""
        waits = [wait for player in self._players if (wait := player.patience(now)) is not None]
        return min(waits, default=None)

    @property
    def is_paused(self) -> bool:
        return self._players[0].is_paused

    def toggle(self) -> None:
        """Pauses all sources, or continues them."""
        for player in self._players:
            player.toggle()

    def change_rate(self, factor: float) -> None:
        """Plays all sources faster (a factor above 1) or slower."""
        for player in self._players:
            player.change_rate(factor)

    @property
    def rate(self) -> float | None:
        """Of the first source; None: as fast as its frames come."""
        return self._players[0].rate

    def step(self, direction: int) -> Views | None:
        """Pauses all sources, and steps each one frame forwards or back."""
        return self._with([player.step(direction) for player in self._players])

    def close(self) -> None:
        """Stops the threads."""
        for player in self._players:
            player.close()

    def _with(self, new: Sequence[Frame | None]) -> Views | None:
        if self._views is None or not any(new):
            return None
        self._views = self._views.with_frames(new)
        return self._views


REST = 0.2  # seconds that nothing moves before the picture is refined: moving must not wait for it
MORE = 3  # samples a turn at most: between two turns the window answers
TURN = 0.1  # seconds that they may take, if that is not less than one
KEPT = 20  # times between two pictures
PAUSE = 0.5  # seconds after which the next picture's rate begins anew


class Rate:
    """Measures how many pictures come per second, while they come: `tick` when one does."""

    def __init__(self) -> None:
        self._gaps: deque[float] = deque(maxlen=KEPT)
        self._last = float("-inf")

    def tick(self, now: float) -> None:
        if now - self._last > PAUSE:
            self._gaps.clear()
        else:
            self._gaps.append(now - self._last)
        self._last = now

    @property
    def per_second(self) -> float | None:
        """The mean of the last ones; None before two came in a row."""
        spent = sum(self._gaps)
        return len(self._gaps) / spent if spent else None


class Redrawing:
    """Remembers what a window shows: a picture, and what lies over it (marker, text, panel), as values to compare.

    samples  that the picture has: one while things move, more and more while nothing does
    rate     of the pictures that differ
    drawn    how often the window was drawn
    """

    def __init__(self) -> None:
        self.samples, self.rate, self.drawn = 1, Rate(), 0
        self._shown: Any = None
        self._picture: Any = None
        self._since = self._began = 0.0
        self._added, self._more = 1, MORE  # samples of this turn, and of the next one

    def forget(self) -> None:
        """Draw anew in any case: the window lost its content."""
        self._shown = None

    def patience(self, picture: Any, over: Any, now: float, most: int) -> float | None:
        """Return the seconds until the window must be drawn; None: not before something changes."""
        return self._rest(picture, now, most) if (picture, over) == self._shown else 0.0

    def begin(self, picture: Any, now: float, most: int) -> int:
        """Return how many samples the next picture has. It is drawn anew if it has changed."""
        before, self._began = self.samples, now
        if picture != self._picture:
            self.rate.tick(now)
            self._picture, self._since, self.samples, before = picture, now, 1, 0
        elif self._rest(picture, now, most) == 0:
            self.samples = min(self.samples + self._more, most)
        self._added = self.samples - before
        return self.samples

    def end(self, picture: Any, over: Any, now: float) -> None:
        """Remember that this was drawn, until now; None is the picture before, drawn again."""
        self._shown = picture, over
        self.drawn += 1
        if picture is not None and self._added:
            self._more = max(1, min(MORE, int(TURN * self._added / max(now - self._began, 1e-6))))

    def _rest(self, picture: Any, now: float, most: int) -> float | None:
        """Seconds until more samples are due; None: they are not."""
        if picture != self._picture or self.samples >= most:
            return None
        return max(self._since + REST - now, 0.0)
