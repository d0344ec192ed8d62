"""What planes in a picture tell about its raw values: whether they are depth, inverse depth, or lengths of rays.

Rooms, tables and streets are full of planes: their values mean what makes these flat, and corners right-angled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import Camera

_LARGEST = 1024  # pixels a side that are looked at
_GRIDS = (96, 48)  # blocks along the picture's shorter side, the finer and the coarser look
_SIDE = 8  # blocks of a window
_TILTED = 0.02  # of the range of all values: a window must span that much
_SMOOTH = 0.05  # of a window's span: so far its blocks may lie off a quadratic surface
_FEWEST_WINDOWS = 12  # windows
_FLAT_DRAWING = 0.03  # of the range: a picture that is one single plane all over was drawn, not seen

_Y, _X = np.mgrid[:_SIDE, :_SIDE].reshape(2, -1) - (_SIDE - 1) / 2
_TERMS = np.stack([np.ones_like(_X), _X, _Y, _X * _X / 2, _X * _Y, _Y * _Y / 2], axis=1)
_SOLVE = np.linalg.pinv(_TERMS).T


class Bending(NamedTuple):
    """v'' v / v'^2 along the slope, a median over windows: 2 for z, 0 for inverse depth, negative for c - z."""

    along: float
    error: float  # the median's standard error
    across: float  # v'' v / v'^2 across the slope: 0 on planes, not on round objects

    def is_surely(self, low: float, high: float) -> bool:
        """Return whether it lies between the two by more than twice its error."""
        return low < self.along - 2 * self.error and self.along + 2 * self.error < high


