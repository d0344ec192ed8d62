"""Judges the poses of several frames by how well they agree in pairs: in depth, and in the texture of their colours."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .frame_matches import Matches
from .reduced_frame import ReducedFrame

LEAST_SPREAD = 1e-4  # of depths that agree, a share of the depth
NARROWEST, WIDEST = 0.004, 0.03  # of the band in which two frames agree, a share of the depth
SPREADS = 3.0  # that the band holds
LEAST_AGREEMENT = 0.75  # of what two frames share must lie within the band
PLAIN_AGREEMENT = 0.96  # the same of frames that were moved far and have no texture
NEAR = 0.05  # of the scene's distance: motions that need no further proof
USUAL_AGREEMENT = 0.93  # of what is usual in the set: with less a frame is placed again
LEAST_CORRELATION = 0.4  # of two textures, a share of what their noise allows
USUAL_CORRELATION = 0.6  # of the better half of the set's pairs
TEXTURED = 0.5  # correlation that noise allows from which on there is a texture to speak of
Matrix = NDArray[np.float64]


class Judgement(NamedTuple):
    """How well frames agree, one value for each."""

    agreement: Matrix  # share of what is shared with others that lies within the band
    grouped: NDArray[np.bool_]  # whether it hangs together with an anchor by pairs that fit
    is_far: NDArray[np.bool_]  # whether it was moved so far that its pose needs more proof
    overlap: Matrix  # share of its points that the other frame with most of them should show
    each: Matrix  # spread of the depths' differences; NaN without overlap
    spread: float  # of depths where frames agree
    correlation: float  # of textures near the given poses, a share of what noise allows; NaN without any

    def is_weak(self) -> NDArray[np.bool_]:
        """Return which frames agree too little, by themselves or beside the others."""
        return self.agreement < max(LEAST_AGREEMENT, USUAL_AGREEMENT * float(np.median(self.agreement)))

    def is_doubtful(self) -> NDArray[np.bool_]:
        """Return which frames another pose may fit better."""
        return (self.is_weak() | ~self.grouped) & (self.overlap > 0)

    def is_wrong(self) -> NDArray[np.bool_]:
        """Return which frames do not belong where they are."""
        return ((self.is_weak() & self.is_far) | ~self.grouped) & (self.overlap > 0)


def judge(
    found: Sequence[tuple[int, int, Matches]],
    frames: Sequence[ReducedFrame],
    points: Sequence[int],
    anchors: Collection[int],
    moved: Matrix,
    spread: float | None,
) -> Judgement:
    """Return how well frames agree.

    found   matches of frame i in frame j, each i, j, matches
    points  of each frame that were looked for in the others
    anchors numbers of the frames whose poses are right
    moved   (n, n) how far pairs of frames were moved against each other, a share of the scene's distance
    spread  of depths where frames agree; None measures it, in that pair of each frame which agrees best
    """
    count = len(points)
    seen, agree = np.zeros((2, count, count))  # of pairs, both ways together
    textures = np.zeros((5, count, count))  # see _texture_sums
    apart: dict[tuple[int, int], list[NDArray[np.floating]]] = {}
    overlap = np.zeros(count)
    for i, j, one in found:
        apart.setdefault((min(i, j), max(i, j)), []).append(one.apart)
        overlap[i] = max(overlap[i], one.seen / points[i])
    spreads = {pair: spread_of(values, LEAST_SPREAD) for pair, values in apart.items()}
    if spread is None:
        best = [min((one for pair, one in spreads.items() if k in pair), default=np.nan) for k in range(count)]
        spread = float(np.nanmedian(best)) if np.isfinite(best).any() else LEAST_SPREAD
    band = min(max(SPREADS * spread, NARROWEST), WIDEST)
    for i, j, one in found:
        both = ([i, j], [j, i])
        seen[both] += one.seen
        agree[both] += np.count_nonzero(np.abs(one.apart) < band)
        textures[:, both[0], both[1]] += _texture_sums(frames[i], frames[j], one)[:, None]
    shares = agree / np.maximum(seen, 1)
    fits, correlation = _fit(shares, textures, moved)
    agreement = agree.sum(0) / np.maximum(seen.sum(0), 1)
    each = [[one for pair, values in apart.items() if k in pair for one in values] for k in range(count)]
    each = np.array([spread_of(values, 0.0) if values else np.nan for values in each])
    is_far = moved[:, list(anchors)].min(1) >= NEAR
    return Judgement(agreement, connected(fits, anchors), is_far, overlap, each, spread, correlation)


def _texture_sums(frame: ReducedFrame, other: ReducedFrame, one: Matches) -> Matrix:
    """Return sums over matches: of the product of both textures, of their squares, and of their noises' squares."""
    if frame.brightness is None or other.brightness is None or not len(one.numbers):
        return np.zeros(5)
    own, theirs = frame.texture[one.numbers].astype(np.float64), other.texture[one.pixels].astype(np.float64)
    noises = len(own) * np.array([frame.texture_noise**2, other.texture_noise**2])
    return np.array([own @ theirs, own @ own, theirs @ theirs, *noises])


def _fit(shares: Matrix, textures: Matrix, moved: Matrix) -> tuple[NDArray[np.bool_], float]:
    """Return which pairs of frames agree as only right poses make them, and how their textures correlate.

    A floor slides along itself unseen, and so does a wall beside it: far from the given pose, textures must agree, too.
    shares: of depths that agree, (n, n)
    """
    product, own, theirs, own_noise, their_noise = textures
    squares = np.maximum(own * theirs, 1e-30)
    signal = np.maximum(own - own_noise, 0) * np.maximum(theirs - their_noise, 0)
    possible = np.sqrt(signal / squares)
    correlation = product / np.sqrt(squares) / np.maximum(possible, 1e-9)
    textured, is_near = possible >= TEXTURED, moved < NEAR
    agree = shares >= max(LEAST_AGREEMENT, USUAL_AGREEMENT * _better_half(shares[shares > 0]))
    alike = correlation >= max(LEAST_CORRELATION, USUAL_CORRELATION * _better_half(correlation[textured]))
    proven = np.where(textured, agree & alike, shares >= PLAIN_AGREEMENT)
    some = textured & is_near & (shares >= LEAST_AGREEMENT)
    usual = float(product[some].sum() / np.sqrt(signal[some]).sum()) if some.any() else np.nan
    return np.where(is_near, shares >= LEAST_AGREEMENT, proven), usual


def _better_half(values: Matrix) -> float:
    """Return the median of the better half of values, 0 without any."""
    return float(np.quantile(values, 0.75)) if len(values) else 0.0


def connected(linked: NDArray[np.bool_], anchors: Collection[int]) -> NDArray[np.bool_]:
    """Return which of n things hang together with some of them. linked: (n, n)."""
    groups = np.eye(len(linked), dtype=bool) | linked
    for _ in range(len(linked).bit_length()):
        groups = groups @ groups
    return np.any(groups[list(anchors)], axis=0)


def spread_of(values: Sequence[NDArray[np.floating]], least: float) -> float:
    """Return the standard deviation of what agrees, by the median size of all; NaN does not count."""
    every = np.abs(np.concatenate(values)) if len(values) else np.zeros(0)
    every = every[np.isfinite(every)]
    return max(1.4826 * float(np.median(every)), least) if len(every) else max(least, 1e-9)
