"""Converts raw depth to metres along the axis; recognises its kind by planes, and enlarged depth by its edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_positive
from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from .missing_depth import blocks, known_values

DepthKind = Literal["z", "ray", "plane", "inverse", "disparity", "kinect"]
KINDS: tuple[DepthKind, ...] = get_args(DepthKind)
METRIC = KINDS[:3]
NEAREST, FARTHEST = 1.0, 10.0  # metres between which depth without a scale is laid
_BEYOND = 8  # times these are the ends of all pictures of a film

# Konolige & Mihelich, "Technical description of Kinect calibration", 2010: eighths of a pixel, less than at infinity
_KINECT_INFINITY = 1091.5
_KINECT_METRES = 8 * 0.075 * 580  # times the distance of the eyes, times the focal length in pixels
_KINECT_LAST = 1084  # beyond it, at 46 m, one step is 7 m


@dataclass(frozen=True)
class DepthHints:
    """What is given about a depth picture, by the caller and by the camera's file; None = nothing."""

    kind: str | None = None
    scale: float | None = None
    filed_kind: str | None = None
    filed_scale: float | None = None
    has_baseline: bool = False

    @property
    def any_kind(self) -> str | None:
        return self.kind or self.filed_kind

    @property
    def is_silent(self) -> bool:
        """Return whether the depth kind is not given and must be found from the values."""
        return self.any_kind is None and self.scale is None


@dataclass(frozen=True)
class Coding:
    """What the raw values of a depth picture mean."""

    kind: str
    scale: float | None  # values per metre (see `to_metres`); None for z or inverse depth without any
    why: str  # how kind and scale were found, in a few words
    repairs: tuple[str, ...] = ()  # make plain numbers of the raw values, in this order (see `depth_files.repaired`)
    hints: DepthHints | None = None  # what was given before
    is_straight: bool = False  # the lens of the camera's file is taken out already
    enlarged: int = 1  # how many pixels along a side are one of the depth as it was made, see `times_enlarged`


class Decoded(NamedTuple):
    """Plain numbers (h, w), of which `to_metres` makes metres, and what they mean."""

    values: NDArray[Any]
    coding: Coding


@np.errstate(all="ignore")  # what overflows is infinite, and missing in the frame
def to_metres(
    raw: NDArray[Any], camera: Camera, kind: str, scale: float | None, baseline: float | None, note: Note,
    dtype: type[np.floating] = np.float64, doffs: float = 0.0, ends: tuple[float, float] | None = None,
) -> NDArray[Any]:  # fmt: skip
    """(h, w) z in metres of the type, 0 where missing, from raw values of one of KINDS.

    z          raw / scale is z along the optical axis; without a scale z up to scale and offset, laid from 1 to 10 m
    ray        raw / scale is the distance along the pixel's ray
    plane      the same, from the image plane at unit focal length: P = ray * (|ray| + v) / |ray|
    inverse    z = scale / raw; without a scale 1/z up to scale and offset, laid between 1 and 10 m
    disparity  z = fx * baseline / (raw / scale + doffs), baseline in metres; doffs, in pixels, is how far apart the two
               cameras' principal points are (Middlebury's): what is negative before may be a distance
    kinect     raw is the disparity of a first Kinect, 11 bits

    ends  raw values that are put at the two ends of depth without a scale; the default is the smallest and the largest

    Raises ValueError if a disparity has no baseline, or if depth without a scale does not vary.
    """
    if kind in ("z", "inverse") and scale is None:
        return _spread(raw, kind, note, dtype, ends)
    if kind == "disparity":
        if baseline is None:
            raise ValueError(f"disparity needs the distance of the two cameras: pass {option('baseline')} in metres")
        baseline = check_positive(baseline, option("baseline"))
    if doffs and raw.dtype.kind != "u" and raw.min(where=np.isfinite(raw), initial=0) < 0:
        raw, doffs = np.where(raw == 0, raw, raw + doffs * (scale or 1)), 0.0
    values = known_values(raw, kind, note)
    result = np.empty(raw.shape, dtype)
    for rows in blocks(raw):
        result[rows] = _convert(values(rows), rows, camera, kind, scale or 1.0, baseline or 0.0, doffs)
    return result


def _convert(
    values: NDArray[np.float64], rows: slice, camera: Camera, kind: str, scale: float, baseline: float, doffs: float
) -> NDArray[np.float64]:
    """Metres for values above 0, of these rows of the picture; 0 stays 0."""
    if kind == "z":
        return values / scale
    if kind == "ray":
        return values / scale / _ray_lengths(camera, rows)
    if kind == "plane":
        ray = _ray_lengths(camera, rows)
        metres = (ray + values / scale) / ray
    elif kind == "inverse":
        metres = scale / values
    elif kind == "kinect":
        metres = _KINECT_METRES / (_KINECT_INFINITY - values)
        values = np.where(values <= _KINECT_LAST, values, 0)
    else:
        metres = camera.fx * baseline / (values / scale + doffs)
    return np.where(values > 0, metres, 0)


def _ray_lengths(camera: Camera, rows: slice) -> NDArray[np.float64]:
    """(n, w) length of ((u-cx)/fx, (v-cy)/fy, 1) in these rows."""
    x, y = camera.ray_at(np.arange(camera.width), np.arange(camera.height)[rows])
    return np.sqrt(x * x + (y * y)[:, None] + 1)


