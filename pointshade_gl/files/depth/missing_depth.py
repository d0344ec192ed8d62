"""Decides which raw depth values are distances, and which mean "missing": holes, sensor markers, renderer backgrounds.

In arrays, `Frame` decides. Pictures may have 100 million pixels, so they are read in blocks of rows. 8 and 16 bits have
few values: each is judged once, in a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...scene.frame import LEAST_SHARE, MOST_SHARE

FAR = 65500  # from here on a 16-bit value says "missing": 65535 in ScanNet and 7-Scenes, 65504 the largest half
_BLOCK = 2**18  # pixels of a block: its numbers fit into the processor's cache

Values = NDArray[np.float64]
_End = tuple[float, int, float]  # the largest or the smallest value, how many pixels have it, and the value next to it


def blocks(raw: NDArray[Any]) -> Iterator[slice]:
    """All rows of a picture, some at a time."""
    step = max(1, _BLOCK // raw.shape[1])
    for start in range(0, raw.shape[0], step):
        yield slice(start, start + step)


def known_values(raw: NDArray[Any], kind: str, note: Note) -> Callable[[slice], Values]:
    """Return a function that gives the raw values of some rows, 0 where they mean "missing".

    Missing are values that are not finite and above 0, 16-bit markers from FAR on, and the one value of a background.
    """
    if raw.dtype.kind in "iu" and raw.dtype.itemsize <= 2:
        codes = raw.view(f"u{raw.dtype.itemsize}")
        table = _judge(codes, raw.dtype, kind, note)
        return lambda rows: table[codes[rows]]

    def positive(rows: slice) -> Values:
        values = raw[rows].astype(np.float64)
        values[~((values > 0) & (values < np.inf))] = 0
        return values

    background = _find_background(*_ends_of_picture(positive, raw), note)
    if background is None:
        return positive

    def before_background(rows: slice) -> Values:
        values = positive(rows)
        values[values == background] = 0
        return values

    return before_background


def _judge(codes: NDArray[Any], dtype: np.dtype, kind: str, note: Note) -> Values:
    """Return, for each code of 8 or 16 bits, its value in the given type, 0 if it means "missing"."""
    count = 256**dtype.itemsize
    values = np.arange(count).astype(codes.dtype).view(dtype).astype(np.float64)
    counts = np.zeros(count, np.int64)
    for rows in blocks(codes):
        counts += np.bincount(codes[rows].ravel(), minlength=count)
    values[values < 0] = 0
    # in inverse depth and disparity the largest values are the nearest points, not markers
    if dtype.kind == "u" and dtype.itemsize == 2 and kind not in ("inverse", "disparity"):
        marked = values >= FAR
        values[marked] = 0
        if counts[marked].any():
            note(f"{counts[marked].sum()} depth values from {FAR} to 65535 are taken as missing")
    background = _find_background(*_ends_of_table(values, counts), note)
    if background is not None:
        values[values == background] = 0
    return values


def _ends_of_table(values: Values, counts: NDArray[np.int64]) -> tuple[int, list[_End]]:
    """How many pixels have a value, and both ends of their range."""
    present = np.flatnonzero((values > 0) & (counts > 0))
    present = present[np.argsort(values[present])]
    found, many = values[present].tolist(), counts[present].tolist()
    ends = [(found[-1], many[-1], found[-2]), (found[0], many[0], found[1])] if len(found) > 1 else []
    return sum(many), ends


def _ends_of_picture(positive: Callable[[slice], Values], raw: NDArray[Any]) -> tuple[int, list[_End]]:
    """The same for a picture of too many values for a table."""
    size, low, high = 0, np.inf, 0.0
    for rows in blocks(raw):
        values = positive(rows)
        size += int(np.count_nonzero(values))
        high = max(high, values.max())
        low = min(low, np.where(values > 0, values, np.inf).min())
    lows, highs, above, below = 0, 0, high, low
    for rows in blocks(raw):
        values = positive(rows)
        is_low, is_high = values == low, values == high
        lows, highs = lows + int(np.count_nonzero(is_low)), highs + int(np.count_nonzero(is_high))
        above = min(above, np.where((values > 0) & ~is_low, values, np.inf).min())
        below = max(below, np.where(is_high, 0, values).max())
    return size, [(high, highs, below), (low, lows, above)]


def _find_background(size: int, ends: Sequence[_End], note: Note) -> float | None:
    """The value that a renderer wrote where it saw nothing: an extreme one in many pixels, far from all others."""
    for value, count, neighbour in ends:
        share = count / max(size, 1)
        if LEAST_SHARE <= share < MOST_SHARE and (value > 2 * neighbour or 2 * value < neighbour):
            note(f"the depth value {value:g} of {share:.0%} of the pixels is taken as background, that is, missing")
            return value
    return None
