"""Decides whether a depth image is sparse: single known pixels far apart, such as projected LiDAR points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LINES = 16  # rows and columns that are looked at first: next to nothing to pay where depth is dense
GOLDEN = 0.6180339887  # places them in no rhythm, as scan lines have one
ALONE = 0.6  # share of the known pixels whose next one is missing; half of the pixels at random leave 0.5
KNOWN = 0.45  # share that may be known between the first and the last of a line
ENOUGH = 100  # known pixels that prove anything


def is_sparse(depth: NDArray[np.float32]) -> bool:
    """Return whether known pixels (h, w; 0 is missing) stand alone along rows or along columns, with others further on.

    Holes of up to half of the pixels do not make a picture sparse, nor does an empty background behind objects.
    """
    return any(_stand_alone(z[_places(len(z))] > 0) and _are_sparse(z > 0) for z in (depth, depth.T))


def _places(count: int) -> NDArray[np.intp]:
    return ((np.arange(1, LINES + 1) * GOLDEN) % 1 * count).astype(np.intp)


def _stand_alone(known: NDArray[np.bool_]) -> bool:
    """Return whether most pixels of some lines (n, length) are not followed by another."""
    followed = np.count_nonzero(known[:, :-1] & known[:, 1:])
    return bool(followed < (1 - ALONE) * np.count_nonzero(known))


def _are_sparse(known: NDArray[np.bool_]) -> bool:
    line, place = np.nonzero(known)
    gaps = np.diff(place)[np.diff(line) == 0]
    return bool(gaps.size > ENOUGH and (gaps > 1).mean() > ALONE and gaps.size < KNOWN * gaps.sum())
