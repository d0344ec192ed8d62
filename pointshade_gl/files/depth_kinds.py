"""From raw depth values to metres along the optical axis: units, and the five kinds of depth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..checks import check_positive
from ..notes import Note
from ..wording import option
from .depth_values import blocks, known_values

KINDS = ("z", "ray", "plane", "inverse", "disparity")
NEAREST, FARTHEST = 1.0, 10.0  # metres between which inverse depth without a scale is laid
_MILLIMETRES = 1000.0


def choose_scale(raw: NDArray[Any], kind: str, given: float | None, filed: float | None, note: Note) -> float | None:
    """The number by which raw values are divided; None for inverse depth without a scale.

    given  the caller's; filed  that of the intrinsics file

    Raises ValueError for 8-bit depth without a scale from the caller.
    """
    if given is not None:
        return check_positive(given, option("depth_scale"))
    metric = kind not in ("inverse", "disparity")
    if metric and raw.dtype.itemsize == 1:
        raise ValueError(
            f"depth has 8 bits, and 256 levels are too few for distances: pass {option('depth_kind', 'inverse')} for a "
            f"network's output, or {option('depth_scale')} (levels per metre) to use it as it is"
        )
    if filed is not None:
        if raw.dtype.kind == "f" and filed != 1:
            note(
                f"floating point depth is divided by {filed:g}, as the intrinsics file says; "
                f"pass {option('depth_scale', 1)} if it is in metres"
            )
        return filed
    if kind == "inverse":
        return None
    if metric and raw.dtype.kind != "f":
        note(f"depth is of integers, without {option('depth_scale')}: taken as millimetres (1000 per metre)")
        return _MILLIMETRES
    if raw.dtype.kind != "f":
        note(f"disparity is of integers, without {option('depth_scale')}: taken as pixels")
    return 1.0


@np.errstate(all="ignore")  # what overflows is infinite, and missing in the frame
def to_metres(
    raw: NDArray[Any],
    camera: Camera,
    kind: str,
    scale: float | None,
    baseline: float | None,
    note: Note,
    dtype: type[np.floating] = np.float64,
) -> NDArray[Any]:
    """(h, w) z in metres of the type, 0 where missing, from raw values of one of KINDS.

    z          raw / scale is z along the optical axis
    ray        raw / scale is the distance along the pixel's ray
    plane      the same, from the image plane at unit focal length: P = ray * (|ray| + v) / |ray|
    inverse    z = scale / raw; without a scale 1/z up to scale and offset, laid between 1 and 10 m
    disparity  z = fx * baseline / (raw / scale), baseline in metres

    Raises ValueError if a disparity has no baseline, or if inverse depth does not vary.
    """
    if kind == "inverse" and scale is None:
        return _spread(raw, note, dtype)
    if kind == "disparity":
        if baseline is None:
            raise ValueError(f"disparity needs the distance of the two cameras: pass {option('baseline')} in metres")
        baseline = check_positive(baseline, option("baseline"))
    values = known_values(raw, kind, note)
    result = np.empty(raw.shape, dtype)
    for rows in blocks(raw):
        result[rows] = _convert(values(rows), rows, camera, kind, scale or 1.0, baseline or 0.0)
    return result


def _convert(
    values: NDArray[np.float64], rows: slice, camera: Camera, kind: str, scale: float, baseline: float
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
    else:
        metres = camera.fx * baseline * scale / values
    return np.where(values > 0, metres, 0)


def _ray_lengths(camera: Camera, rows: slice) -> NDArray[np.float64]:
    """(n, w) length of ((u-cx)/fx, (v-cy)/fy, 1) in these rows."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height)[rows] - camera.cy) / camera.fy
    return np.sqrt(x * x + (y * y)[:, None] + 1)


def _spread(raw: NDArray[Any], note: Note, dtype: type[np.floating]) -> NDArray[Any]:
    """Inverse depth of unknown scale and offset, as networks give it: 0 is the farthest, not missing."""
    result = np.zeros(raw.shape, dtype)
    low, high = np.inf, -np.inf
    for rows in blocks(raw):
        values = raw[rows].astype(np.float64)
        known = np.isfinite(values)
        low, high = min(low, values.min(where=known, initial=low)), max(high, values.max(where=known, initial=high))
    if low > high:
        return result
    if low == high:
        raise ValueError(f"inverse depth must vary, got {low:g} everywhere")
    note(f"inverse depth has no scale: its largest value is put at {NEAREST:g} m, its smallest at {FARTHEST:g} m")
    for rows in blocks(raw):
        values = raw[rows].astype(np.float64)
        known = np.isfinite(values)
        share = (np.where(known, values, low) - low) / (high - low)
        result[rows] = np.where(known, 1 / (1 / FARTHEST + share * (1 / NEAREST - 1 / FARTHEST)), 0)
    return result