@np.errstate(all="ignore")  # what overflows is not finite, and no window
def measure_bending(values: NDArray[Any], known: NDArray[np.bool_], zero: float | None = 0.0) -> Bending | None:
    """Measure how (h, w) values bend across planes, where they are known; None where there are too few planes. zero:
    the value of no depth; if it is unknown, v is the range of all values: z with any offset is positive then."""
    step = max(1, min(values.shape) // _LARGEST)
    values, known = values[::step, ::step], known[::step, ::step]
    found = []
    for grid in _GRIDS:
        bending = _bending(_block_means(values, known, max(1, round(min(values.shape) / grid))), zero)
        found += [bending] if bending else []
    return min(found, key=lambda one: one.error, default=None)


def _bending(means: NDArray[np.float64], zero: float | None) -> Bending | None:
    y, x = np.nonzero(np.isfinite(means))
    seen = means[y, x]
    if min(means.shape) < _SIDE or not seen.size:
        return None
    span = float(np.ptp(np.quantile(seen, (0.01, 0.99))))
    terms = np.stack([np.ones(x.size), x, y], axis=1)
    off_plane = seen - terms @ np.linalg.lstsq(terms, seen, rcond=None)[0]
    if float(np.sqrt(np.square(off_plane).mean())) <= _FLAT_DRAWING * span:
        return None  # one linear ramp is the whole picture
    step = _SIDE // 2
    windows = np.lib.stride_tricks.sliding_window_view(means, (_SIDE, _SIDE))[::step, ::step].reshape(-1, _SIDE**2)
    windows = windows[np.isfinite(windows).all(axis=1)]
    _, x, y, xx, xy, yy = terms = (windows @ _SOLVE).T
    slope = np.hypot(x, y)
    off = np.sqrt(np.square(windows - terms.T @ _TERMS.T).mean(axis=1))
    good = (off < _SMOOTH * slope * _SIDE) & (slope * _SIDE > _TILTED * span)
    if np.count_nonzero(good) < _FEWEST_WINDOWS:
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


def _quantiles(values: NDArray[np.float64], weight: NDArray[np.float64], shares: tuple[float, ...]) -> list[float]:
    order = np.argsort(values)
    sums = np.cumsum(weight[order])
    places = np.searchsorted(sums, np.multiply(shares, sums[-1])).clip(max=values.size - 1)
    return values[order][places].tolist()


_LEAST_BENT, _ROUND = 0.5, 0.5  # bending of depth, at least; across to along on planes


def direction_of(values: NDArray[Any], known: NDArray[np.bool_]) -> int:
    """Return 1 if planes bend as in depth with any offset, -1 if as in its reverse; 0 for inverse or unknown depth."""
    bending = measure_bending(values, known, None)
    if bending is None:
        return 0
    is_plane = abs(bending.across) < _ROUND * abs(bending.along)  # objects are not just round
    is_bent = is_plane and abs(bending.along) - 2 * bending.error > _LEAST_BENT
    return int(np.sign(bending.along)) if is_bent else 0


_ACROSS = 5  # windows along the picture's shorter side; those a quarter of one apart are looked at
_POINTS = 12  # of a window along a side
_FLAT_PLANE = 0.25  # of what the other reading would bend: so flat a plane is
_BENT = (0.6, 1.6)
_LEAST = 2e-4  # of the depth: a bend that can be seen
_FEWEST_PLANES, _SHARE = 12, 0.8  # windows that show a plane, and how many of them must agree


@np.errstate(all="ignore")
def is_ray_length(depth: NDArray[np.floating], camera: Camera) -> bool:
    """Return whether (h, w) depth, 0 where unknown, is the length of rays: only as such are its planes flat."""
    side = min(depth.shape) // _ACROSS
    step = max(1, side // _POINTS)
    if side < _POINTS // 2:
        return False
    v, u = np.mgrid[0 : depth.shape[0] : step, 0 : depth.shape[1] : step]
    x, y = camera.ray_at(u, v)
    longer = np.sqrt(1 + x**2 + y**2)
    values = depth[::step, ::step].astype(np.float64)
    inverse = np.where(values > 0, 1 / values, np.nan)
    as_z, as_ray, bend = (_bends(one) for one in (inverse, longer * inverse, longer))
    seen = np.isfinite(as_z) & (bend > _LEAST)
    rays = seen & (as_ray < _FLAT_PLANE * bend) & (as_z > _BENT[0] * bend) & (as_z < _BENT[1] * bend)
    axes = seen & (as_z < _FLAT_PLANE * bend) & (as_ray > _BENT[0] * bend) & (as_ray < _BENT[1] * bend)
    shown = int(np.count_nonzero(rays) + np.count_nonzero(axes))
    return shown >= _FEWEST_PLANES and int(np.count_nonzero(rays)) > _SHARE * shown


def _bends(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) how far the values of each window lie off a plane, over their mean; NaN where some are unknown."""
    windows = np.lib.stride_tricks.sliding_window_view(values, (_POINTS, _POINTS))
    windows = windows[:: _POINTS // 4, :: _POINTS // 4].reshape(-1, _POINTS**2)
    y, x = np.mgrid[:_POINTS, :_POINTS].reshape(2, -1) - (_POINTS - 1) / 2
    terms = np.stack([np.ones_like(x), x, y], axis=1)
    off = windows - windows @ np.linalg.pinv(terms).T @ terms.T
    return np.sqrt(np.square(off).mean(axis=1)) / np.abs(windows.mean(axis=1))


_GRID = 48  # blocks along the shorter side where offsets are looked for
_MOST_WINDOWS = 160
_LEVEL = 0.004  # of the range: so far a plane's blocks may lie off it
_ROUNDED = 0.35  # of a step between whole numbers: likewise
_PARALLEL = 0.94  # cosine of two normals of one plane
_RIGHT = (0.02, 0.006, 0.003)  # cosine that still counts as a right angle, in three looks
_FEWEST_PAIRS = 0.05  # of all pairs of windows must stand at an angle to each other
_CORNERS = 0.5  # the share of these at right angles
_CLEARER = 0.6  # of that share: with more on the other side it stays open on which side the offset is
_AWAY = np.geomspace(0.01, 20, 160)  # how far beyond the values an offset is looked for, in ranges of all values
_CURVED = 0.01  # of the range: what lies farther off is no plane


@np.errstate(all="ignore")
def offset_by_corners(
    values: NDArray[Any], known: NDArray[np.bool_], camera: Camera, step: float = 0.0
) -> float | None:
    """Return the value at which 1/z is 0, where (h, w) values are 1/z up to scale and offset; None if it stays open.

    Walls, floors and boxes meet at right angles for one offset alone. If it is above all values, large is far.

    step  between values of whole numbers
    """
    side = max(1, round(min(values.shape) / _GRID))
    low, span = _range_of(values, known)
    means = (_block_means(values, known, side) - low) / span
    if min(means.shape) < _SIDE:
        return None
    planes = _planes(means, side, camera, _LEVEL + _ROUNDED * step / span)
    planes = planes[:: 1 + len(planes) // _MOST_WINDOWS]
    if len(planes) < _FEWEST_WINDOWS:
        return None

    def corners(offset: float, off: float) -> float:
        return _right_angles(planes - (0, 0, offset), off)

    found = [_best(corners, sides) for sides in (-_AWAY, 1 + _AWAY)]
    (less, _), (most, offset) = sorted(found)
    return None if most < _CORNERS or less > _CLEARER * most else float(low + offset * span)


@np.errstate(all="ignore")
def offset_by_flatness(values: NDArray[Any], known: NDArray[np.bool_]) -> float | None:
    """Return the value at which z is 0, where (h, w) values fall evenly with z; None if planes do not show it. Planes
    are flat in 1/z for one offset alone."""
    low, span = _range_of(values, known)
    means = (_block_means(values, known, max(1, round(min(values.shape) / _GRID))) - low) / span
    if min(means.shape) < _SIDE:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(means, (_SIDE, _SIDE))
    windows = windows[:: _SIDE // 2, :: _SIDE // 2].reshape(-1, _SIDE**2)
    windows = windows[np.isfinite(windows).all(axis=1)]
    if len(windows) < _FEWEST_WINDOWS:
        return None
    terms = _TERMS[:, :3]
    fit = np.linalg.pinv(terms).T @ terms.T

    def flatness(offset: float, _: float) -> float:
        inverse = 1 / (offset - windows)
        off = np.sqrt(np.square(inverse - inverse @ fit).mean(axis=1)) * np.square(offset - windows.mean(axis=1))
        return -float(np.minimum(off, _CURVED).mean())

    _, offset = _best(flatness, 1 + _AWAY)
    return float(low + offset * span) if 1 + _AWAY[0] < offset < 1 + _AWAY[-1] else None


def _range_of(values: NDArray[Any], known: NDArray[np.bool_]) -> tuple[float, float]:
    """The least of nearly all values, and the range of these."""
    low, high = np.quantile(values[known], (0.002, 0.998))
    return float(low), float(high - low)


def _best(quality: Callable[[float, float], float], places: NDArray[np.float64]) -> tuple[float, float]:
    """The highest quality of one of some numbers, and that number, found more exactly around it."""
    best, place = -np.inf, 0.0
    for off in _RIGHT:
        found = [quality(place, off) for place in places]
        k = int(np.nanargmax(found))
        best, place = max(best, found[k]), float(places[k])
        places = np.linspace(places[max(k - 1, 0)], places[min(k + 1, len(places) - 1)], 21)
    return best, place


def _planes(means: NDArray[np.float64], side: int, camera: Camera, most_off: float) -> NDArray[np.float64]:
    """(n, 3) slopes along x and y of the rays, and the value where both are 0, of the windows that are planes."""
    h, w = means.shape
    x, y = camera.ray_at(np.arange(w) * side + (side - 1) / 2, np.arange(h) * side + (side - 1) / 2)
    step = _SIDE // 2
    windows = np.lib.stride_tricks.sliding_window_view(means, (_SIDE, _SIDE))[::step, ::step]
    rows, columns, *_ = windows.shape
    windows = windows.reshape(-1, _SIDE, _SIDE)
    middle_x, middle_y = (np.lib.stride_tricks.sliding_window_view(one, _SIDE)[::step].mean(1) for one in (x, y))
    dx, dy = (float(one[1] - one[0]) * (np.arange(_SIDE) - (_SIDE - 1) / 2) for one in (x, y))
    along, down = windows.mean(1) @ dx / (dx @ dx), windows.mean(2) @ dy / (dy @ dy)
    middle = windows.mean((1, 2))
    flat = np.multiply.outer(along, dx)[:, None] + np.multiply.outer(down, dy)[..., None]
    off = np.sqrt(np.square(windows - middle[:, None, None] - flat).mean((1, 2)))
    start = middle - along * np.tile(middle_x, rows) - down * np.repeat(middle_y, columns)
    return np.stack([along, down, start], 1)[off < most_off]


def _right_angles(normals: NDArray[np.float64], off: float) -> float:
    """The share of right angles among those between normals (n, 3) that are not parallel; small if these are few."""
    units = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    cosines = np.abs(units @ units.T)
    angles = cosines[cosines < _PARALLEL]
    if not angles.size:
        return 0.0
    share = float(np.exp(-0.5 * np.square(angles / off)).mean())
    return share * min(1.0, angles.size / (_FEWEST_PAIRS * cosines.size))
