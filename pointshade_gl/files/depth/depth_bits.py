"""Decodes 16-bit depth that is no plain number: swapped or rotated bytes, packed confidence, Kinect disparity.

Each is known by what only it does to a picture. Neighbours in a depth picture are nearly equal, so the right reading is
the smooth one: a wrong one is rougher by tens or hundreds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .missing_depth import FAR
from .plane_curvature import measure_bending

Codes = NDArray[np.uint16]
Counts = NDArray[np.int64]  # how many pixels have each of the 65536 codes

_ROWS, _FEW_ROWS = 500, 60  # looked at to count values, and to see how smooth they are
_SMOOTHER = 8  # sensors: 80 to 500 for bytes, 37 for confidence
MILLIMETRES = np.uint16(8191)  # the low 13 bits of Android's DEPTH16
_STEP = 256  # millimetres: the mean step between neighbours is less in any picture of depth
_HALF_NEAREST, _HALF_INFINITE = 0x2E00, 0x7C00  # 0.09 m; 65504 is one less than infinite
_DISTINCT_HALVES = 50  # different values
KINECT_MISSING = 2047  # of 11 bits
KINECT_FIRST, KINECT_LAST = 300, 1090  # from 0.44 m to where distances become infinite


def as_codes(raw: NDArray[Any]) -> Codes | None:
    """The values as uint16, if they are integers that fit; None for others and for 8 bits."""
    if raw.dtype == np.uint16:
        return raw
    if raw.dtype.kind not in "iu" or raw.dtype.itemsize < 2 or raw.min() < 0 or raw.max() > 65535:
        return None
    return raw.astype(np.uint16)


def count_codes(raw: Codes) -> Counts:
    """How many pixels of some rows have each code."""
    return np.bincount(raw[:: max(1, raw.shape[0] // _ROWS)].ravel(), minlength=65536)


def is_swapped(raw: Codes) -> bool:
    """Return whether the low byte came first."""
    raw = _some_rows(raw)
    if not (raw & 255).any():
        return False  # 8 bits stored in the high byte: swapped they would be smoother and wrong
    return _roughness(raw) > _SMOOTHER * _roughness(raw.byteswap())


def has_confidence(raw: Codes) -> bool:
    """Whether it is Android's DEPTH16: millimetres in the low 13 bits, a code of confidence in the others.

    The code (0: 100 %, 1: 0 %, up to 7: 86 %) says little: a time-of-flight phone wrote 1 for 84 % of a good frame.
    """
    raw = _some_rows(raw)
    raw = np.where(raw < FAR, raw, 0)
    low = _roughness(raw & MILLIMETRES)
    return low < _STEP and _roughness(raw) > _SMOOTHER * low


def is_rotated(raw: Codes, counts: Counts) -> bool:
    """Whether it is SUN RGB-D's coding of millimetres d, (d << 3 | d >> 13): multiples of 8 up to 8191 mm.

    Multiples of 16 are something else, such as 8 or 12 bits moved to the left.
    """
    many = counts.reshape(-1, 8).sum(axis=0)
    known = many.sum() - counts[0]
    # up to 16 and 24 m the lowest bits are 1 and 2
    if 10 * (many[0] - counts[0]) < known or many[3:].sum() > 0.001 * known or not counts[8::16].any():
        return False
    if np.count_nonzero(counts[8::8]) < 50:
        return False
    raw = _some_rows(raw)
    return not many[1:].any() or 8 * _roughness(rotated_back(raw)) < _roughness(raw)


def rotated_back(raw: Codes) -> Codes:
    """Millimetres of SUN RGB-D's coding."""
    return np.bitwise_or(np.right_shift(raw, 3), np.left_shift(raw, 13))


def is_half(raw: Codes, counts: Counts) -> bool:
    """Whether the bits are those of 16-bit floats (CO3D, Mid-Air): as floats planes bend as depth, as integers not.

    As millimetres they would all lie between 11 and 32 m, the farthest at most twice as far as the nearest.
    """
    codes = np.flatnonzero(counts[: _HALF_INFINITE - 64])
    codes = codes[codes > 0]
    if codes.size < _DISTINCT_HALVES or codes[0] < _HALF_NEAREST or counts[_HALF_INFINITE + 1 :].any():
        return False
    known = (raw > 0) & (raw < _HALF_INFINITE - 64)
    as_float = measure_bending(np.where(known, raw, 0).view(np.float16).astype(np.float32), known)
    as_integer = measure_bending(raw, known)
    return as_float is not None and as_integer is not None and as_float.along < 4 and as_integer.is_surely(6, np.inf)


def is_kinect(counts: Counts) -> bool:
    """Whether it is the raw disparity of the first Kinect: 11 bits, 2047 for missing, nothing from 1090 to there."""
    missing = counts[KINECT_MISSING]
    known = counts[KINECT_FIRST:KINECT_LAST].sum()
    others = counts.sum() - missing - known - counts[0]
    return missing > 0.005 * counts.sum() and missing > counts[0] and known > 0 and others < 0.001 * known


def _some_rows(raw: Codes) -> Codes:
    return raw[:: max(1, raw.shape[0] // _FEW_ROWS)]


def _roughness(raw: Codes) -> float:
    """The mean step between horizontal neighbours that both have a depth."""
    values = raw.astype(np.int32)
    known = (values[:, 1:] > 0) & (values[:, :-1] > 0)
    steps = np.abs(np.diff(values, axis=1))[known]
    return float(steps.mean()) if steps.size else 0.0
