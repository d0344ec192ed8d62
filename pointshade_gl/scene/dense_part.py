"""Separates the dense part of a cloud from stray points: few, and far from all others."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.floating[Any]]  # (n, 3)
SAMPLE = 1 << 16  # points that bounds are taken from
LOOKED_AT = 1 << 14  # of these, that strays are looked for in
MOST = 0.06  # share of the points that may be strays
WIDER = 1.25  # times as wide as all but that share on each side: less far out, strays change no picture
STABLE = 0.6  # of the strays are still such in the next larger cells
STRAY = 0.001  # share of the points on each side of an axis that bounds leave out
SHRINKS = 1.1  # on some axis, at least, without strays
SIDE, GROWTH, TRIES = 0.03, 1.3, 14  # of a cell: shares of the size, tried until most points have others near them
FULL = 6  # points of the cell of the median point
CORE = 3  # points of a cell that is no chance
LEAST = 8  # points that lie together
ALONE = 0.03  # of its way from the middle: no other point is nearer to a stray one
GAP = 0.75  # sizes of what is together, to what belongs to it
_AROUND = np.array([*product((-1, 0, 1), repeat=3)])


class DensePart(NamedTuple):
    """Cells of a grid in which the dense part of a cloud lies.

    low    (3,) corner of the grid
    side   of its cells
    cells  (n,) their numbers, sorted
    """

    low: NDArray[np.float64]
    side: float
    cells: NDArray[np.int64]

    def holds(self, positions: Points) -> NDArray[np.bool_]:
        """Return which points (n, 3) lie in it."""
        numbers = _numbers(_places(positions, self.low, self.side))
        at = np.searchsorted(self.cells, numbers)
        return np.append(self.cells, -1)[at] == numbers


def sample_of(positions: Points) -> Points:
    """Return up to SAMPLE of the points, evenly spread over their order."""
    return positions[:: -(-len(positions) // SAMPLE) or 1]


def main_points(positions: Points) -> Points:
    """Return a sample of the points without stray ones."""
    some = sample_of(positions)
    part = dense_part(some, STRAY)
    return some if part is None else some[part.holds(some)]


def dense_part(positions: Points, share: float = 0.0) -> DensePart | None:
    """Return where nearly all points lie together; None if no point, or too many, lie elsewhere.

    share: of the points on each side of an axis that may lie anywhere in any case
    """
    if len(positions) < LEAST:
        return None
    some = positions[:: -(-len(positions) // LOOKED_AT)]
    ends = share, MOST, 1 - MOST, 1 - share
    low, inner_low, inner_high, high = np.quantile(some, ends, axis=0).astype(np.float64)
    middle, size = (inner_low + inner_high) / 2, float(np.linalg.norm(inner_high - inner_low))
    if size == 0 or (high - low <= WIDER * (inner_high - inner_low)).all():
        return None
    last, lost = None, 1.0
    for k in range(TRIES):
        parts = _parts_in_cells(some, middle, SIDE * size * GROWTH**k)
        if parts is None:
            continue
        before, lost = lost, float(np.count_nonzero(~parts[0].holds(some)) / len(some))
        if last is not None and lost > STABLE * before:  # the edge of a shape that fades comes nearer each time
            found = _with_fringe(*last, sample_of(positions))
            return found if found and _shrinks(some[found.holds(some)], high - low, share) else None
        last = parts if lost <= MOST else None
    return None


def _with_fringe(part: DensePart, clumps: DensePart, some: Points) -> DensePart | None:
    """Return the dense part with what lies beside it in lines, as far points of a scan do: each near the next.

    None if more lies outside than chance explains: the order of the points is no random one.
    """
    is_held = part.holds(some)
    if np.count_nonzero(~is_held) > 2 * MOST * len(some):
        return None
    held, rest = some[is_held], some[~is_held]
    gap = _gap(rest, rest, held.min(0), held.max(0))
    rest = rest[~clumps.holds(rest) & (gap <= GAP)]
    rest = (rest - part.low).astype(np.float32)
    squares = sum(((axis[:, None] - axis) ** 2 for axis in rest.T), np.zeros((len(rest), len(rest)), np.float32))
    np.fill_diagonal(squares, np.inf)
    is_near = squares.min(1, initial=np.inf) < ALONE**2 * np.einsum("nk,nk->n", rest, rest)
    cells = _numbers(_places(rest[is_near], np.zeros(3), part.side))
    return part._replace(cells=np.union1d(part.cells, cells))


def _shrinks(kept: Points, sides: NDArray[np.float64], share: float) -> bool:
    low, high = np.quantile(kept, (share, 1 - share), axis=0)
    return bool((sides > SHRINKS * (high - low)).any())


def _parts_in_cells(some: Points, middle: NDArray[np.float64], side: float) -> tuple[DensePart, DensePart] | None:
    """Return where points lie together, and clumps far from there; None if cells of this side are too small."""
    places = _places(some, middle, side)
    numbers, index, of, counts = np.unique(_numbers(places), return_index=True, return_inverse=True, return_counts=True)
    if np.median(counts[of]) < FULL:
        return None
    is_core = counts >= CORE
    places, numbers, counts = places[index[is_core]], numbers[is_core], counts[is_core]
    groups = _groups(places, numbers)
    sizes = np.bincount(groups, counts)
    kept = _together(places, groups, sizes, len(some))
    dense, clumps = (_round(places[which[groups]], middle, side) for which in (kept, ~kept & (sizes >= LEAST)))
    return dense, clumps


def _round(places: NDArray[np.int64], middle: NDArray[np.float64], side: float) -> DensePart:
    """Return these cells, and those beside them."""
    return DensePart(middle, side, np.unique(_numbers((places[:, None] + _AROUND).reshape(-1, 3))))


def _groups(places: NDArray[np.int64], numbers: NDArray[np.int64]) -> NDArray[np.integer]:
    """Return for each cell the number of the group of neighbours to which it belongs."""
    near = _numbers((places[:, None] + _AROUND).reshape(-1, 3))
    at = np.minimum(np.searchsorted(numbers, near), len(numbers) - 1)
    pairs = np.flatnonzero(numbers[at] == near)
    one, other = pairs // len(_AROUND), at[pairs]
    group = np.arange(len(numbers))
    while True:
        least = group.copy()
        np.minimum.at(least, one, group[other])
        least = least[least]
        if (least == group).all():
            return np.unique(group, return_inverse=True)[1]
        group = least


def _together(
    places: NDArray[np.int64], groups: NDArray[np.integer], sizes: NDArray[Any], total: int
) -> NDArray[np.bool_]:
    """Return which groups belong to the dense part: large ones, and what lies not far from these."""
    low, high = np.full((len(sizes), 3), np.inf), np.full((len(sizes), 3), -np.inf)
    np.minimum.at(low, groups, places)
    np.maximum.at(high, groups, places + 1)
    kept = sizes > MOST * total
    kept[np.argmax(sizes)] = True
    while True:
        gap = _gap(low, high, low[kept].min(0), high[kept].max(0))
        more = kept | ((gap <= GAP) & (sizes >= LEAST))
        if (more == kept).all():
            return kept
        kept = more


def _gap(low: Points, high: Points, first: NDArray[Any], last: NDArray[Any]) -> NDArray[np.floating[Any]]:
    """Return how far boxes lie from one, in its sizes."""
    apart = np.maximum(0, np.maximum(first - high, low - last))
    return np.linalg.norm(apart, axis=1) / np.linalg.norm(last - first)


_REACH = 1 << 20  # cells from the middle: farther ones are one


def _places(positions: Points, low: NDArray[np.float64], side: float) -> NDArray[np.int64]:
    """Return in which cell each point lies, (n, 3)."""
    return np.floor(((positions - low) / side).clip(-_REACH, _REACH - 1)).astype(np.int64)


def _numbers(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return one number for each cell."""
    return (places + (_REACH + 1)) @ np.array([1 << 42, 1 << 21, 1], np.int64)
