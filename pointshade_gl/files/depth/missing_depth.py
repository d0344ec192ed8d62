"""Decides which raw depth values are distances, and in which unit, where nobody states it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...scene.frame import LEAST_SHARE, MOST_SHARE, far_plane
from ...scene.values import median

FAR = 65500  # from here on a 16-bit value means "missing": 65535 in ScanNet and 7-Scenes, 65504 the largest half
_NEARLY_FAR, _BEFORE_FAR = (
    65400,
    60000,
)  # between: markers that were moved with the points, if none lies before
_BLOCK = 2**18  # pixels of a block: its numbers fit into the processor's cache

Values = NDArray[np.float64]
_End = tuple[float, int, float]  # the largest or the smallest value, how many pixels have it, and the value next to it


def blocks(raw: NDArray[Any]) -> Iterator[slice]:
    step = max(1, _BLOCK // raw.shape[1])
    for start in range(0, raw.shape[0], step):
        yield slice(start, start + step)


def known_values(raw: NDArray[Any], kind: str, note: Note) -> Callable[[slice], Values]:
    """Return a function that gives the raw values of some rows, 0 where they mean "missing".

    So do values that are not finite and above 0, 16-bit markers from FAR on, what lies just below beside such markers
    and far from all else, and the one value of a background.
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
        is_apart = counts[FAR:].any() and not counts[_BEFORE_FAR:_NEARLY_FAR].any()
        is_moved = is_apart and counts[_NEARLY_FAR:FAR].sum() >= LEAST_SHARE * counts[1:].sum()
        first = _NEARLY_FAR if is_moved else FAR
        values[first:] = 0
        if counts[first:].any():
            note(f"{counts[first:].sum()} depth values from {first} to 65535 are taken as missing")
    present = np.flatnonzero((values > 0) & (counts > 0))
    present = present[np.argsort(values[present])]
    found, many = values[present].tolist(), counts[present].tolist()
    ends = [(found[-1], many[-1], found[-2]), (found[0], many[0], found[1])] if len(found) > 1 else []
    background = _find_background(sum(many), ends, note)
    if background is not None:
        values[values == background] = 0
    return values


def _ends_of_picture(positive: Callable[[slice], Values], raw: NDArray[Any]) -> tuple[int, list[_End]]:
    """How many pixels have a value, and both ends of their range; for a picture of too many values for a table."""
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


NEAREST, FARTHEST = 0.05, 200.0  # metres between which the middle of a depth picture lies
APART = 2.0  # times as far as the middle of all else: one value there may be a renderer's far plane
_TUM = 5000.0
_SAMPLE = 2**16  # pixels
_DISTINCT = 50  # values, or their common divisor means nothing
_KINECT_STEP = 1 / (8 * 0.075 * 580)  # of 1/z in 1/metres: an eighth of a pixel, 7.5 cm between the eyes, f = 580 px
_SPREAD = 0.12  # focal lengths of Kinects and their kin differ by so much
_STRAY = 100  # values below, centimetres in any unit, would ask for a lattice of any size
_LEVELS = 600  # a Kinect has no more between 0.5 m and 10 m
_KINECT_PIXELS = 640 * 480  # larger pictures are of stereo cameras, which measure evenly spaced 1/z, too
_ALIGNED, _APART = 0.9, 0.6  # 1 if all values lie on a lattice, 0 if none does


def some_values(raw: NDArray[Any]) -> NDArray[np.float64]:
    """(n,) the finite values of a sample of the picture."""
    step = max(1, int(np.sqrt(raw.size / _SAMPLE)))
    with np.errstate(invalid="ignore"):  # NaNs that signal
        values = raw[::step, ::step].astype(np.float64)
    return values[np.isfinite(values)]


def middle(raw: NDArray[Any]) -> float:
    """The median of the values above 0 before a far plane, of a sample of the picture; NaN if there are none."""
    values = some_values(raw)
    values = values[values > 0]
    near = values[values < FAR] if raw.dtype.kind == "f" or raw.dtype == np.uint16 else values  # the sky lies beyond
    far = far_plane(near, APART)
    near = near if far is None else near[near < far.depth]
    values = near if near.size else values
    return median(values) if values.size else float("nan")


def is_plausible(metres: float) -> bool:
    """Whether a picture of depth may have this median."""
    return NEAREST <= metres <= FARTHEST


def is_whole(raw: NDArray[Any]) -> bool:
    """Whether floating point values are whole numbers, of at least 50 different values."""
    values = some_values(raw)
    values = values[values > 0]
    return bool((values == np.rint(values)).all()) and np.unique(values).size >= _DISTINCT


def scale_of_file(filed: float, median: float) -> float | None:
    """Return raw values per metre, if a file gives the scale the other way round, else None. 0.001 is metres a value.
    From 0.01 to 2 it is millimetres a value, as in BOP: its 1.0 is 1000, its 0.1 is 10000."""
    scale = 1 / filed if filed < 0.01 else 1000 / filed
    return scale if filed <= 2 and not is_plausible(median / filed) and is_plausible(median / scale) else None


def scale_of_values(values: NDArray[np.int64], counts: NDArray[np.int64], median: float, pixels: int) -> float | None:
    """Return 5000, TUM's scale, if the different values (n,), rising, and their counts (n,) show it, else None.

    Millimetres times 5 are all multiples of 5. A first Kinect measures in eighths of a pixel, so 1/z is evenly spaced
    by 0.0029 per metre (Konolige & Mihelich 2010); the spacing of 1/raw then shows the scale.
    """
    if values.size < _DISTINCT or not is_plausible(median / _TUM) or median / _TUM < 0.2:
        return None
    if np.gcd.reduce(values) == 5:
        return _TUM
    if values.size > _LEVELS or median < _TUM / 2 or pixels > _KINECT_PIXELS:
        return None
    seen = values >= _STRAY
    inverse, weight = 1 / values[seen], counts[seen] / counts[seen].sum()
    spacing = _KINECT_STEP / _TUM
    if _lattice(inverse, weight, spacing) < _ALIGNED:
        return None
    # a lattice of 1000, five times as wide, is on this one, too
    coarser = max(_lattice(inverse, weight, factor * spacing) for factor in (2, 3, 5))
    return _TUM if coarser < _APART else None


def _lattice(inverse: NDArray[np.float64], weight: NDArray[np.float64], spacing: float) -> float:
    """How well numbers fit a lattice of nearly this spacing, from 0 to 1."""
    levels = float(np.ptp(inverse)) / spacing
    turns = np.linspace(1 - _SPREAD, 1 + _SPREAD, int(8 * _SPREAD * levels) + 8) / spacing
    return float(np.abs(np.exp(2j * np.pi * np.outer(turns, inverse)) @ weight).max())


def is_constant(depth: NDArray[np.float32]) -> bool:
    """Whether all that is known of (h, w) depth is equally far away."""
    some = depth[:: 1 + len(depth) // 16, :: 1 + depth.shape[1] // 16]
    if np.ptp(some):  # next to nothing to pay for any other
        return False
    known = depth[depth > 0]
    return known.size > 1 and not np.ptp(known)
