"""Converts raw depth values to metres along the optical axis, for the six kinds of depth."""

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
class Said:
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
    """What the raw values of a depth picture mean.

    scale    values per metre (see `to_metres`); None for z or inverse depth without any
    why      how kind and scale were found, in a few words
    repairs  what makes plain numbers of the raw values, in this order (see `depth_repairs`)
    said     what was given before
    enlarged how many pixels along a side are one of the depth as it was made, see `enlarged_depth`
    """

    kind: str
    scale: float | None
    why: str
    repairs: tuple[str, ...] = ()
    said: Said | None = None
    enlarged: int = 1


class Decoded(NamedTuple):
    """Plain numbers (h, w), of which `to_metres` makes metres, and what they mean."""

    values: NDArray[Any]
    coding: Coding


@np.errstate(all="ignore")  # what overflows is infinite, and missing in the frame
def to_metres(
    raw: NDArray[Any],
    camera: Camera,
    kind: str,
    scale: float | None,
    baseline: float | None,
    note: Note,
    dtype: type[np.floating] = np.float64,
    doffs: float = 0.0,
    ends: tuple[float, float] | None = None,
) -> NDArray[Any]:
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
        values, known = _finite(raw[rows])
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
        values, known = _finite(raw[rows])
        laid = first + (np.where(known, values, low) - low) / (high - low) * (last - first)
        laid = np.maximum(laid, smallest)  # what comes into a film may lie beyond the ends of its first picture
        result[rows] = np.where(known, 1 / laid if is_inverse else laid, 0)
    return result


def _finite(raw: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The values, and which of them are finite."""
    values = raw.astype(np.float64)
    return values, np.isfinite(values)
