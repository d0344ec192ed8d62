"""Guesses the unit of depth, as raw values per metre, where none is given or the given one is impossible."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.frame import far_plane
from ...scene.values import median
from .missing_depth import FAR

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
    """Return raw values per metre, if a file gives the scale the other way round, else None.

    0.001 is metres a value. From 0.01 to 2 it is millimetres a value, as in BOP: its 1.0 is 1000, its 0.1 is 10000.
    """
    scale = 1 / filed if filed < 0.01 else 1000 / filed
    return scale if filed <= 2 and not is_plausible(median / filed) and is_plausible(median / scale) else None


def scale_of_values(values: NDArray[np.int64], counts: NDArray[np.int64], median: float, pixels: int) -> float | None:
    """Return 5000, if the values show it: TUM's scale. None if they do not.

    values  (n,) the different values, rising; counts  (n,) how many pixels have them; pixels  of the whole picture

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
