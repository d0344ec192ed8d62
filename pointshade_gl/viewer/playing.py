"""What a viewer plays: a stream, several at once, or a sequence, whose frames can also be merged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from ..scene.frame import Frame
from ..scene.graph import Scene
from .playback import Playback
from .rate import Rate
from .shown import Shown
from .timeline import Strip, strip_of
from .together import Together
from .views import Merger, Views

MERGED = "the views are merged: M plays the frames"
Answer = tuple[Shown | None, str]  # what to show from now on, None for the same; what to say, "" for nothing


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
        self.playback: Playback | Together | None = None  # None: nothing moves
        self.merger: Merger | None = None
        if isinstance(source, Scene):
            return
        if others:
            self.playback = Together([source, *others], rates, skipped)
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

    def pause(self, shown: Shown) -> str:
        """Pauses a stream, or continues it; what to say."""
        if self.playback is None:
            return "a single frame: nothing to play"
        if not self._plays(shown):
            return MERGED
        self.playback.toggle()
        return self._pace(self.playback)

    def step(self, shown: Shown, direction: int) -> Answer:
        """Pauses a stream and steps one frame forwards (1) or back (-1)."""
        if self.playback is None:
            return None, "a single frame: nothing to step through"
        if not self._plays(shown):
            return None, MERGED
        new = self.playback.step(direction)
        total = self.playback.total
        text = f"frame {self.playback.index} (0 to {total - 1})" if total else "paused"
        return new and _as_switched(new, shown), text

    def seek(self, shown: Shown, index: int) -> Answer:
        """Shows the frame with this number, counted from the end if it is below 0."""
        if not (sequence := self._sequence(shown)):
            return None, self._why_none(shown, "jump to")
        total = sequence.total
        assert total is not None
        return sequence.seek(index % total), f"frame {sequence.index} (0 to {total - 1})"

    def change_rate(self, shown: Shown, factor: float) -> str:
        """Plays faster (a factor above 1) or slower; what to say."""
        if self.playback is None or not self._plays(shown):
            return self._why_none(shown, "play")
        if isinstance(self.playback, Playback) and self.playback.total is None:
            return "a live stream comes at its own rate"
        self.playback.change_rate(factor)
        rate = self.playback.rate
        return "as fast as they come" if rate is None else f"{rate:g} frames per second"

    def toggle_loop(self, shown: Shown) -> str:
        """Whether a sequence begins again at its end; what to say."""
        if not (sequence := self._sequence(shown)):
            return self._why_none(shown, "repeat")
        sequence.toggle_loop()
        return "the sequence begins again at its end" if sequence.loops else "the sequence stops at its end"

    def strip(self, shown: Shown) -> Strip | None:
        """What the timeline shows; None where frames do not play."""
        return strip_of(self.playback, self._arriving.per_second) if self._plays(shown) else None

    def total(self, shown: Shown) -> int | None:
        """How many frames the timeline is for; None: it has no bar."""
        sequence = self._sequence(shown)
        return sequence.total if sequence else None

    def _sequence(self, shown: Shown) -> Playback | None:
        """What plays, if its frames have numbers."""
        playback = self.playback
        return playback if isinstance(playback, Playback) and playback.total and self._plays(shown) else None

    def _why_none(self, shown: Shown, what: str) -> str:
        if self.playback is None:
            return f"a single frame: nothing to {what}"
        if not self._plays(shown):
            return MERGED
        several = isinstance(self.playback, Together)
        return "several sources have no frames in common" if several else "the frames of a live stream have no numbers"

    def toggle_views(self, shown: Shown) -> Answer:
        """Draws several frames of a sequence as one object, or plays them again."""
        if self.playback is None:
            return None, "a single frame: nothing to merge"
        if self.merger is None:
            is_live = isinstance(shown, Views)
            return None, "these sources are always merged" if is_live else "only frames of a sequence can be merged"
        if isinstance(shown, Views):
            return shown.home, self._pace(self.playback)
        if self.merger.is_reading:
            self.merger.close()
            return None, "not merged"
        try:
            self.merger.start(self.playback.index)
        except ValueError as error:
            return None, str(error)
        return None, ""

    def merged(self, message: str) -> Answer:
        """Says how many views are read; shows them when that was all and is the message: merging takes a moment."""
        assert self.merger is not None
        if message != self.merger.progress:
            return None, self.merger.progress
        try:
            views = self.merger.finish()
        except ValueError as error:
            return None, str(error)
        return views, f"{len(views.frames)} views as one object; M plays the frames" if views else ""

    def close(self) -> None:
        """Ends the threads that read."""
        for reader in (self.merger, self.playback):
            if reader:
                reader.close()

    def _plays(self, shown: Shown) -> bool:
        """What is shown comes from a stream, which may be paused."""
        return not (self.merger and (isinstance(shown, Views) or self.merger.is_reading))

    def _pace(self, playback: Playback | Together) -> str:
        return "paused" if playback.is_paused else "playing"


def _as_switched(new: Frame | Views, shown: Shown) -> Frame | Views:
    """New frames of a stream; views stay switched as they are."""
    return replace(new, on=shown.on) if isinstance(new, Views) and isinstance(shown, Views) else new
