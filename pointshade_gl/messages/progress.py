"""Tells a function of the caller's how far work has come, which may end it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import numpy as np

from .errors import Cancelled, check_function

Progress = Callable[[int, int], object]
_is_ended: ContextVar[Callable[[], bool] | None] = ContextVar("is_ended", default=None)  # asked between two steps


@contextmanager
def endable(is_ended: Callable[[], bool]) -> Iterator[None]:
    """End work inside that takes long with Cancelled, at its next `checkpoint`, once the function returns True."""
    token = _is_ended.set(is_ended)
    try:
        yield
    finally:
        _is_ended.reset(token)


def is_endable() -> bool:
    """Return whether the work that runs here may be ended, and others wait for a thread that answers."""
    return _is_ended.get() is not None


def checkpoint() -> None:
    """Raise Cancelled if the work that runs here has been ended. Called where it can be left."""
    is_ended = _is_ended.get()
    if is_ended is not None and is_ended():
        raise Cancelled("ended by the user")


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
        checkpoint()
        answer = None if self._progress is None or not count else self._progress(self.done, self.all)
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Cancelled(f"cancelled after {self.done} of {self.all} steps: progress returned False")
