"""Points that a network knows up to a shift along the axis (MoGe, Wang et al. 2025) -> depth and focal length.

A pixel (u, v) from the middle of the picture sees the point (x, y, z) where u (z + s) = f x and v (z + s) = f y. Shift
s and focal length f solve these by least squares, weighed by 1 / (z + s), so that errors count in pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_ROUNDS = 8
_MOST = 20_000  # points that vote
_NEAREST = 1e-3  # of the median distance: what the shift leaves in front of the camera


def settle_points(
    points: NDArray[np.floating], valid: NDArray[np.bool_], focal: float | None
) -> tuple[NDArray[np.float32], float]:
    """Return (h, w) depth, NaN where there is none, and the focal length in pixels of the points' picture.

    points  (h, w, 3), x right, y down, z forward, any unit
    focal   in pixels, if it is known: then the shift alone is found

    Raises ValueError if no pinhole camera sees the points where they are in the picture.
    """
    height, width = valid.shape
    v, u = (np.mgrid[:height, :width] - np.array([height - 1, width - 1])[:, None, None] / 2).astype(np.float64)
    known = valid & np.isfinite(points).all(axis=2)
    places = np.flatnonzero(known)
    places = places[:: max(1, places.size // _MOST)]
    if places.size < 3:
        raise ValueError("it gave no points")
    x, y, z = points.reshape(-1, 3)[places].astype(np.float64).T
    across, seen, flat = np.concatenate([u.flat[places], v.flat[places]]), np.concatenate([x, y]), np.tile(z, 2)
    shift, found = 0.0, focal or 1.0
    for _ in range(_ROUNDS):
        ahead = np.maximum(flat + shift, _NEAREST * np.median(np.abs(flat)) + 1e-12)
        shift, found = _solve(across / ahead, seen / ahead, across * flat / ahead, focal)
    ahead = z + shift
    if not (np.isfinite(found) and found > 0 and np.median(ahead) > 0):
        raise ValueError("no pinhole camera sees its points where they are in the picture")
    depth = points[..., 2] + shift
    return np.where(known & (depth > 0), depth, np.nan).astype(np.float32), float(found)


def _solve(
    across: NDArray[np.float64], seen: NDArray[np.float64], known: NDArray[np.float64], focal: float | None
) -> tuple[float, float]:
    """Return the shift and the focal length for which across * shift - focal * seen = -known."""
    if focal is not None:
        return float((across @ (focal * seen - known)) / max(across @ across, 1e-30)), focal
    (shift, found), *_ = np.linalg.lstsq(np.stack([across, -seen], axis=1), -known, rcond=None)
    return float(shift), float(found)
