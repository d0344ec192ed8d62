"""What a viewer plays: a stream, several at once, or a sequence, whose frames can also be merged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from ..scene.frame import Frame
from ..scene.graph import Scene
from .events import ChangeRate, PlayCommand, PlayEffect, Seek, StepFrames
from .playback import MultiPlayback, Playback, Rate
from .views import Merger, Shown, Views

MERGED = "the views are merged: M plays the frames"
Answer = tuple[Shown | None, str]  # what to show from now on, None for the same; what to say, "" for nothing


class TimelineBar(NamedTuple):
    """What the timeline shows.

    text   in one line
    share  of the sequence that has been played, with the present frame; None where nobody knows how many come
    """

    text: str
    share: float | None


class Playing:
    """Knows where frames come from, and what the keys do to them. What is shown at the moment, it is told.

    source, others  as for Viewer
    rates    frames per second of each source; None: as fast as they come
    count    how many frames of a sequence are merged, or their numbers; None for all
    skipped  called with one sentence for each frame that cannot be read, or is left out
    """

    def __init__(
        self,
        source: Frame | Scene | Iterable[Frame],
        others: Sequence[Frame | Iterable[Frame]],
        rates: Sequence[float | None],
        count: int | Sequence[int] | None,
        skipped: Callable[[str], None],
    ):
        self._source, self._rate, self._count, self._skipped = source, rates[0], count, skipped
        self._arriving = Rate()
        self.playback: Playback | MultiPlayback | None = None  # None: nothing moves
        self.merger: Merger | None = None
        if isinstance(source, Scene):
            return
        if others:
            self.playback = MultiPlayback([source, *others], rates, skipped)
        elif not isinstance(source, Frame):
            self.playback = Playback(source, rates[0], skipped)
            if isinstance(source, Sequence):
                self.merger = Merger(source, count, skipped)

    def first(self, merge: bool) -> Shown:
        """What is shown at first; merge: frames of the sequence are read to be merged."""
        if isinstance(self._source, Scene):
            return self._source.framed()
        if self.playback is None:
            assert isinstance(self._source, Frame)
            return self._source
        frame = self.playback.first()
        if self.merger and merge:
            assert isinstance(self.playback, Playback)
            if isinstance(self._count, Sequence):  # then the first of the merged ones is at home
                frame = self.playback.seek(self._count[0]) or frame
            self.merger.start(self.playback.index)
        return frame

    def instead(self, source: Frame | Scene | Iterable[Frame], others: Sequence[Frame | Iterable[Frame]]) -> Playing:
        """Plays something else, at the rate of the first source."""
        return Playing(source, others, [self._rate] * (1 + len(others)), self._count, self._skipped)

    def wake_by(self, wake: Callable[[], None]) -> None:
        """From now on, this is called when a frame is ready, from the threads that read."""
        for reader in (self.playback, self.merger):
            if reader:
                reader.wake = wake

    @property
    def is_merging(self) -> bool:
        """Frames are being read to be merged."""
        return self.merger is not None and self.merger.is_reading

    def advance(self, shown: Shown, now: float) -> Shown | None:
        """What is due, or None."""
        new = self.playback.advance(now) if self.playback and self._plays(shown) else None
        if new:
            self._arriving.tick(now)
        return new and _as_switched(new, shown)

    def patience(self, shown: Shown, now: float) -> float | None:
        """Seconds until there may be something to show; None: not before the threads wake the window."""
        if self.merger and self.merger.is_ready:
            return 0.0
        return self.playback.patience(now) if self.playback and self._plays(shown) else None

    def obey(self, key: PlayEffect, shown: Shown) -> Answer:
        """Do what a key asks for."""
        if self.playback is None:
            return None, f"a single frame: nothing to {key.verb}"
        if key is PlayCommand.TOGGLE_MERGE:
            return self._toggle_merge(self.playback, shown)
        if not self._plays(shown):
            return None, MERGED
        if isinstance(key, StepFrames):
            return self._step(self.playback, shown, key.direction)
        if isinstance(key, ChangeRate):
            return None, _change_rate(self.playback, key.factor)
        if key is PlayCommand.TOGGLE_PAUSE:
            self.playback.toggle()
            return None, _pace(self.playback)
        sequence, total = self.playback, self.playback.total
        if isinstance(sequence, MultiPlayback):
            return None, "several sources have no frames in common"
        if not total:
            return None, "the frames of a live stream have no numbers"
        if isinstance(key, Seek):
            return sequence.seek(key.index % total), f"frame {sequence.index} (0 to {total - 1})"
        sequence.toggle_loop()
        return None, f"the sequence {'begins again' if sequence.loops else 'stops'} at its end"

    def _step(self, playback: Playback | MultiPlayback, shown: Shown, direction: int) -> Answer:
        """Pauses a stream, and steps one frame forwards (1) or back (-1)."""
        new, total = playback.step(direction), playback.total
        text = f"frame {playback.index} (0 to {total - 1})" if total else "paused"
        return new and _as_switched(new, shown), text

    def strip(self, shown: Shown) -> TimelineBar | None:
        """What the timeline shows, or how many views are read; None where frames do not play."""
        if self.merger and self.merger.is_reading:
            return TimelineBar(f"{self.merger.progress}     Esc ends it", self.merger.share)
        playback, arriving = self.playback, self._arriving.per_second
        if playback is None or not self._plays(shown):
            return None
        rate = "paused" if playback.is_paused else f"{arriving:.0f} frames/s" if arriving else "playing"
        if isinstance(playback, MultiPlayback):
            return TimelineBar(rate, None)
        total = playback.total
        if total is None:
            return TimelineBar(f"live, {rate}", None)
        asked = "as fast as they come" if playback.rate is None else f"{playback.rate:g} frames/s"
        state = "paused" if playback.is_paused else "loops" if playback.loops else "plays once"
        return TimelineBar(f"frame {playback.index} (0 to {total - 1}), {asked}, {state}", (playback.index + 1) / total)

    def is_moving(self, shown: Shown) -> bool:
        """Whether other frames will come by themselves."""
        return self.playback is not None and not self.playback.is_paused and self._plays(shown)

    def total(self, shown: Shown) -> int | None:
        """How many frames the timeline is for; None: it has no bar."""
        return (self.playback and self.playback.total) if self._plays(shown) else None

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of each source that plays: that of its frame, -1 in a live stream."""
        return tuple(self.playback.indices) if self.playback else ()

    def _toggle_merge(self, playback: Playback | MultiPlayback, shown: Shown) -> Answer:
        """Draws several frames of a sequence as one object, or plays them again."""
        if self.merger is None:
            is_live = isinstance(shown, Views)
            return None, "these sources are always merged" if is_live else "only frames of a sequence can be merged"
        if isinstance(shown, Views):
            return shown.home, _pace(playback)
        if self.end_merging():
            return None, "not merged"
        try:
            self.merger.start(playback.index)
        except ValueError as error:
            return None, str(error)
        return None, ""

    def merged(self) -> Answer:
        """Shows the views once all of them are read."""
        assert self.merger is not None
        try:
            views = self.merger.finish()
        except ValueError as error:
            return None, str(error)
        return views, f"{len(views.frames)} views as one object; M plays the frames" if views else ""

    def end_merging(self) -> bool:
        """Read no more views to merge. Return whether some were being read."""
        was_merging = self.is_merging
        if self.merger:
            self.merger.close()
        return was_merging

    def close(self) -> None:
        """Ends the threads that read."""
        for reader in (self.merger, self.playback):
            if reader:
                reader.close()

    def _plays(self, shown: Shown) -> bool:
        """What is shown comes from a stream, which may be paused."""
        return not (self.is_merging or (self.merger and isinstance(shown, Views)))


def _change_rate(playback: Playback | MultiPlayback, factor: float) -> str:
    """Plays faster (a factor above 1) or slower; what to say."""
    if isinstance(playback, Playback) and playback.total is None:
        return "a live stream comes at its own rate"
    playback.change_rate(factor)
    return "as fast as they come" if playback.rate is None else f"{playback.rate:g} frames per second"


def _pace(playback: Playback | MultiPlayback) -> str:
    return "paused" if playback.is_paused else "playing"


def _as_switched(new: Frame | Views, shown: Shown) -> Frame | Views:
    """New frames of a stream; views stay switched as they are."""
    return replace(new, on=shown.on) if isinstance(new, Views) and isinstance(shown, Views) else new
