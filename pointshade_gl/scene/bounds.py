"""Computes bounding boxes and bounding spheres, to which culling, shadow cameras and viewing cameras are fitted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def box_corners(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.float64]:
    """Return (8, 3) corners of the box between two corners (3,)."""
    return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], np.float64)


def sphere_round(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return centre (3,) and radius of a sphere around points (n, 3); without points radius 1 around the origin."""
    if not len(points):
        return np.zeros(3), 1.0
    centre = (points.min(0) + points.max(0)) / 2
    return centre, max(float(np.linalg.norm(points - centre, axis=1).max()), 1e-6)


def median(values: ArrayLike) -> float:
    """Return np.median of some numbers without its import of numpy.ma, which takes 10 ms of the first picture."""
    array = np.asarray(values, np.float64).ravel()
    low, high = (array.size - 1) // 2, array.size // 2
    return float(np.partition(array, (low, high))[[low, high]].mean())


def quantile(values: NDArray[Any], share: float) -> float:
    """Return np.quantile of some floats, 0..1, without that import."""
    at = share * (values.size - 1)
    low = int(at)
    high = min(low + 1, values.size - 1)
    first, second = np.partition(values, (low, high), axis=None)[[low, high]].astype(np.float64).tolist()
    part, step = at - low, second - first
    return second - step * (1 - part) if part >= 0.5 else first + step * part
