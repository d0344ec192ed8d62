"""Converts raw depth to metres along the axis; recognises its kind by planes, and enlarged depth by its edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_positive
from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from .missing_depth import blocks, known_values

DepthKind = Literal["z", "ray", "plane", "inverse", "disparity", "kinect", "buffer", "reversed"]
KINDS: tuple[DepthKind, ...] = get_args(DepthKind)
METRIC, RANGED = KINDS[:3], KINDS[-2:]
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
    levels: int = 0  # of a film's picture; 0 is no film
    near: float | None = None  # by either
    far: float | None = None
    # gives the camera of the picture, None if it is not known; it is costly, and mostly not needed
    camera: Callable[[], Camera | None] | None = field(default=None, compare=False, repr=False)

    @property
    def known_camera(self) -> Camera | None:
        """Return the camera of the picture, None if it is not known."""
        return self.camera() if self.camera else None

    @property
    def any_kind(self) -> str | None:
        return self.kind or self.filed_kind

    @property
    def is_silent(self) -> bool:
        """Return whether the depth kind is not given and must be found from the values."""
        return self.any_kind is None and self.scale is None

    @property
    def has_range(self) -> bool:
        return self.near is not None and self.far is not None


class NearFar(NamedTuple):
    """Metres at the two ends of the values of a buffer, of reversed depth, where far is 0, or of inverse depth."""

    near: float
    far: float
    lowest: float  # the value of the near plane: 0, or -1 in clip coordinates


@dataclass(frozen=True)
class Coding:
    """What the raw values of a depth picture mean."""

    kind: str
    scale: float | None  # values per metre (see `to_metres`); None for z or inverse depth without any
    why: str  # how kind and scale were found, in a few words
    repairs: tuple[str, ...] = ()  # make plain numbers of the raw values, in this order (see `depth_files.repaired`)
    hints: DepthHints | None = None  # what was given before
    planes: NearFar | None = None  # of RANGED, and of inverse depth whose two ends are given
    is_straight: bool = False  # the lens of the camera's file is taken out already
    enlarged: int = 1  # how many pixels along a side are one of the depth as it was made, see `times_enlarged`
    as_stored: bool = False  # the colours lie on it as they are stored, not as EXIF turns them


class Decoded(NamedTuple):
    """Plain numbers (h, w), of which `to_metres` makes metres, and what they mean."""

    values: NDArray[Any]
    coding: Coding


@np.errstate(all="ignore")  # what overflows is infinite, and missing in the frame
def to_metres(
    raw: NDArray[Any], camera: Camera, kind: str, scale: float | None, baseline: float | None, note: Note,
    dtype: type[np.floating] = np.float64, doffs: float = 0.0, ends: tuple[float, float] | None = None,
    planes: NearFar | None = None,
) -> NDArray[Any]:  # fmt: skip
    """(h, w) z in metres of the type, 0 where missing, from raw values of one of KINDS.

    z          raw / scale is z along the optical axis; without a scale z up to scale and offset, laid from 1 to 10 m
    ray        raw / scale is the distance along the pixel's ray
    plane      the same, from the image plane at unit focal length: P = ray * (|ray| + v) / |ray|
    inverse    z = scale / raw; without a scale 1/z up to scale and offset, laid between near and far, or 1 and 10 m
    disparity  z = fx * baseline / (raw / scale + doffs), baseline in metres; doffs, in pixels, is how far apart the two
               cameras' principal points are (Middlebury's): what is negative before may be a distance
    kinect     raw is the disparity of a first Kinect, 11 bits
    buffer     1/z goes evenly from the near plane's, where raw / scale is 0, to the far plane's, where it is 1
    reversed   z goes evenly from the far plane, where raw / scale is 0, to the near plane, where it is 1

    planes  near and far of the last two, and of inverse depth without a scale
    ends  raw values that are put at the two ends of depth without a scale; the default is the smallest and the largest

    Raises ValueError if a disparity has no baseline, or if depth without a scale does not vary.
    """
    if kind in ("z", "inverse") and scale is None:
        return _spread(raw, kind, note, dtype, ends, planes)
    if kind in RANGED:
        return _between(raw, kind, scale or 1.0, planes or NearFar(NEAREST, FARTHEST, 0.0), note, dtype)
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


def _between(
    raw: NDArray[Any], kind: str, scale: float, planes: NearFar, note: Note, dtype: type[np.floating]
) -> NDArray[Any]:
    """Metres between two planes. A buffer's 1 is background, 0 that of one of reversed z."""
    near, far, lowest = planes
    result, lost = np.zeros(raw.shape, dtype), 0
    has_zero = kind == "reversed" and not _stands_out(raw, scale)
    for rows in blocks(raw):
        values = raw[rows] / scale
        known = np.isfinite(values) & (values >= lowest)
        if kind == "reversed":
            known &= (values > 0) | has_zero
            metres = far - values * (far - near)
        else:
            lost += np.count_nonzero(values == 1) if near < far else 0
            known &= (values < 1) | (near > far)
            known &= (values != 0) | (lowest < 0)
            metres = (1 - lowest) / ((1 - values) / near + (values - lowest) / far)
        result[rows] = np.where(known, metres, 0)
    if lost:
        note(f"{lost / raw.size:.1%} of the depth buffer is 1, where nothing was drawn: missing")
    return result


_GAP = 0.1  # of the range of all other values: between them and a 0 that means missing


def _stands_out(raw: NDArray[Any], scale: float) -> bool:
    """Return whether 0 is far from all other values."""
    known = raw[np.isfinite(raw) & (raw > 0)]
    return bool(known.size) and float(known.min()) > _GAP * float(np.ptp(known))


def _ray_lengths(camera: Camera, rows: slice) -> NDArray[np.float64]:
    """(n, w) length of ((u-cx)/fx, (v-cy)/fy, 1) in these rows."""
    x, y = camera.ray_at(np.arange(camera.width), np.arange(camera.height)[rows])
    return np.sqrt(x * x + (y * y)[:, None] + 1)


def _spread(
    raw: NDArray[Any], kind: str, note: Note, dtype: type[np.floating], ends: tuple[float, float] | None,
    planes: NearFar | None,
) -> NDArray[Any]:  # fmt: skip
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
    near, far = (NEAREST, FARTHEST) if planes is None else planes[:2]
    title, least, most = ("inverse depth", far, near) if is_inverse else ("depth", near, far)
    if low == high:
        raise ValueError(f"{title} must vary, got {low:g} everywhere")
    if ends is None and planes is None:
        true = f"{option('near')} and {option('far')} with {option('depth_kind', 'inverse')}"
        way_out = f"; wrong ones bend surfaces: pass the true ones as {true} if you know them" if is_inverse else ""
        note(f"{title} has no scale: its largest value is put at {most:g} m, its smallest at {least:g} m{way_out}")
    low, high = ends or (low, high)
    first, last = (1 / least, 1 / most) if is_inverse else (least, most)
    smallest = 1 / (_BEYOND * far) if is_inverse else near / _BEYOND
    for rows in blocks(raw):
        values = raw[rows].astype(np.float64)
        known = np.isfinite(values)
        laid = first + (np.where(known, values, low) - low) / (high - low) * (last - first)
        laid = np.maximum(laid, smallest)  # what comes into a film may lie beyond the ends of its first picture
        result[rows] = np.where(known, 1 / laid if is_inverse else laid, 0)
    return result


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
