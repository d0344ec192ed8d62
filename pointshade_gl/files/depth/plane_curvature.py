"""Tells depth from inverse depth, whatever their scale, by how the values bend across tilted planes.

A plane a x + b y + c z = d has 1/z = (a u + b v + c)/d: inverse depth is linear in pixels, depth z is not. Along its
slope z'' = 2 z'^2 / z. Floors, walls and tables are planes, and they keep this through noise, blur, 8 bits, an unknown
scale and an unknown offset; only an offset makes the 2 another positive number.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_LARGEST = 1024  # pixels a side that are looked at
_GRIDS = (96, 48)  # blocks along the picture's shorter side, the finer and the coarser look
_SIDE = 8  # blocks of a window
_TILTED = 0.02  # of the range of all values: a window must span that much
_SMOOTH = 0.05  # of a window's span: so far its blocks may lie off a quadratic surface
_FEWEST = 12  # windows
_FLAT = 0.03  # of the range: a picture that is one single plane all over was drawn, not seen

_Y, _X = np.mgrid[:_SIDE, :_SIDE].reshape(2, -1) - (_SIDE - 1) / 2
_TERMS = np.stack([np.ones_like(_X), _X, _Y, _X * _X / 2, _X * _Y, _Y * _Y / 2], axis=1)
_SOLVE = np.linalg.pinv(_TERMS).T


class Bending(NamedTuple):
    """v'' v / v'^2 along the slope, a median over windows: 2 for z, 0 for inverse depth, negative for c - z.

    error   the median's standard error
    across  v'' v / v'^2 across the slope: 0 on planes, not on round objects
    """

    along: float
    error: float
    across: float

    def is_surely(self, low: float, high: float) -> bool:
        """Return whether it lies between the two by more than twice its error."""
        return low < self.along - 2 * self.error and self.along + 2 * self.error < high


@np.errstate(all="ignore")  # what overflows is not finite, and no window
def measure_bending(values: NDArray[Any], known: NDArray[np.bool_], zero: float | None = 0.0) -> Bending | None:
    """Measure how (h, w) values bend across planes, where they are known; None where there are too few planes.

    zero  the value of no depth. None if it is unknown: then v is the range of all values, that is, z with any offset
          gives a positive number
    """
    step = max(1, min(values.shape) // _LARGEST)
    values, known = values[::step, ::step], known[::step, ::step]
    found = []
    for grid in _GRIDS:
        means = _block_means(values, known, max(1, round(min(values.shape) / grid)))
        bending = _bending(means, zero)
        found += [bending] if bending else []
    return min(found, key=lambda one: one.error, default=None)


def _bending(means: NDArray[np.float64], zero: float | None) -> Bending | None:
    seen = means[np.isfinite(means)]
    if min(means.shape) < _SIDE or not seen.size:
        return None
    span = float(np.ptp(np.quantile(seen, (0.01, 0.99))))
    if _is_one_plane(means, span):
        return None
    step = _SIDE // 2
    windows = np.lib.stride_tricks.sliding_window_view(means, (_SIDE, _SIDE))[::step, ::step].reshape(-1, _SIDE**2)
    windows = windows[np.isfinite(windows).all(axis=1)]
    _, x, y, xx, xy, yy = terms = (windows @ _SOLVE).T
    slope = np.hypot(x, y)
    off = np.sqrt(np.square(windows - terms.T @ _TERMS.T).mean(axis=1))
    good = (off < _SMOOTH * slope * _SIDE) & (slope * _SIDE > _TILTED * span)
    if np.count_nonzero(good) < _FEWEST:
        return None
    x, y, xx, xy, yy, slope = (term[good] for term in (x, y, xx, xy, yy, slope))
    scale = (span if zero is None else windows[good].mean(axis=1) - zero) / slope**4
    along = (xx * x * x + 2 * xy * x * y + yy * y * y) * scale
    across = (xx * y * y - 2 * xy * x * y + yy * x * x) * scale
    weight = slope**2
    weight = np.minimum(weight, np.quantile(weight, 0.8))  # no window may decide alone
    low, middle, high = _quantiles(along, weight, (0.25, 0.5, 0.75))
    # windows overlap by half, so a quarter of them are independent; 0.93 IQR / sqrt(n) is a median's standard error
    error = 0.93 * (high - low) / (along.size / 4) ** 0.5
    return Bending(middle, error, _quantiles(across, weight, (0.5,))[0])


def _block_means(values: NDArray[Any], known: NDArray[np.bool_], side: int) -> NDArray[np.float64]:
    """(h // side, w // side) mean of each block, NaN unless all of it is known."""
    h, w = (n // side for n in values.shape)
    shape = (h, side, w, side)
    cut = np.s_[: h * side, : w * side]
    means = values[cut].reshape(shape).mean(axis=(1, 3), dtype=np.float64)
    return np.where(known[cut].reshape(shape).all(axis=(1, 3)), means, np.nan)


def _is_one_plane(means: NDArray[np.float64], span: float) -> bool:
    """Whether one linear ramp is the whole picture."""
    y, x = np.nonzero(np.isfinite(means))
    terms = np.stack([np.ones(x.size), x, y], axis=1)
    seen = means[y, x]
    off = seen - terms @ np.linalg.lstsq(terms, seen, rcond=None)[0]
    return float(np.sqrt(np.square(off).mean())) <= _FLAT * span


def _quantiles(values: NDArray[np.float64], weight: NDArray[np.float64], shares: tuple[float, ...]) -> list[float]:
    order = np.argsort(values)
    sums = np.cumsum(weight[order])
    places = np.searchsorted(sums, np.multiply(shares, sums[-1])).clip(max=values.size - 1)
    return values[order][places].tolist()
