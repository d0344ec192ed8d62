"""Runs the steps of the pipeline only when their inputs have changed; counts them, and times them on demand."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import moderngl
import numpy as np

from ...checks.arguments import checkpoint, is_endable
from ..context.caller_state import finisher

_Result = TypeVar("_Result")


class Versioned:
    """Something on the GPU that one step writes and others read. Whoever writes it raises its `version`."""

    version = 0

    def raise_version(self) -> None:
        self.version += 1


class Parts:
    """A dataclass with slots that never changes once it is made: steps compare it part by part."""

    __slots__ = ()

    def __iter__(self) -> Iterator[Any]:
        return (getattr(self, name) for name in self.__slots__)


class Timing(NamedTuple):
    """Milliseconds of one run: until the GPU had finished, and on the GPU's own timer (None where it has none)."""

    wall_ms: float
    gpu_ms: float | None


class Steps:
    """Runs the steps, and remembers the arguments of each one's last run.

    A step runs again when its arguments have changed. Values and arrays are compared by value, frames and meshes by
    identity (they never change), images on the GPU by identity and version.

    counts  how often each step has run
    timed   True fills `laps`; the GPU then waits for each step, so the whole is slower
    laps    the last run of each step
    forgotten  how often some were to run again
    waits   True waits for the GPU before a picture is read: other threads go on, which reading would stop
    """

    def __init__(self, context: moderngl.Context, is_software: bool):
        self._context = context
        self._is_software = is_software  # there the timer stops before the work is done
        self._query: moderngl.Query | None = None
        self._is_timing = False
        self._done: dict[tuple[str, Any], tuple[list[Any], Any]] = {}  # what it was given, and what it returned
        self.counts: Counter[str] = Counter()
        self.laps: dict[str, Timing] = {}
        self.timed = self.waits = False
        self.forgotten = 0

    def run(self, name: str, work: Callable[..., _Result], *arguments: Any, of: Any = None) -> _Result:
        """Return work(*arguments), or the result of its last run if no argument has changed since.

        of  what the step is run on, when there are several: each has its own last run
        """
        key = name, of
        before = self._done.get(key)
        if before is None or not _alike(before[0], fingerprint(arguments)):
            self._done.pop(key, None)  # gone if the work fails
            result = self.always(name, work, *arguments)
            # afterwards: what the step itself wrote has not changed
            self._done[key] = before = fingerprint(arguments), result
        return before[1]

    def is_new(self, name: str, *arguments: Any, of: Any = None) -> bool:
        """Return whether a step would run with these arguments, and count it as done. For parts of a step's work."""
        before, now = self._done.pop((name, of), None), fingerprint(arguments)
        self._done[name, of] = now, None
        return before is None or not _alike(before[0], now)

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
        self.forgotten += 1
        things = None if of is None else set(map(id, of if isinstance(of, list) else [of]))
        for key, (given, _) in list(self._done.items()):
            if name in (None, key[0]) and (things is None or any(id(one) in things for one in (key[1], *given))):
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


def fingerprint(arguments: tuple[Any, ...]) -> list[Any]:
    """Return all parts of arguments, those of tuples and the like after the others, and images with their versions.

    Arrays that somebody may still write into are copied. This runs often, so it calls next to nothing.
    """
    found: list[Any] = []
    parts = [*arguments]
    for value in parts:  # which grows on the way
        kind = type(value)
        if kind not in _KINDS:
            _KINDS[kind] = next(
                (one for one in (tuple, list, Parts, Versioned, np.ndarray) if issubclass(kind, one)), kind
            )
        kind = _KINDS[kind]
        if kind is Versioned:
            found += value, value.version
        elif kind is np.ndarray:
            is_open = value.flags.writeable or value.base is not None
            found += (value.copy() if is_open else value,)
        elif kind is tuple or kind is list or kind is Parts:
            found += (kind,)
            parts += value
        else:
            found += (value,)
    return found


_KINDS: dict[type, type] = {}  # of which kind a class is


def _alike(before: list[Any], now: list[Any]) -> bool:
    """Return whether two fingerprints are the same: numbers and arrays by value, frames and meshes by identity."""
    if len(before) != len(now):
        return False
    for one, other in zip(before, now, strict=True):
        if one is other:
            continue
        is_array = _KINDS.get(type(one)) is np.ndarray
        if is_array is not (_KINDS.get(type(other)) is np.ndarray):
            return False
        if is_array:
            if one.shape != other.shape or one.dtype != other.dtype or one.tobytes() != other.tobytes():
                return False
        elif one != other:
            return False
    return True
