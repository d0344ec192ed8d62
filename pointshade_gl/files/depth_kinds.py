"""From raw depth values to metres along the optical axis: units, markers for missing, and the five kinds of depth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..checks import check_positive
from ..notes import Note
from ..wording import option

KINDS = ("z", "ray", "plane", "inverse", "disparity")
FAR = 65500  # from here on a 16-bit value says "missing": 65535 in ScanNet and 7-Scenes, 65504 the largest half
NEAREST, FARTHEST = 1.0, 10.0  # metres between which inverse depth without a scale is laid
_MILLIMETRES = 1000.0


def choose_scale(raw: NDArray[Any], kind: str, given: float | None, filed: float | None, note: Note) -> float | None:
    """What raw values are divided by. None: inverse depth without any.

    given is the caller's, filed that of the intrinsics file. Raises ValueError for 8-bit depth without the caller's.
    """
    if given is not None:
        return check_positive(given, option("depth_scale"))
    metric = kind not in ("inverse", "disparity")
    if metric and raw.dtype.itemsize == 1:
        raise ValueError(
            f"depth has 8 bits, and 256 levels are no distances: pass {option('depth_kind', 'inverse')} for a "
            f"network's output, or {option('depth_scale')} (levels per metre) to insist"
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


@np.errstate(over="ignore", invalid="ignore")  # what overflows is infinite, and missing in the frame
def to_metres(
    raw: NDArray[Any], camera: Camera, kind: str, scale: float | None, baseline: float | None, note: Note
) -> NDArray[np.float64]:
    """(h, w) z in metres, 0 where missing, from raw values of one of KINDS.

    z          raw / scale is z along the optical axis
    ray        raw / scale is the distance along the pixel's ray
    plane      the same, from the image plane at unit focal length: P = ray * (|ray| + v) / |ray|
    inverse    z = scale / raw; without a scale 1/z up to scale and offset, laid between 1 and 10 m
    disparity  z = fx * baseline / (raw / scale), baseline in metres

    Raises ValueError when a disparity has no baseline, or inverse depth does not vary.
    """
    values = raw.astype(np.float64)
    if kind == "inverse" and scale is None:
        return _spread(values, note)
    _drop_markers(raw, values, kind, note)
    values[~((values > 0) & (values < np.inf))] = 0
    _drop_background(values, note)
    known = values > 0
    result = np.zeros_like(values)
    result[known] = _convert(values[known], _ray_lengths(camera)[known], camera, kind, scale or 1.0, baseline)
    return result


def _convert(
    values: NDArray[np.float64],
    ray: NDArray[np.float64],
    camera: Camera,
    kind: str,
    scale: float,
    baseline: float | None,
) -> NDArray[np.float64]:
    if kind == "ray":
        return values / scale / ray
    if kind == "plane":
        return (ray + values / scale) / ray
    if kind == "inverse":
        return scale / values
    if kind == "disparity":
        if baseline is None:
            raise ValueError(f"disparity needs the distance of the two cameras: pass {option('baseline')} in metres")
        baseline = check_positive(baseline, option("baseline"))
        return camera.fx * baseline * scale / values
    return values / scale


def _ray_lengths(camera: Camera) -> NDArray[np.float64]:
    """(h, w) length of ((u-cx)/fx, (v-cy)/fy, 1)."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    return np.sqrt(x * x + (y * y)[:, None] + 1)


def _spread(values: NDArray[np.float64], note: Note) -> NDArray[np.float64]:
    """Inverse depth of unknown scale and offset, as networks give it: 0 is the farthest, not missing."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros_like(values)
    low, high = values[known].min(), values[known].max()
    if low == high:
        raise ValueError(f"inverse depth must vary, got {low:g} everywhere")
    note(f"inverse depth has no scale: its largest value is put at {NEAREST:g} m, its smallest at {FARTHEST:g} m")
    share = (np.where(known, values, low) - low) / (high - low)
    return np.where(known, 1 / (1 / FARTHEST + share * (1 / NEAREST - 1 / FARTHEST)), 0)


def _drop_markers(raw: NDArray[Any], values: NDArray[np.float64], kind: str, note: Note) -> None:
    # in inverse depth and disparity the largest values are the nearest points, not markers
    if raw.dtype.kind != "u" or raw.dtype.itemsize != 2 or kind in ("inverse", "disparity"):
        return
    marked = raw >= FAR
    if marked.any():
        values[marked] = 0
        note(f"{np.count_nonzero(marked)} depth values from {FAR} to 65535 are taken as missing")


def _drop_background(values: NDArray[np.float64], note: Note) -> None:
    """Sets to 0 what a renderer wrote where it saw nothing: one extreme value in many pixels, far from all others."""
    known = values[values > 0]
    if not known.size:
        return
    for value in (known.max(), known.min()):
        others = known[known != value]
        share = (known.size - others.size) / known.size
        if not 0.02 <= share < 0.999:  # below: a few outliers; above: the others are, and this is the surface
            continue
        if value > 2 * others.max() or 2 * value < others.min():
            values[values == value] = 0
            note(f"the depth value {value:g} of {share:.0%} of the pixels is taken as background, that is, missing")
            return
