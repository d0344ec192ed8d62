"""Finds what a sensor with two eyes, or an eye and a projector, cannot see beside near objects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STEP = 0.08  # share of 1/z by which both sides of a shadow differ, at least
NARROW = 3  # pixels, at least
WIDTHS = 0.1  # of logarithms that count as one
BELIEVED = 0.12  # share of all runs that agree, at least
FEWEST = 20  # runs
NEAREST, FARTHEST = 0.03, 0.12  # metres between the eyes of depth cameras
BESIDE = 1.5  # pixels by which shadows may be wider

Shift = float  # pixels times metres: the disparity at a depth of 1 m


def find_shifts(depth: NDArray[np.float32], focal: float) -> tuple[Shift, Shift]:
    """Return the disparity at 1 m of a sensor whose shadows lie left of near objects, and right of them; 0.0 for none.

    depth: (h, w) metres, 0 where it is missing; focal: pixels
    """
    missing = depth == 0
    rows, columns = np.divmod(np.flatnonzero(missing[:, 1:] != missing[:, :-1]), depth.shape[1] - 1)
    is_run = (rows[1:] == rows[:-1]) & missing[rows[:-1], columns[:-1] + 1]  # from one change of a row to the next
    rows, starts, ends = rows[:-1][is_run], columns[:-1][is_run] + 1, columns[1:][is_run] + 1
    left, right = (1 / depth[rows, beside].astype(np.float64) for beside in (starts - 1, ends))
    width, rise = ends - starts, right - left
    wide = (np.abs(rise) > STEP * np.maximum(left, right)) & (width >= NARROW)
    left_of, right_of = wide & (rise > 0), wide & (rise < 0)
    return _agreed(width[left_of] / rise[left_of], focal), _agreed(-width[right_of] / rise[right_of], focal)


def _agreed(shifts: NDArray[np.float64], focal: float) -> Shift:
    """Return the shift on which enough of them agree."""
    if len(shifts) < FEWEST:
        return 0.0
    logs = np.log(shifts)
    low = logs.min() - 1.5 * WIDTHS
    counts = np.histogram(logs, np.arange(low, logs.max() + 2.5 * WIDTHS, WIDTHS))[0]
    near = np.convolve(counts, (1, 1, 1), "same")
    is_near = np.abs(logs - low - (near.argmax() + 0.5) * WIDTHS) < 1.5 * WIDTHS
    shift = float(np.exp(np.median(logs[is_near])))
    is_believed = near.max() >= BELIEVED * len(shifts) and NEAREST <= shift / focal <= FARTHEST
    return shift if is_believed else 0.0


def hidden_below(depth: NDArray[np.float32], shifts: tuple[Shift, Shift]) -> NDArray[np.float32]:
    """Return (h, w): the 1/z from which on the sensor would have seen a surface; 0 where it may be any."""
    found = np.zeros(depth.shape, np.float32)
    for shift, side in zip(shifts, (np.s_[:], np.s_[::-1]), strict=True):
        if shift:
            np.maximum(found, _hidden_below(depth[:, side], shift)[:, side], out=found)  # either eye may miss it
    return found


def _hidden_below(depth: NDArray[np.float32], shift: Shift) -> NDArray[np.float32]:
    """The same for shadows left of near objects only."""
    columns = np.arange(depth.shape[1], dtype=np.float32)
    reached = np.full_like(depth, np.inf)
    with np.errstate(over="ignore"):
        np.divide(-shift, depth, out=reached, where=depth > 0)
    reached += columns
    backwards = reached[:, ::-1]
    np.minimum.accumulate(backwards, axis=1, out=backwards)  # the leftmost of all from a pixel on to the right
    limit = np.zeros_like(depth)
    np.subtract(columns[:-1] + BESIDE, reached[:, 1:], out=limit[:, :-1])
    limit *= 1 / shift
    return np.maximum(limit, 0, out=limit)
