"""How many pictures come per second, while they come."""

from __future__ import annotations

from collections import deque

KEPT = 20  # times between two pictures
PAUSE = 0.5  # seconds after which the next picture begins anew


class Rate:
    """`tick` when a picture comes."""

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
