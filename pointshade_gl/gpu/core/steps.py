"""Runs the steps of the pipeline only when their inputs have changed; counts them, and times them on demand."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import cached_property
from operator import is_
from typing import Any, NamedTuple, TypeVar

import moderngl
import numpy as np

from ...checks.arguments import checkpoint, is_endable
from ..context.caller_state import finisher

_Result = TypeVar("_Result")


class Versioned:
    """Something on the GPU that one step writes and others read. Whoever writes it raises its `version`."""

    version = 0
    changes = 0  # of all of them

    def raise_version(self) -> None:
        self.version += 1
        Versioned.changes += 1


class Parts:
    """A dataclass with slots that never changes once it is made: steps compare it part by part."""

    __slots__ = ()

    def __iter__(self) -> Iterator[Any]:
        return (getattr(self, name) for name in self.__slots__)


class Timing(NamedTuple):
    """Milliseconds of one run: until the GPU had finished, and on the GPU's own timer (None where it has none)."""

    wall_ms: float
    gpu_ms: float | None


class Done(NamedTuple):
    """The last run of a step: its arguments, as they are compared, and what it returned.

    given    the arguments themselves, if nobody can write into them
    changes  `Versioned.changes` at that time
    """

    state: Any
    result: Any = None
    given: tuple[Any, ...] | None = None
    changes: int = -1

    @classmethod
    def of(cls, arguments: tuple[Any, ...], result: Any) -> Done:
        state = _state(arguments)
        kept = _kept(state)
        return cls(kept, result, arguments if kept is state else None, Versioned.changes)

    def is_surely_like(self, arguments: tuple[Any, ...]) -> bool:
        """Return whether these are the same objects, and nothing was written to since: that is seen at a glance."""
        given = self.given
        return given is not None and self.changes == Versioned.changes and all(map(is_, given, arguments))


class Steps:
    """Runs the steps, and remembers the arguments of each one's last run.

    A step runs again when its arguments have changed. Values and arrays are compared by value, frames and meshes by
    identity (they never change), images on the GPU by identity and version.

    counts  how often each step has run
    timed   True fills `laps`; the GPU then waits for each step, so the whole is slower
    laps    the last run of each step
    """

    def __init__(self, context: moderngl.Context, is_software: bool):
        self._context = context
        self._is_software = is_software  # there the timer stops before the work is done
        self._query: moderngl.Query | None = None
        self._is_timing = False
        self._done: dict[tuple[str, Any], Done] = {}
        self.counts: Counter[str] = Counter()
        self.laps: dict[str, Timing] = {}
        self.timed = False

    def run(self, name: str, work: Callable[..., _Result], *arguments: Any, of: Any = None) -> _Result:
        """Return work(*arguments), or the result of its last run if no argument has changed since.

        of  what the step is run on, when there are several: each has its own last run
        """
        before = self._done.get((name, of))
        if before is not None and before.is_surely_like(arguments):
            return before.result
        self._done.pop((name, of), None)  # gone if the work fails
        if before is None or not _same(before.state, _state(arguments)):
            result = self.always(name, work, *arguments)
            before = Done.of(arguments, result)  # afterwards: what the step itself wrote has not changed
        elif before.given is not None and all(map(is_, before.given, arguments)):
            before = before._replace(changes=Versioned.changes)
        self._done[name, of] = before
        return before.result

    def is_new(self, name: str, *arguments: Any, of: Any = None) -> bool:
        """Return whether a step would run with these arguments, and count it as done. For parts of a step's work."""
        before, now = self._done.pop((name, of), None), _state(arguments)
        self._done[name, of] = Done(_kept(now))
        return before is None or not _same(before.state, now)

    def always(self, name: str, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Return work(*arguments), counted and timed, for a step that has nothing to compare."""
        result = self._time(name, work, arguments) if self.timed else work(*arguments)
        self.counts[name] += 1
        if is_endable():  # so that what reads the result keeps no other thread waiting
            self.finish()
            checkpoint()
        return result

    @cached_property
    def _wait(self) -> Callable[[], None]:
        return finisher(self._context)

    def finish(self) -> None:
        """Wait until the GPU has finished. Other threads go on."""
        self._wait()

    def forget(self, name: str | None = None, of: Any = None) -> None:
        """Make the step of that name, or every one, run again.

        of  only those on this object, or that have read it; or on one of several, in a list
        """
        things = None if of is None else set(map(id, of if isinstance(of, list) else [of]))
        for key, done in list(self._done.items()):
            if name in (None, key[0]) and (things is None or _mentions((key[1], done.state), things)):
                del self._done[key]

    def _time(self, name: str, work: Callable[..., _Result], arguments: tuple[Any, ...]) -> _Result:
        """Run a step and time it; of a step inside another one only the wall time, as the GPU's timer is running."""
        query = None if self._is_timing else self._query or self._context.query(time=True)
        self.finish()
        start = time.perf_counter()
        with query or nullcontext():
            before, self._is_timing = self._is_timing, True
            try:
                result = work(*arguments)
            finally:
                self._is_timing = before
        self.finish()
        wall, gpu = (time.perf_counter() - start) * 1e3, query.elapsed / 1e6 if query else 0
        self.laps[name] = Timing(wall, None if self._is_software or not gpu else gpu)
        self._query = query or self._query
        return result


def _state(value: Any) -> Any:
    """Return a value in the form in which it is compared: what has parts part by part, images with their version."""
    if isinstance(value, tuple | list | Parts):
        return tuple(map(_state, value))
    return (value, value.version) if isinstance(value, Versioned) else value


def _mentions(state: Any, things: set[int]) -> bool:
    """Return whether one of these objects, by their ids, is among the arguments of a step or in tuples of them."""
    return id(state) in things or (isinstance(state, tuple) and any(_mentions(part, things) for part in state))


def _same(before: Any, now: Any) -> bool:
    if before is now:
        return True
    if isinstance(before, tuple) and isinstance(now, tuple):
        return len(before) == len(now) and all(map(_same, before, now))
    if isinstance(before, np.ndarray) or isinstance(now, np.ndarray):
        return isinstance(before, np.ndarray) and isinstance(now, np.ndarray) and np.array_equal(before, now)
    return bool(before == now)


def _kept(state: Any) -> Any:
    """Return the state with copies of its arrays, unless nobody can write into them afterwards."""
    if isinstance(state, tuple):
        kept = tuple(map(_kept, state))
        return state if all(map(is_, kept, state)) else kept
    is_open = isinstance(state, np.ndarray) and (state.flags.writeable or state.base is not None)
    return state.copy() if is_open else state
