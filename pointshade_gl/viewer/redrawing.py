"""When a window is drawn: after something that it depends on has changed, and again while its picture is refined."""

from __future__ import annotations

from collections import deque
from typing import Any

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
