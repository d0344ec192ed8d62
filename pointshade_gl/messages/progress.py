"""Tells a function of the caller's how far work has come, which may end it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .errors import Cancelled
from .validation import check_function

Progress = Callable[[int, int], object]


class Count:
    """Counts the steps of work, and calls `progress(done, all)` after each.

    done  so many of all the steps, whose number may become known late
    """

    def __init__(self, progress: Progress | None = None, all: int = 0):
        self._progress = None if progress is None else check_function(progress, "progress")
        self.done, self.all = 0, all

    def step(self, count: int = 1) -> None:
        """Count steps as done. Raises Cancelled if `progress` returns False, and whatever it raises."""
        self.done += count
        answer = None if self._progress is None or not count else self._progress(self.done, self.all)
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Cancelled(f"cancelled after {self.done} of {self.all} steps: progress returned False")
