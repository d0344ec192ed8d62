"""Fits the pinhole camera to an image of 3D points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_LOOKED_AT = 50_000  # points
MOST_OFF = 0.02  # of the picture's width; networks' points are off by less, those in other axes by more
_FEWEST = 16


def fit_pinhole(points: NDArray[np.floating]) -> tuple[tuple[float, float, float, float], float]:
    """(fx, fy, cx, cy) by least squares from (h, w, 3) points in the camera's axes, and how far pixels are from it.

    u = fx*x/z + cx and v = fy*y/z + cy, each a straight line. The distance is the root mean square, as a share of the
    width; it is infinite if hardly any point is in front of the camera.
    """
    height, width = points.shape[:2]
    step = max(1, int(np.sqrt(height * width / _LOOKED_AT)))
    some = points[::step, ::step].astype(np.float64)
    rows, columns = np.mgrid[0:height:step, 0:width:step]
    seen = np.isfinite(some).all(axis=2) & (some[..., 2] > 0)
    nothing = (0.0, 0.0, 0.0, 0.0), float("inf")
    if np.count_nonzero(seen) < max(_FEWEST, seen.size / 100):
        return nothing
    x, y, z = some[seen].T
    (fx, cx, off_x), (fy, cy, off_y) = _line(x / z, columns[seen]), _line(y / z, rows[seen])
    return ((fx, fy, cx, cy), float(np.hypot(off_x, off_y)) / width) if fx > 0 and fy != 0 else nothing


def _line(slopes: NDArray[np.float64], pixels: NDArray[np.intp]) -> tuple[float, float, float]:
    """The line pixel = a*slope + b, and the root mean square of what is left."""
    centred = slopes - slopes.mean()
    spread = float(centred @ centred)
    a = float(centred @ pixels) / spread if spread else 0.0
    b = float(pixels.mean()) - a * float(slopes.mean())
    return a, b, float(np.sqrt(np.mean((a * slopes + b - pixels) ** 2)))
