"""The line of text over the picture: what was said last, for a few seconds."""

from __future__ import annotations

import sys
import time
from collections import deque

from ..scene.orbit_state import State

SECONDS = 4.0
STAYS = "the light stays here: L lets it follow the mouse again"
LATER = "; seen once lit again (B)"
NOT_SHADED = "; seen once shaded (2, 3 or 4)"


class Messages:
    """Keeps the text that is shown. What threads skip waits until the window's own thread tells it.

    text  "" if there is none
    """

    def __init__(self) -> None:
        self.text, self._until = "", float("inf")
        self._skipped: deque[str] = deque()  # from the threads that read streams
        self._told: set[str] = set()

    def say(self, text: str, seconds: float | None = None) -> None:
        self.text, self._until = text, time.perf_counter() + (SECONDS if seconds is None else seconds)

    def skip(self, text: str) -> None:
        """Says later, and once, why a frame was skipped. For any thread."""
        self._skipped.append(text)

    def update(self, now: float) -> None:
        """Tells what was skipped, and takes the text away when its time is over."""
        while self._skipped:
            if (text := self._skipped.popleft()) not in self._told:  # a sequence that repeats meets it again
                self._told.add(text)
                self.say(f"skipped: {text}")
                sys.stderr.write(f"warning: skipped: {text}\n")
        if self._until < now:
            self.clear()

    def clear(self) -> None:
        self.text, self._until = "", float("inf")

    def patience(self, now: float) -> float | None:
        """Seconds until `update` has something to do; None: not before something is said."""
        if self._skipped:
            return 0.0
        return max(self._until - now, 0.0) if self._until < float("inf") else None


def when_seen(state: State) -> str:
    """When a change of the light is seen, to end a message; "" if it is now."""
    return "" if state.is_lit else NOT_SHADED if state.lit else LATER
