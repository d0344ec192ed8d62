"""Judges the poses of several frames by how well they agree, in depth and in brightness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .frame_matches import Matches

LEAST_SPREAD = 1e-6  # of depths that agree, a share of the depth
NARROWEST, WIDEST = 0.004, 0.03  # of the band in which two frames agree, a share of the depth
SPREADS = 3.0  # that the band holds
LEAST_AGREEMENT = 0.75  # of what a frame shares with others must agree, or its pose is not known
USUAL_AGREEMENT = 0.93  # of the set's median: with less a frame is placed again
USUAL_LIGHT = 0.7  # the same of the brightness
LEAST_LIGHT = 1e-4  # spread of brightness that agrees
ALIKE, UNLIKE = 0.02, 0.1  # brightness that differs by less is the same, by more another
Matrix = NDArray[np.float64]


class Judgement(NamedTuple):
    """How well frames agree, one value for each."""

    agreement: Matrix  # share of what is shared with others that lies within the band
    grouped: NDArray[np.bool_]  # whether it hangs together with the anchor by pairs that fit
    alike: Matrix  # share of what is shared whose brightness is that of the others; NaN without colours
    overlap: Matrix  # share of its points that the other frame with most of them should show
    each: Matrix  # spread of the depths' differences; NaN without overlap
    spreads: tuple[float, float]  # of depth and brightness where frames agree

    def doubtful(self) -> NDArray[np.bool_]:
        """Return which frames agree too little, by themselves or beside the others."""
        usual, alike = float(np.median(self.agreement)), np.nan_to_num(self.alike, nan=1.0)
        return (
            (self.agreement < max(LEAST_AGREEMENT, USUAL_AGREEMENT * usual))
            | ~self.grouped
            | (alike < USUAL_LIGHT * float(np.median(alike)))
        ) & (self.overlap > 0)


def judge(
    found: Sequence[tuple[int, int, Matches]], points: Sequence[int], anchor: int, spreads: tuple[float, float] | None
) -> Judgement:
    """Return how well frames agree.

    found    matches of frame i in frame j, each i, j, matches
    points   of each frame that were looked for in the others
    anchor   number of the frame whose pose is right
    spreads  of depth and brightness where frames agree; None measures them: the depth's over all pairs, the
             brightness' in that pair of each frame which agrees best, for a pattern may match where it repeats itself
    """
    count = len(points)
    seen, agree, colored, alike = np.zeros((4, count, count))  # of pairs, both ways together
    depth = spread_of([one.apart for *_, one in found], LEAST_SPREAD) if spreads is None else spreads[0]
    band = min(max(SPREADS * depth, NARROWEST), WIDEST)
    overlap = np.zeros(count)
    apart: list[list[NDArray[np.floating]]] = [[] for _ in range(count)]
    for i, j, one in found:
        _add(seen, i, j, one.seen)
        _add(agree, i, j, np.count_nonzero(np.abs(one.apart) < band))
        apart[i].append(one.apart)
        apart[j].append(one.apart)
        overlap[i] = max(overlap[i], one.seen / points[i])
    shares = agree / np.maximum(seen, 1)
    if spreads is None:
        best = set(enumerate(np.argmax(shares, 1).tolist()))
        nearest = [one.brighter for i, j, one in found if (i, j) in best or (j, i) in best]
        spreads = depth, spread_of(nearest, LEAST_LIGHT)
    light = min(max(SPREADS * spreads[1], ALIKE), UNLIKE)
    for i, j, one in found:
        _add(colored, i, j, np.count_nonzero(np.isfinite(one.brighter)))
        _add(alike, i, j, np.count_nonzero(np.abs(one.brighter) < light))
    fits = shares >= LEAST_AGREEMENT
    with np.errstate(invalid="ignore"):
        same, own = np.where(fits, alike / colored, np.nan), alike.sum(0) / colored.sum(0)
    if np.isfinite(same).any():
        fits &= ~(same < USUAL_LIGHT * np.nanmax(same))
    agreement = agree.sum(0) / np.maximum(seen.sum(0), 1)
    each = np.array([spread_of(one, 0.0) if one else np.nan for one in apart])
    return Judgement(agreement, _group(fits, anchor), own, overlap, each, spreads)


def _add(sums: Matrix, i: int, j: int, value: int | np.integer) -> None:
    sums[i, j] += value
    sums[j, i] += value


def _group(fits: NDArray[np.bool_], anchor: int) -> NDArray[np.bool_]:
    """Return which of n things hang together with one of them. fits: (n, n) which two belong together."""
    groups = np.eye(len(fits), dtype=bool) | fits
    for _ in range(len(fits).bit_length()):
        groups = groups @ groups
    return groups[anchor]


def spread_of(values: Sequence[NDArray[np.floating]], least: float) -> float:
    """Return the standard deviation of what agrees, by the median size of all; NaN does not count."""
    every = np.abs(np.concatenate(values)) if len(values) else np.zeros(0)
    every = every[np.isfinite(every)]
    return max(1.4826 * float(np.median(every)), least) if len(every) else max(least, 1e-9)