def _spread(
    raw: NDArray[Any], kind: str, note: Note, dtype: type[np.floating], ends: tuple[float, float] | None
) -> NDArray[Any]:
    """Depth or inverse depth of unknown scale and offset, as networks give it. 0 is an end, not missing."""
    low, high = np.inf, -np.inf
    for rows in blocks(raw):
        values = raw[rows].astype(np.float64)
        known = np.isfinite(values)
        low, high = min(low, values.min(where=known, initial=low)), max(high, values.max(where=known, initial=high))
    result = np.zeros(raw.shape, dtype)
    if low > high:
        return result
    is_inverse = kind == "inverse"
    title, least, most = ("inverse depth", FARTHEST, NEAREST) if is_inverse else ("depth", NEAREST, FARTHEST)
    if low == high:
        raise ValueError(f"{title} must vary, got {low:g} everywhere")
    if ends is None:
        note(f"{title} has no scale: its largest value is put at {most:g} m, its smallest at {least:g} m")
    low, high = ends or (low, high)
    first, last = (1 / least, 1 / most) if is_inverse else (least, most)
    smallest = 1 / (_BEYOND * FARTHEST) if is_inverse else NEAREST / _BEYOND
    for rows in blocks(raw):
        values = raw[rows].astype(np.float64)
        known = np.isfinite(values)
        laid = first + (np.where(known, values, low) - low) / (high - low) * (last - first)
        laid = np.maximum(laid, smallest)  # what comes into a film may lie beyond the ends of its first picture
        result[rows] = np.where(known, 1 / laid if is_inverse else laid, 0)
    return result


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
    """Measure how (h, w) values bend across planes, where they are known; None where there are too few planes.

    zero  the value of no depth; if it is unknown, v is the range of all values: z with any offset is positive then
    """
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


_LINES = 256  # rows, and columns, that are looked at
_EDGE = 0.1  # of the range of 1/z: by so much it changes at an edge, at least
_END = 0.1  # of the steepest change at an edge: where it ends
_WIDEST = 1 / 32  # of a line: what is wider is a slanted surface
_FEWEST_EDGES = 50
_SHARPEST = 10  # percent of the edges: these are as wide as the depth was enlarged, others are surfaces that bend away
# Widths in pixels. Of seven pictures, reduced to 518, 384 and 259 rows in four ways, the sharpest are 1 to 1.33 wide;
# enlarged 2 times, bilinear or cubic, 1.7 to 2.7; 6 times 4.6 to 9.
_OWN = 1.4
_USUAL = 1.25
_SMALLEST = 192  # pixels along the shorter side of what networks make, at least


def times_enlarged(depth: NDArray[np.floating]) -> int:
    """Return how many pixels along a side are one of depth (h, w) z, 0 is missing, as it was made, from 1 on."""
    most = min(depth.shape) // _SMALLEST
    if most < 2:
        return 1
    rows, columns = _inverse_of_lines(depth), _inverse_of_lines(depth.T)
    known = rows[np.isfinite(rows)]
    if not known.size:
        return 1
    low, high = np.percentile(known, (2, 98))
    widths = np.concatenate([_edge_widths(lines, _EDGE * (high - low)) for lines in (rows, columns)])
    if widths.size < _FEWEST_EDGES:
        return 1
    width = float(np.percentile(widths, _SHARPEST))
    return 1 if width < _OWN else min(max(2, round(width / _USUAL)), most)


def reduced(depth: NDArray[np.float32], times: int) -> NDArray[np.float32]:
    """Return depth (h, w) z, 0 is missing, with so many times fewer pixels along each side: means of 1/z."""
    from PIL import Image

    height, width = depth.shape
    size = max(1, round(width / times)), max(1, round(height / times))
    known = depth > 0
    inverse = np.divide(1, depth, out=np.zeros_like(depth), where=known)
    sums, shares = (
        np.asarray(Image.fromarray(part).resize(size, Image.Resampling.BOX))
        for part in (inverse, known.astype(np.float32))
    )
    return np.divide(shares, sums, out=np.zeros_like(sums), where=(shares >= 0.5) & (sums > 0))


def _inverse_of_lines(depth: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return 1/z in some of the rows; NaN is missing."""
    step = max(1, len(depth) // _LINES)
    lines = depth[step // 2 :: step]
    return np.divide(1, lines, out=np.full(lines.shape, np.nan, lines.dtype), where=lines > 0)


def _edge_widths(lines: NDArray[np.floating], least: float) -> NDArray[np.floating]:
    """Return how many pixels wide edges, where 1/z changes by so much, are along lines: by the steepest change."""
    changes = np.diff(lines, axis=1)  # NaN beside what is missing
    reach = max(3, int(lines.shape[1] * _WIDEST))
    if changes.shape[1] <= 2 * reach + 2:
        return np.zeros(0)
    sizes = np.abs(changes)
    with np.errstate(invalid="ignore"):
        is_steepest = (sizes[:, 1:-1] >= sizes[:, :-2]) & (sizes[:, 1:-1] > sizes[:, 2:])
        is_steepest &= sizes[:, 1:-1] * reach > least
    row, column = np.nonzero(is_steepest[:, reach : -reach - 1])
    column += reach + 1
    steepest = changes[row, column]
    width, pixels = np.ones(len(row)), np.ones(len(row))
    for side in (-1, 1):
        goes_on = np.ones(len(row), bool)
        for k in range(1, reach + 1):
            share = changes[row, column + side * k] / steepest
            goes_on &= share > _END  # not where it is NaN
            width += np.where(goes_on, share, 0)
            pixels += goes_on
    return width[(pixels <= reach) & (np.abs(steepest) * width > least)]
