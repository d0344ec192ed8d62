"""Work beside the window: a thread does what takes long, while the window goes on answering. No GL, no window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextvars import copy_context
from dataclasses import dataclass
from typing import Any

from ..checks.arguments import Progress, endable
from ..notes.errors import Cancelled

GRACE = 0.05  # seconds that a turn waits for work: what ends so soon shows no bar


@dataclass(frozen=True, eq=False)
class Work:
    """What takes long.

    title   tells the user what runs; "": nothing is told
    do      is called in a thread, with a `Progress`; what it returns goes to `done`
    done    is called in the window's thread afterwards
    failed  is called there instead, with what was raised: Cancelled if the user has ended it
    lends   the window's renderer is in use meanwhile: nobody else may draw
    unused  is called in the thread with a result that came after the user had ended it
    """

    title: str
    do: Callable[[Progress], Any]
    done: Callable[[Any], object]
    failed: Callable[[BaseException], object]
    lends: bool = True
    unused: Callable[[Any], object] = lambda _: None


class Background:
    """Does one work at a time.

    wake   called from the thread when the work has gone on, or has ended
    grace  seconds that `start` waits for the end
    """

    def __init__(self, wake: Callable[[], None], grace: float = GRACE):
        self._wake, self.grace = wake, grace
        self.work: Work | None = None
        self._steps = 0, 0  # done, and all
        self._is_ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._outcome: list[tuple[Any, BaseException | None]] = []  # one at most

    @property
    def lends(self) -> bool:
        """Return whether the renderer is in use."""
        return self.work is not None and self.work.lends

    @property
    def share(self) -> float:
        """Return how much of the work is done, from 0 to 1."""
        done, total = self._steps
        return min(done / total, 1.0) if total else 0.0

    @property
    def title(self) -> str:
        """Return what runs, in words; "" if nothing does that the user is told of."""
        if self.work is None or not self.work.title:
            return ""
        return f"{self.work.title}: ending" if self._is_ended.is_set() else f"{self.work.title}     Esc ends it"

    def start(self, work: Work) -> None:
        """Begin a work, and see its end if it comes at once. Only while no other runs."""
        assert self.work is None, "one at a time"
        self.work, self._steps, self._outcome, self._is_ended = work, (0, 0), [], threading.Event()
        told = work, self._is_ended, self._outcome
        run = copy_context().run  # where notes go is the same in the thread
        self._thread = threading.Thread(target=run, args=(self._run, *told), daemon=True)
        self._thread.start()
        self.join(self.grace)
        self.poll()

    def poll(self) -> None:
        """See whether the work has ended."""
        if self.work is None or not self._outcome:
            return
        work, (result, error) = self.work, self._outcome[0]
        self.join()
        self.work = self._thread = None
        if error is None:
            work.done(result)
        else:
            work.failed(error)

    def end(self) -> None:
        """End the work. One that lends the renderer goes on to where it can be left; others are left alone at once."""
        if self.work is None:
            return
        self._is_ended.set()
        if not self.work.lends:
            self._outcome, self._thread = [(None, Cancelled("ended by the user"))], None
            self.poll()

    def join(self, seconds: float | None = None) -> None:
        """Wait for the end of the work; None: as long as it takes."""
        if self._thread is not None:
            self._thread.join(seconds)

    def close(self) -> None:
        """End the work, wait for that, and tell nobody."""
        if self.work is not None:
            self._is_ended.set()
            if self.work.lends:
                self.join()
            self.work = None

    def _run(self, work: Work, is_ended: threading.Event, outcome: list[tuple[Any, BaseException | None]]) -> None:
        """In the thread."""

        def progress(done: int, total: int) -> None:
            self._steps = done, total
            self._wake()

        result, error = None, None
        try:
            with endable(is_ended.is_set):
                result = work.do(progress)
        except BaseException as raised:  # it is raised again where somebody sees it
            error = raised
        if work.lends or not is_ended.is_set():
            outcome.append((result, error))
            self._wake()
        elif error is None:
            work.unused(result)
