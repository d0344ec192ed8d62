"""Finds the far plane in a depth picture: the one value that a renderer or a simulator wrote where it saw nothing."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from .bounds import median

LEAST_POINTS = 1000  # of fewer none is told
LEAST_SHARE = 0.02  # of the points: below it are a few outliers
MOST_SHARE = 0.999  # beyond it the others are, and this is the surface


class FarPlane(NamedTuple):
    """A far plane, and the depth beyond which there is nothing but it and its edges, mixed of it and what is near."""

    depth: float
    limit: float


def far_plane(depths: NDArray[Any], times: float) -> FarPlane | None:
    """Return the largest depth, if many points have exactly this one and it is far beyond the others; else None.

    depths  those of some points, all known
    times   as far as the middle of the others is the limit
    """
    if depths.size < LEAST_POINTS:
        return None
    farthest = depths.max()
    others = depths[depths < farthest]
    if not LEAST_SHARE <= 1 - others.size / depths.size < MOST_SHARE:
        return None
    limit = times * median(others)
    return FarPlane(float(farthest), limit) if farthest > limit else None
