"""Interprets cameras of bare numbers: four, a matrix, or with a size. The numbers show which form it is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .intrinsics import Intrinsics, Numbers

_SQUARE = 0.05  # fx and fy of a lens differ by less
_APART = 0.2  # and from cx or cy by more, where the order of four numbers is to be found


def from_matrix(values: Sequence[float] | NDArray[np.float64]) -> Numbers | None:
    """fx, fy, cx, cy of a 3x3, 3x4 or 4x4 matrix, by rows or by columns, or of four numbers; None for anything else."""
    array = np.asarray(values, np.float64).ravel()
    if array.size == 4:
        return _of_four(*array.tolist())
    if array.size not in (9, 12, 16):
        return None
    k = array.reshape((3, -1) if array.size == 12 else (int(array.size**0.5), -1))[:3, :3]
    if k[2, 0] and k[2, 1] and not (k[0, 2] or k[1, 2]):
        k = k.T  # written by columns
    if abs(k[2] - (0, 0, 1)).max() > 1e-6 or k[1, 0] != 0 or not (k[0, 0] and k[1, 1]):
        return None
    return float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])


def _of_four(a: float, b: float, c: float, d: float) -> Numbers:
    """fx, fy, cx, cy; or fx, cx, fy, cy, as OpenLORIS writes them: the two focal lengths are alike."""
    is_crossed = abs(c) and abs(a / c - 1) < _SQUARE and abs(b) and abs(a / b - 1) > _APART
    return (a, c, b, d) if is_crossed else (a, b, c, d)


def from_numbers(values: NDArray[np.float64], name: str) -> Intrinsics | None:
    """A camera of nothing but numbers: a focal length, four, a matrix, one with a baseline, a range or a size; or None.

    With a size: `width height fx fy cx cy` (ARKitScenes; Matterport3D with five of distortion) or `fx fy cx cy width
    height`.
    """
    if values.size == 1 and values[0] > 1:
        return Intrinsics(name, (float(values[0]), math.nan, math.nan, math.nan))
    if values.size == 10 and (matrix := from_matrix(values[:9])):  # FoundationStereo's K.txt
        return Intrinsics(name, matrix, baseline=float(values[9]))
    if values.size == 12 and values[9] >= 1 and values[10] == 0 < values[11] and (matrix := from_matrix(values[:9])):
        # of Peng et al., "Depth super-resolution meets uncalibrated photometric stereo", 2017: a factor, and the least
        # and the largest millimetres, which 16 bits fill
        return Intrinsics(name, matrix, depth_scale=65535 / (float(values[11]) / 1000))
    first = values[:6].tolist() if values.size in (6, 11) else []
    for width, height, fx, fy, cx, cy in (first, (*first[4:], *first[:4])) if first else ():
        if width % 1 == height % 1 == 0 and 0 < cx < width and 0 < cy < height and fx > 0 and fy > 0:
            return Intrinsics(name, (fx, fy, cx, cy), (int(width), int(height)))
    four = from_matrix(values)
    return Intrinsics(name, four) if four else None
