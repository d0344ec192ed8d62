"""Decides when memory that was freed goes back to the system: not between pictures, but after a release.

Only for glibc. POINTSHADE_MALLOC=default leaves its malloc as it is.
"""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache
from typing import Any

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # their numbers in malloc.h


def keep_freed_memory() -> None:
    """Ask glibc to keep up to 256 MB of freed memory for this process instead of returning it to the system.

    A software driver takes and frees about 60 MB for each picture of 300 000 points. Given back each time, that memory
    costs 15 000 page faults a picture, a quarter of the time; and the arrays of a frame and its picture, each mapped
    anew beyond 128 kB, another 1000, a tenth of it.
    """
    _call_malloc("mallopt", M_TRIM_THRESHOLD, 256 << 20)
    _call_malloc("mallopt", M_MMAP_THRESHOLD, 32 << 20)  # the most that it takes


def return_freed_memory() -> None:
    """Ask glibc to return all freed memory to the system."""
    _call_malloc("malloc_trim", 0)


def _call_malloc(name: str, *arguments: int) -> None:
    function = _of_glibc(name) if os.environ.get("POINTSHADE_MALLOC") != "default" else None
    if function is not None:
        function(*arguments)


@cache
def _of_glibc(name: str) -> Any:
    """Return one of its functions; None where there is none, as in musl and on other systems."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None
