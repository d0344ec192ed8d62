"""3-D Gaussians (Kerbl et al. 2023) as the points of a cloud: each becomes a disc of its colour, size and direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from .found_points import FoundPoints, side_by_side

_OPACITY = ("opacity",)
_COLOR = ("f_dc_0", "f_dc_1", "f_dc_2")
_SCALE = ("scale_0", "scale_1", "scale_2")
_TURN = ("rot_0", "rot_1", "rot_2", "rot_3")  # w first
_FAINT = 0.4  # opacity below which one is left out
_HARMONIC = 0.28209479177387814  # of degree 0
_RADIUS = 2.0  # deviations: a disc that fades as (1 - r^2)^2 is nearest to a Gaussian of half its radius
_FLAT = 0.4  # of the middle axis is the shortest one of a disc
_GIANT = 0.99, 4.0  # quantile of the radii, and how many times that is too large
_STEEPEST = 40.0  # exponents beyond overflow float32
_AT_A_TIME = 1 << 18


def is_of_gaussians(columns: Mapping[str, NDArray[Any]]) -> bool:
    return {*_OPACITY, *_COLOR, *_SCALE, *_TURN} <= columns.keys()


def gaussians_in(columns: Mapping[str, NDArray[Any]], form: str, name: str, note: Note) -> FoundPoints:
    """The points of the columns of a Gaussian .ply. Faint ones are left out, and giants, which are fog."""
    opacity = 1 / (1 + np.exp(-columns["opacity"].astype(np.float32).clip(-_STEEPEST, _STEEPEST)))
    kept = np.flatnonzero(opacity >= _FAINT)
    scales = np.sort(np.stack([columns[one][kept] for one in _SCALE], -1).astype(np.float32), -1)
    radii = _RADIUS * np.exp(scales[:, 1].clip(-_STEEPEST, _STEEPEST))
    if len(kept):
        quantile, times = _GIANT
        is_small = radii <= times * np.quantile(radii[np.isfinite(radii)], quantile) if np.isfinite(radii).any() else []
        kept, radii = kept[is_small], radii[is_small]
    note(f"{name}: {len(kept)} of {len(opacity)} Gaussians are opaque discs of usual size; the others are left out")
    return FoundPoints(
        form,
        side_by_side([columns[one] for one in "xyz"])[kept],
        np.concatenate([_normals(columns, part) for part in _parts(kept)] or [np.empty((0, 3), np.float32)]),
        _colors(columns, kept),
        sizes=radii,
        up="-y",
        up_from="usual of reconstructions",
        up_is_guessed=True,
    )


def _parts(rows: NDArray[Any]) -> list[NDArray[Any]]:
    return [rows[at : at + _AT_A_TIME] for at in range(0, len(rows), _AT_A_TIME)]


def _colors(columns: Mapping[str, NDArray[Any]], rows: NDArray[Any]) -> NDArray[np.uint8]:
    dc = np.stack([columns[one][rows] for one in _COLOR], -1).astype(np.float32)
    return np.rint(np.nan_to_num(255 * (0.5 + np.float32(_HARMONIC) * dc)).clip(0, 255)).astype(np.uint8)


def _normals(columns: Mapping[str, NDArray[Any]], rows: NDArray[Any]) -> NDArray[np.float32]:
    """(n, 3) the shortest axes of those that are flat, 0 of all others."""
    scales = np.stack([columns[one][rows] for one in _SCALE], -1).astype(np.float64)
    w, x, y, z = (columns[one][rows].astype(np.float64) for one in _TURN)
    axes = np.stack(  # [n, k]: where the k-th axis points, times the square of the quaternion's length
        [
            np.stack([w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)], -1),
            np.stack([2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)], -1),
            np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], -1),
        ],
        1,
    )
    shortest = axes[np.arange(len(rows)), scales.argmin(1)]
    shortest /= np.linalg.norm(shortest, axis=1, keepdims=True)
    ordered = np.sort(scales, 1)
    is_flat = (ordered[:, 0] - ordered[:, 1] < np.log(_FLAT)) & np.isfinite(shortest).all(1)
    return np.where(is_flat[:, None], shortest, 0).astype(np.float32)
