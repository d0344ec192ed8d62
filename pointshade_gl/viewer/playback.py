"""Plays streams of frames, one or several at once, each at its own rate, and merges views."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any, NamedTuple

from ..checks.arguments import check_fps
from ..files.frame_sources import choose_views, prefetched
from ..files.frames.sequences import FrameSequence
from ..notes.words import option, shown
from ..scene.frame import Frame
from ..scene.graph import Scene
from .events import ChangeRate, PlayCommand, PlayEffect, Seek, StepFrames
from .state import Shown, Views, views_in

SLOWEST, USUAL, FASTEST = 0.5, 30.0, 240.0  # frames per second that keys choose; beyond, they play as fast as they come
PATIENCE = 0.1  # seconds after which a waiting thread checks again whether it should stop
READERS = 2  # threads that read views to merge
MERGED = "the views are merged: M plays the frames"
NO_NUMBERS = "the frames of a live stream have no numbers"
Answer = tuple[Shown | None, str]  # what to show from now on, None for the same; a message, "" for none


class Player:
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
        if self.patience(now) != 0:
            return None
        item = self._queue.get_nowait()
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
        is_held = self.is_paused and not self._owed
        return None if is_held or self._queue.empty() else max(self._due - now, 0.0)

    @property
    def total(self) -> int | None:
        """How many frames there are; None where nobody knows."""
        return len(self._source) if isinstance(self._source, Sequence) else None

    @property
    def rate(self) -> float | None:
        """Frames per second; None: as fast as they come."""
        return 1 / self._pause if self._pause else None

    def change_rate(self, factor: float) -> None:
        if self.rate is None and factor > 1:
            return
        rate = max((self.rate or USUAL / factor) * factor, SLOWEST)
        self._pause = 1 / rate if rate <= FASTEST else 0.0

    def toggle(self) -> None:
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
        if self.total is None:
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
        for found in ((index + way * direction) % count for way in range(count)):
            try:
                return self._take((found, self._source[found]))
            except (ValueError, OSError) as error:
                self._skipped(str(error))
        return None

    @property
    def _following(self) -> int:
        """The number of the next frame of a Sequence: after the last the first."""
        return (self.index + 1) % (self.total or 1)

    def close(self) -> None:
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
        if item is None:  # it ends the stream
            return None
        self.index, frame = (-1, item) if self.total is None else item
        if not isinstance(frame, Frame):
            raise TypeError(f"source must give Frames, got {shown(frame)}")
        return frame

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
            with closing(self._read(index)) as items:
                for item in items:
                    hand_over(item)
                    if stop.is_set():
                        return
            hand_over(None)
        except BaseException as error:
            hand_over(error)

    def _read(self, index: int) -> Generator[Any, None, None]:
        """Frames, those of a Sequence with their numbers, from one on, and if it loops over and over again."""
        while True:
            came = False
            source: Any = _From(self._source, index) if isinstance(self._source, Sequence) else self._source
            with closing(prefetched(source, self._skipped)) as items:
                for item in items:
                    came = True
                    yield item
            if self.total is None or not self.loops:
                return
            if not came and index == 0:
                raise ValueError(f"none of the {self.total} frames can be read")
            index = 0


class _From(Sequence[tuple[int, Frame]]):
    """The frames of a sequence from one of them on, each with its number in the whole sequence."""

    def __init__(self, source: Sequence[Frame], start: int):
        self._source, self._start = source, start

    def __len__(self) -> int:
        return max(len(self._source) - self._start, 0)

    def __getitem__(self, index: Any) -> Any:
        return self._start + index, self._source[self._start + index]


RATE_GAPS = 20  # times between two pictures
RATE_PAUSE = 0.5  # seconds after which the next picture's rate begins anew


class Rate:
    """Measures how many pictures come per second, while they come: `tick` when one does."""

    def __init__(self) -> None:
        self._gaps: deque[float] = deque(maxlen=RATE_GAPS)
        self._last = float("-inf")

    def tick(self, now: float) -> None:
        if now - self._last > RATE_PAUSE:
            self._gaps.clear()
        else:
            self._gaps.append(now - self._last)
        self._last = now

    @property
    def per_second(self) -> float | None:
        """The mean of the last ones; None before two came in a row."""
        spent = sum(self._gaps)
        return len(self._gaps) / spent if spent else None


class TimelineBar(NamedTuple):
    """What the timeline shows."""

    text: str  # in one line
    # of the sequence that has been played, with the present frame; None where nobody knows how many come
    share: float | None


class Playback:
    """Where frames come from, one source or several at once, and what keys do to them. What is shown now is passed in.

    sources  a frame or a scene, which alone does not play, or whatever Viewer takes; several play together as Views
    rates    frames per second of each source; None: as fast as they come
    count    how many frames of a sequence are merged, or their numbers; None for all
    skipped  called with one sentence for each frame that cannot be read, or is left out
    players  one for each source that plays
    """

    # reads all frames of what the first source is the front of; None: there are no others
    whole: Callable[[], Mapping[int, Frame]] | None = None

    def __init__(
        self, sources: Sequence[Frame | Scene | Iterable[Frame]], rates: Sequence[float | None],
        count: int | Sequence[int] | None, skipped: Callable[[str], None],
    ):  # fmt: skip
        self._first: Any = sources[0]
        self._rate, self._count, self._skipped = rates[0], count, skipped
        self._wake: Callable[[], None] = lambda: None
        self._arriving = Rate()
        self._names: list[str] = []  # as the panel calls the sources
        self.players: list[Player] = []
        self._pool: ThreadPoolExecutor | None = None  # that reads frames to merge
        self._jobs: dict[int, Future[Frame]] = {}
        self._completing: Future[Mapping[int, Frame]] | None = None
        self._home = -1
        is_alone = len(sources) == 1
        for k, (source, rate) in enumerate(zip(sources, rates, strict=True)):
            plays = isinstance(source, Iterable)
            if is_alone and not plays:
                break
            name = source.folder.name if isinstance(source, FrameSequence) else f"source {k}"
            report = skipped if is_alone else lambda sentence, name=name: skipped(f"{name}: {sentence}")
            self.players.append(Player(source if plays else iter(source.frames), rate, report))
            self._names.append(name)

    def first(self, merge: bool) -> Shown:
        """What is shown at first; merge: frames of the sequence are read to be merged."""
        if not self.players:
            return self._first.framed()
        first, *others = frames = tuple(player.first() for player in self.players)
        if others:
            return Views(frames, tuple(self._names), first, (True,) * len(frames), "")
        if merge and self._total:
            if isinstance(self._count, Sequence):  # then the first of the merged ones is at home
                first = self.players[0].seek(self._count[0]) or first
            self._start_merging()
        return first

    def instead(self, sources: Sequence[Frame | Scene | Iterable[Frame]]) -> Playback:
        """Plays something else, at the rate of the first source."""
        return Playback(sources, [self._rate] * len(sources), self._count, self._skipped)

    def wake_by(self, wake: Callable[[], None]) -> None:
        """From now on, this is called when a frame is ready, from the threads that read."""
        self._wake = wake
        for player in self.players:
            player.wake = wake

    @property
    def is_merging(self) -> bool:
        return self._pool is not None

    def advance(self, shown: Shown, now: float) -> Shown | None:
        """What is due, or None. Raises what a source raised."""
        if not self._plays(shown):
            return None
        new = _with(shown, [player.advance(now) for player in self.players])
        if new:
            self._arriving.tick(now)
        return new

    def patience(self, shown: Shown, now: float) -> float | None:
        """Seconds until there may be something to show; None: not before the threads wake the window."""
        if self.is_merging and self._are_read:
            return 0.0
        waits = [player.patience(now) for player in self.players if self._plays(shown)]
        return min((wait for wait in waits if wait is not None), default=None)

    def obey(self, key: PlayEffect, shown: Shown) -> Answer:
        if not self.players:
            return None, f"a single frame: nothing to {key.verb}"
        if key is PlayCommand.TOGGLE_MERGE:
            return self._toggle_merge(shown)
        if not self._plays(shown):
            return None, MERGED
        player, total = self.players[0], self._total
        if isinstance(key, StepFrames):
            new = _with(shown, [one.step(key.direction) for one in self.players])
            return new, f"frame {player.index} (0 to {total - 1})" if total else "paused"
        if isinstance(key, ChangeRate):
            return None, self._change_rate(key.factor)
        if key is PlayCommand.TOGGLE_PAUSE:
            for one in self.players:
                one.toggle()
            return None, self._pace
        if not total:
            return None, NO_NUMBERS if len(self.players) == 1 else "several sources have no frames in common"
        if isinstance(key, Seek):
            return player.seek(key.index % total), f"frame {player.index} (0 to {total - 1})"
        player.toggle_loop()
        return None, f"the sequence {'begins again' if player.loops else 'stops'} at its end"

    def strip(self, shown: Shown) -> TimelineBar | None:
        """What the timeline shows, or how many views are read; None where frames do not play."""
        if self.is_merging:
            read, most = sum(job.done() for job in self._jobs.values()), len(self._jobs)
            return TimelineBar(f"merging: {read} of {most} views are read     Esc ends it", read / max(most, 1))
        if not self.players or not self._plays(shown):
            return None
        player, arriving = self.players[0], self._arriving.per_second
        rate = "paused" if player.is_paused else f"{arriving:.0f} frames/s" if arriving else "playing"
        if player.total is None or len(self.players) > 1:
            return TimelineBar(rate if len(self.players) > 1 else f"live, {rate}", None)
        asked = "as fast as they come" if player.rate is None else f"{player.rate:g} frames/s"
        state = "paused" if player.is_paused else "loops" if player.loops else "plays once"
        text = f"frame {player.index} (0 to {player.total - 1}), {asked}, {state}"
        return TimelineBar(text, (player.index + 1) / player.total)

    def is_moving(self, shown: Shown) -> bool:
        return bool(self.players) and not self.players[0].is_paused and self._plays(shown)

    def total(self, shown: Shown) -> int | None:
        """How many frames the timeline is for; None: it has no bar."""
        return self._total if self._plays(shown) else None

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of each source that plays: that of its frame, -1 in a live stream."""
        return tuple(player.index for player in self.players)

    def merged(self) -> Answer:
        if not self._are_read:
            return None, ""
        jobs, found = self._jobs, {}
        self.end_merging()
        for k, job in jobs.items():
            try:
                found[k] = job.result()
            except (ValueError, OSError) as error:
                self._skipped(str(error))
        if len(found) < 2:
            return None, f"not merged: fewer than two of {len(jobs)} frames can be read"
        return Views.of(found, self._home), f"{len(found)} views as one object; M plays the frames"

    def completed(self) -> Views | None:
        """All of the object in place of its front, once, as soon as it is read; begins to read it at the first call."""
        if self.whole and not self._completing:
            pool = ThreadPoolExecutor(1, thread_name_prefix="pointshade-decode")
            self._completing = pool.submit(self.whole)
            self._completing.add_done_callback(lambda _: self._wake())
            pool.shutdown(wait=False)
        if not (self._completing and self._completing.done()):
            return None
        job, self._completing, self.whole = self._completing, None, None
        return Views.of(job.result())

    def end_merging(self) -> bool:
        """Read no more views to merge. Return whether some were being read."""
        was_merging = self._pool is not None
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool, self._jobs = None, {}
        return was_merging

    def close(self) -> None:
        self.end_merging()
        for player in self.players:
            player.close()

    def _start_merging(self) -> None:
        """Begins to read frames, among them the one that is shown. Raises ValueError if there is none to merge."""
        self._home = self.players[0].index
        chosen = choose_views(self._first, self._count, self._skipped, self._home)
        self._pool = ThreadPoolExecutor(READERS, thread_name_prefix="pointshade-decode")
        self._jobs = {k: self._pool.submit(self._first.__getitem__, k) for k in chosen}
        for job in self._jobs.values():
            job.add_done_callback(lambda _: self._wake())

    @property
    def _are_read(self) -> bool:
        return all(job.done() for job in self._jobs.values())

    @property
    def _total(self) -> int | None:
        """How many frames a single sequence has."""
        return self.players[0].total if len(self.players) == 1 else None

    @property
    def _pace(self) -> str:
        return "paused" if self.players[0].is_paused else "playing"

    def _plays(self, shown: Shown) -> bool:
        """What is shown comes from a stream, which may be paused."""
        return not (self.is_merging or (len(self.players) == 1 and views_in(shown)))

    def _toggle_merge(self, shown: Shown) -> Answer:
        """Draws several frames of a sequence as one object, or plays them again."""
        if views := views_in(shown):
            return (views.home, self._pace) if len(self.players) == 1 else (None, "these sources are always merged")
        if self._total is None:
            return None, "only frames of a sequence can be merged"
        if self.end_merging():
            return None, "not merged"
        try:
            self._start_merging()
        except ValueError as error:
            return None, str(error)
        return None, ""

    def _change_rate(self, factor: float) -> str:
        """Plays faster (a factor above 1) or slower. Returns a message."""
        if len(self.players) == 1 and self._total is None:
            return "a live stream comes at its own rate"
        for player in self.players:
            player.change_rate(factor)
        rate = self.players[0].rate
        return "as fast as they come" if rate is None else f"{rate:g} frames per second"


def _with(shown: Shown, new: Sequence[Frame | None]) -> Shown | None:
    """What is shown with the frames that came, views switched as they are; None if none came."""
    if not any(new):
        return None
    return views.with_frames(new) if (views := views_in(shown)) else new[0]
