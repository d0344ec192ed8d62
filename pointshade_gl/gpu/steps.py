"""The steps of the pipeline: each runs only when what it reads has changed; counted, and timed on demand."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import moderngl
import numpy as np

_Result = TypeVar("_Result")


class Lap(NamedTuple):
    """Milliseconds of one run: until the GPU had finished, and by its own timer (None where there is none)."""

    wall_ms: float
    gpu_ms: float | None


class Steps:
    """Remembers for each step what it last ran with.

    The rule: a step runs when its inputs are not those of its last run, when a step before it has run since, or when
    it has no inputs to compare. Frames are compared by identity (they never change), values and arrays by value.

    counts  how often each step has run
    timed   set it to True to have `laps` filled; the GPU then waits for each step, so the whole is slower
    laps    the last run of each step
    """

    def __init__(self, context: moderngl.Context, is_software: bool):
        self._context = context
        self._is_software = is_software  # there the timer stops before the work is done
        self._query: moderngl.Query | None = None
        self._done: dict[str, tuple[tuple[Any, ...] | None, Any]] = {}
        self.counts: Counter[str] = Counter()
        self.laps: dict[str, Lap] = {}
        self.timed = False

    def run(self, name: str, inputs: tuple[Any, ...] | None, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """The result of work(*arguments), or that of its last run if nothing has changed since."""
        if name in self._done:
            before, result = self._done[name]
            if before is not None and inputs is not None and all(map(_same, before, inputs)):
                return result
        self.forget(name)
        result = self._time(name, work, arguments) if self.timed else work(*arguments)
        self.counts[name] += 1
        self._done[name] = _kept(inputs), result
        return result

    def forget(self, name: str) -> None:
        """The step and all that followed it will run again."""
        names = list(self._done)
        for later in names[names.index(name) :] if name in names else []:
            del self._done[later]

    def _time(self, name: str, work: Callable[..., _Result], arguments: tuple[Any, ...]) -> _Result:
        self._query = self._query or self._context.query(time=True)
        self._context.finish()
        start = time.perf_counter()
        with self._query:
            result = work(*arguments)
        self._context.finish()
        wall, gpu = (time.perf_counter() - start) * 1e3, self._query.elapsed / 1e6
        self.laps[name] = Lap(wall, None if self._is_software or not gpu else gpu)
        return result


def _same(before: Any, now: Any) -> bool:
    if isinstance(before, np.ndarray) or isinstance(now, np.ndarray):
        return isinstance(before, np.ndarray) and isinstance(now, np.ndarray) and np.array_equal(before, now)
    return before is now or before == now


def _kept(inputs: tuple[Any, ...] | None) -> tuple[Any, ...] | None:
    """Inputs as they are now: the caller may write into her arrays afterwards."""
    return inputs and tuple(item.copy() if isinstance(item, np.ndarray) else item for item in inputs)
