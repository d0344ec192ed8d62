"""NumPy on several cores: most of its loops let other threads run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

MOST = 8  # threads: more than that wait for memory
ROWS = 1 << 17  # of an array that a thread takes at a time

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


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
