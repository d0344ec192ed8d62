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

    The rule: a step runs when its inputs are not those of its last run, or when it has none to compare. What another
    step made is an input by its `stamp`. Frames and meshes are compared by identity (they never change), values and
    arrays by value. `of` tells apart what the step is run on, when a scene has several.

    counts  how often each step has run
    timed   set it to True to have `laps` filled; the GPU then waits for each step, so the whole is slower
    laps    the last run of each step
    """

    def __init__(self, context: moderngl.Context, is_software: bool):
        self._context = context
        self._is_software = is_software  # there the timer stops before the work is done
        self._query: moderngl.Query | None = None
        self._done: dict[tuple[str, int], tuple[tuple[Any, ...] | None, Any]] = {}
        self._stamps: Counter[tuple[str, int]] = Counter()
        self.counts: Counter[str] = Counter()
        self.laps: dict[str, Lap] = {}
        self.timed = False

    def run(
        self, name: str, inputs: tuple[Any, ...] | None, work: Callable[..., _Result], *arguments: Any, of: Any = None
    ) -> _Result:
        """The result of work(*arguments), or that of its last run if nothing has changed since."""
        key = name, id(of)
        if key in self._done:
            before, result = self._done.pop(key)  # gone if the work fails
            if before is not None and inputs is not None and _same(before, inputs):
                self._done[key] = before, result
                return result
        result = self._time(name, work, arguments) if self.timed else work(*arguments)
        self.counts[name] += 1
        self._stamps[key] += 1
        self._done[key] = _kept(inputs), result
        return result

    def stamp(self, name: str, of: Any = None) -> int:
        """Another number each time that the step has run."""
        return self._stamps[name, id(of)]

    def forget(self, name: str | None = None, of: Any = None) -> None:
        """The step of that name, or every step on `of`, or every step, will run again."""
        for key in list(self._done):
            if (name is None or key[0] == name) and (of is None or key[1] == id(of)):
                del self._done[key]

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
    if isinstance(before, tuple) and isinstance(now, tuple):
        return len(before) == len(now) and all(map(_same, before, now))
    if isinstance(before, np.ndarray) or isinstance(now, np.ndarray):
        return isinstance(before, np.ndarray) and isinstance(now, np.ndarray) and np.array_equal(before, now)
    return before is now or bool(before == now)


def _kept(inputs: Any) -> Any:
    """Inputs as they are now: the caller may write into her arrays afterwards."""
    if isinstance(inputs, tuple):
        return tuple(map(_kept, inputs))
    return inputs.copy() if isinstance(inputs, np.ndarray) else inputs
