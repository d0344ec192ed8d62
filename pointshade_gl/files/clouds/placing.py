"""Chooses the points that are kept, and where positions count from, so that float32 tells them apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import LARGEST
from ...notes.notes import Note
from ...notes.words import counted
from ...scene.cloud import STRAY
from .found_points import FoundPoints

_LOSS = 1e-3  # of the points' spacing may be lost by float32
_COARSE = 5e-4  # units that float32 may be off in any case: half a millimetre
_FAR = 2.0  # sizes of a cloud from zero: nearer, another origin gains nothing
_HALF_STEP = 2.0**-24  # of a number: what float32 rounds it by at most
_SAMPLE = 1 << 16  # points that the box is taken from
_NEIGHBOURS = 1500  # points that are compared with each other
_NEAREST = 0.47  # of sqrt(area / n) is the median way to the nearest of points that lie at random
_SEED = 31


def drop_invalid(found: FoundPoints, name: str, note: Note) -> None:
    """Leave out points that are nowhere: NaN, infinite or too far away."""
    at = found.positions
    if at.dtype.kind != "f" or not at.size or (np.abs((at.min(), at.max())) <= LARGEST).all():
        return
    good = np.asarray((np.abs(at) <= LARGEST).all(1))
    note(
        f"{name}: {counted(int(np.count_nonzero(~good)), 'point')} of {len(at)} lie nowhere (NaN or infinite): left out"
    )
    found.select(good)


def keep_most(found: FoundPoints, most: int | None, name: str, note: Note) -> None:
    """Keep an even sample, one point of each of so many equal parts of the file."""
    count = len(found)
    if most is None or count <= most:
        return
    edges = np.arange(most + 1) * count // most
    within = np.random.default_rng(_SEED).random(most) * np.diff(edges)
    found.select(edges[:-1] + within.astype(np.int64))
    note(f"{name}: {most} of its {counted(count, 'point')} are read, an even sample")


def placed(found: FoundPoints) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
    """Positions (n, 3), and the origin (3,) that they count from: zero, where float32 tells points apart from there.

    Else the origin is the middle, in whole units. Positions stay float64 only where float32 loses points even so.
    """
    at, origin = found.positions, _origin(found)
    if origin.any():
        at = at.astype(np.float64, copy=False) - origin  # never the other way round: float32 has lost them by then
    if at.dtype == np.float32:
        return at, origin
    return at.astype(np.float64 if len(at) and _is_lost(at) else np.float32, copy=False), origin


def _origin(found: FoundPoints) -> NDArray[np.float64]:
    if found.origin is not None:
        return found.origin
    if not len(found):
        return np.zeros(3)
    low, high = main_box(found.positions)
    farthest = max(np.abs(low).max(), np.abs(high).max())
    is_far, is_coarse = farthest > _FAR * (high - low).max(), farthest * _HALF_STEP > _COARSE
    return np.rint((low + high) / 2) if is_far and (is_coarse or _is_lost(found.positions)) else np.zeros(3)


def _is_lost(positions: NDArray[np.floating]) -> bool:
    """Whether float32 moves points by more than a small share of their spacing."""
    low, high = main_box(positions)
    farthest = max(np.abs(low).max(), np.abs(high).max())
    return bool(farthest * _HALF_STEP > _LOSS * (spacing_of(positions) or 1.0))


def main_box(positions: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner (3,) of the box of all points but stray ones."""
    some = positions[:: -(-len(positions) // _SAMPLE)].astype(np.float64)
    low, high = np.quantile(some, (STRAY, 1 - STRAY), axis=0)
    return low, high


def spacing_of(positions: NDArray[np.floating]) -> float:
    """About sqrt(area / n): how far a point of the surface is from the next; 0 for less than two different points."""
    if len(positions) < 2:
        return 0.0
    count = min(_NEIGHBOURS, len(positions))
    chosen = np.random.default_rng(_SEED).choice(len(positions), count, replace=False, shuffle=False)
    some = positions[chosen].astype(np.float64)
    squared = sum(np.square(one[:, None] - one) for one in some.T)
    nearest = np.sqrt(np.where(squared > 0, squared, np.inf).min(1))
    middle = float(np.median(nearest))
    return middle / _NEAREST * float(np.sqrt(count / len(positions))) if np.isfinite(middle) else 0.0
