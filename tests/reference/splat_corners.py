"""Mirror of shaders/common/splat_corners.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .depth_lookup import SAME_SURFACE, look_up_error, neighbour_weight
from .texels import texel_at
from .vectors import dot

F = np.float32


class Corners(NamedTuple):
    low: np.ndarray  # (n, 2) int
    high: np.ndarray
    a: np.ndarray  # (n, 4) float; depth is negative at rims
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray


def surface_at(surface_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    return unmarked(texel_at(surface_map, pixel))


def unmarked(surface: np.ndarray) -> np.ndarray:
    return np.concatenate([surface[..., :3], np.abs(surface[..., 3:])], -1)


def corners_at(surface_map: np.ndarray, at: np.ndarray) -> Corners:
    last = np.array(surface_map.shape[1::-1]) - 1
    low = np.clip(np.floor(at).astype(int), 0, last)
    high = np.clip(np.floor(at).astype(int) + 1, 0, last)
    return Corners(low, high, *(texel_at(surface_map, pixel) for pixel in four(low, high)))


def seen_corner(corners: Corners, at: np.ndarray, w_at: np.ndarray) -> np.ndarray:
    pixels = four(corners.low, corners.high)
    error = [look_up_error(s[..., 3], p.astype(F), at, w_at) for s, p in zip(corners[2:], pixels, strict=True)]
    right_above = error[1] < error[0]
    right_below = error[3] < error[2]
    below = np.where(right_below, error[3], error[2]) < np.where(right_above, error[1], error[0])
    return np.stack([np.where(below, right_below, right_above), below], -1)


def corner_pixel(corners: Corners, side: np.ndarray) -> np.ndarray:
    return np.where(side, corners.high, corners.low)


def corner_surface(corners: Corners, side: np.ndarray) -> np.ndarray:
    right, below = side[..., :1], side[..., 1:]
    surface = np.where(below, np.where(right, corners.d, corners.c), np.where(right, corners.b, corners.a))
    return unmarked(surface)


def are_on_surface(corners: Corners, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray) -> np.ndarray:
    pairs = zip(corners[2:], four(corners.low, corners.high), strict=True)
    found = np.ones(len(pixel), bool)
    for surface, place in pairs:
        expected, z = w + dot(slope, place.astype(F) - pixel)[..., 0], surface[..., 3]
        off = np.abs(F(1) / np.where(z > 0, z, F(1)) - expected)
        found &= (z > 0) & (off <= SAME_SURFACE * w)
    return found


def corner_weights(corners: Corners, at: np.ndarray, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray) -> np.ndarray:
    pixels = four(corners.low, corners.high)
    pairs = zip(corners[2:], pixels, strict=True)
    return np.stack([neighbour_weight(s[..., 3], p.astype(F), at, pixel, w, slope) for s, p in pairs], -1)


def four(low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """The pixels of the corners in the order a, b, c, d."""
    return [np.stack([x[..., 0], y[..., 1]], -1) for y in (low, high) for x in (low, high)]
