"""NumPy on several cores: most of its loops let other threads run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

MOST = 8  # threads: more than that wait for memory
ROWS = 1 << 17  # of an array that a thread takes at a time
SORTERS = 4  # cores: with fewer, sorting twice is no gain

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_Scalar = TypeVar("_Scalar", bound=np.generic)


def by_threads(function: Callable[[_Item], _Result], items: Iterable[_Item]) -> list[_Result]:
    """Return what the function returns for each item, in order; several are done at a time."""
    work = list(items)
    count = min(MOST, os.cpu_count() or 1, len(work))
    if count > 1:
        try:
            with ThreadPoolExecutor(count) as pool:
                return list(pool.map(function, work))
        except RuntimeError:  # no more threads can be started: Python is about to end, or the system has a limit
            pass
    return [function(item) for item in work]


def parts_of(count: int) -> list[slice]:
    """Return slices of so many rows, ROWS in each."""
    return [slice(first, min(first + ROWS, count)) for first in range(0, count, ROWS)]


def taken_by_threads(values: NDArray[_Scalar], places: NDArray[np.integer]) -> NDArray[_Scalar]:
    """Return the rows of an array at these places."""
    taken = np.empty((len(places), *values.shape[1:]), values.dtype)

    def take(part: slice) -> None:
        np.take(values, places[part], 0, out=taken[part], mode="clip")  # in any other mode NumPy copies `out` first

    by_threads(take, parts_of(len(places)))
    return taken


def sorted_by_threads(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the values sorted, in new memory or in theirs: parts first, then what lies between the same bounds."""
    if (os.cpu_count() or 1) < SORTERS or len(values) < MOST * ROWS:
        values.sort()
        return values
    parts = np.array_split(values, MOST)
    by_threads(np.ndarray.sort, parts)
    some = np.sort(np.concatenate([part[:: len(part) // 64] for part in parts]))
    bounds = some[len(some) // MOST :: len(some) // MOST][: MOST - 1]
    cuts = np.array([[0, *np.searchsorted(part, bounds), len(part)] for part in parts])
    ends = np.cumsum(np.diff(cuts, axis=1).sum(0))
    result = np.empty_like(values)

    def merge(k: int) -> None:
        runs = [part[cut[k] : cut[k + 1]] for part, cut in zip(parts, cuts, strict=True)]
        merged = result[ends[k] - sum(map(len, runs)) : ends[k]]
        np.concatenate(runs, out=merged)
        merged.sort(kind="stable")  # which merges what is sorted

    by_threads(merge, range(len(ends)))
    return result
