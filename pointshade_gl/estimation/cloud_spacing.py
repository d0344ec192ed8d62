"""The spacing of a point cloud: how far apart the points of its surface are."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SAMPLE = 1 << 14  # points
ASKED = 192  # of these, whose nearest neighbours are looked for
NEAREST = 16
SMALLEST = 1e-30  # what is less float32 cannot square


class Spacing(NamedTuple):
    """The spacing, 1 where there is none, and how many places there are, as a share of the points."""

    length: float
    distinct: float


def estimate_spacing(positions: NDArray[np.float32]) -> Spacing:
    """Estimate sqrt(area / n) of the surface that points sample, from a part of them; those in one place count once."""
    rng = np.random.default_rng(0)
    count = len(positions)
    part = positions if count <= SAMPLE else positions[np.unique(rng.integers(0, count, SAMPLE))]
    places = np.unique(part, axis=0).astype(np.float64)
    if len(places) < 2:
        return Spacing(1.0, 1 / max(count, 1))
    asked = places[rng.choice(len(places), min(ASKED, len(places)), replace=False)]
    nearest = min(NEAREST, len(places) - 1)
    squares = sum((asked[:, k, None] - places[:, k]) ** 2 for k in range(3))
    reach = math.sqrt(np.median(np.partition(squares, nearest, axis=1)[:, nearest]))
    total = _all_places(len(places), len(part), count)
    length = reach * math.sqrt(math.pi / nearest * len(places) / total)
    return Spacing(length, total / count) if length > SMALLEST else Spacing(1.0, 1.0)


def _all_places(seen: int, part: int, count: int) -> float:
    """Return in how many places all points lie, if a part of them, at random, lies in so many.

    With m points in each place, one is seen with probability 1 - (1 - part / count)^m: the m that fits.
    """
    if seen == part or part == count:
        return float(count if seen == part else seen)
    low, high = 1.0, float(count)
    for _ in range(60):
        middle = math.sqrt(low * high)
        expected = count / middle * -math.expm1(middle * math.log1p(-part / count))
        low, high = (middle, high) if expected > seen else (low, middle)
    return count / high
