"""Places names beside points so that none covers another: in pixels, without a drawing library."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # left, bottom, right, top
DIRECTIONS, RINGS = 24, 16  # places round its point where a label is tried
OVER_LABEL, OVER_POINT, OUTSIDE = 20.0, 1.0, 100.0  # what a covered pixel costs


def place_labels(points: ArrayLike, sizes: Sequence[tuple[float, float]], room: Box, reach: float) -> Array:
    """(n, 2) middles of n labels of `sizes` (width, height), each near its point; `points` is (n, 2).

    room   the box they must stay in
    reach  how far labels keep from points

    Labels are placed in the given order, as near as there is room; without room, where they cover least.
    """
    marks = np.asarray(points, float).reshape(-1, 2)
    angles = np.pi / 2 + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS  # the first one is above
    around = np.stack([np.cos(angles), np.sin(angles)], -1)
    taken = np.zeros((0, 4))
    obstacles = np.hstack([marks - reach, marks + reach])
    for k, (mark, size) in enumerate(zip(marks, np.asarray(sizes, float), strict=True)):
        away = reach + np.arange(RINGS)[:, None, None] * size[1] / 3
        middles = (mark + around * (away + size / 2)).reshape(-1, 2)
        boxes = np.hstack([middles - size / 2, middles + size / 2])
        cost = OVER_LABEL * common(boxes, taken).sum(-1) + OVER_POINT * common(boxes, np.delete(obstacles, k, 0)).sum(
            -1
        )
        cost += OUTSIDE * (size.prod() - common(boxes, np.array([room])).sum(-1))
        taken = np.vstack([taken, boxes[np.argmin(np.round(cost, 6))]])
    return (taken[:, :2] + taken[:, 2:]) / 2


def common(a: Array, b: Array) -> Array:
    """(n, m) the area that each of n boxes (n, 4) shares with each of m."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.maximum(high - low, 0).prod(-1)
