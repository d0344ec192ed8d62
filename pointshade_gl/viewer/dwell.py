"""Where the light was held on purpose: where the mouse stayed for a moment, not where it came through on its way."""

from __future__ import annotations

import math

MOMENT = 0.25  # seconds
NEAR = 0.1  # rims: who moves less in a moment, stays
Pair = tuple[float, float]


class Dwell:
    """Sees the light go with the mouse. When the mouse leaves, it tells where the light was before the way out."""

    def __init__(self) -> None:
        self._kept: Pair = (0.0, 0.0)  # light that was held on purpose
        self._around: Pair = (0.0, 0.0)  # the mouse has been near this place since then
        self._since = 0.0
        self._last: Pair | None = None  # light after the last move

    def move(self, time: float, mouse: Pair, before: Pair, after: Pair) -> None:
        """The mouse moved to a place, and took the light along. All places in rims, the time in seconds."""
        if self._is_on_purpose(time, before):
            self._kept, self._around, self._since = before, mouse, time
        elif math.dist(mouse, self._around) > NEAR:
            self._around, self._since = mouse, time
        self._last = after

    def leave(self, time: float, light: Pair) -> Pair:
        """The light's place after the mouse left."""
        return light if self._is_on_purpose(time, light) else self._kept

    def _is_on_purpose(self, time: float, light: Pair) -> bool:
        """If somebody else put the light there, that was on purpose, too."""
        return light != self._last or time - self._since >= MOMENT
