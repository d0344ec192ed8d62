"""Mirror of shaders/common/normal_variance.glsl, for many pixels (n, 2) integers at once."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .splat_corners import surface_at
from .vectors import dot

F = np.float32
APART, SAME_SIDE, SAME_PLACE, ENOUGH, UNLIKE, UNSHARED = 8, F(0.87), F(8), F(6.5), F(1), F(0.45)


def surface_beside(surface_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    last = np.array(surface_map.shape[1::-1]) - 1
    inside = np.clip(pixel, 0, last)
    return np.where((inside == pixel).all(-1, keepdims=True), surface_at(surface_map, inside), F(0))


def known_pixel(surface_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    found = pixel
    for k in range(8, -1, -1):
        beside = pixel + 2 * (np.array(((k + 4) % 3, (k + 4) // 3 % 3)) - 1)
        found = np.where(surface_beside(surface_map, beside)[:, 3:] > 0, beside, found)
    return found


def variance_apart(surface_map: np.ndarray, pixel: np.ndarray, intrinsics: np.ndarray, apart: int) -> np.ndarray:
    """(n,)"""
    own = surface_beside(surface_map, pixel)
    point = pixel_ray(pixel.astype(F), intrinsics) * own[:, 3:]
    far = SAME_PLACE * own[:, 3:] * F(2) / (abs(intrinsics[0]) + abs(intrinsics[1]))
    s, su, sv, suu, suv, svv, squares = (np.zeros((len(pixel), 1), F) for _ in range(7))
    sd, sud, svd = (np.zeros((len(pixel), 3), F) for _ in range(3))
    for k in range(25):
        u, v = F(k % 5 - 2), F(k // 5 - 2)
        there = pixel + apart * np.array((k % 5 - 2, k // 5 - 2))
        surface = surface_beside(surface_map, there)
        way = pixel_ray(there.astype(F), intrinsics) * surface[:, 3:] - point
        along = dot(surface[:, :3], own[:, :3])
        m = ((along > SAME_SIDE) & (np.abs(dot(way, own[:, :3])) < far)).astype(F)
        d = m * (surface[:, :3] - along * own[:, :3])
        s += m
        su += m * u
        sv += m * v
        suu += m * u * u
        suv += m * u * v
        svv += m * v * v
        sd += d
        sud += d * u
        svd += d * v
        squares += dot(d, d)
    mean_u, mean_v = su / np.maximum(s, F(1)), sv / np.maximum(s, F(1))
    uu, uv, vv = suu - su * mean_u, suv - su * mean_v, svv - sv * mean_v
    determinant = uu * vv - uv * uv
    enough = (s >= ENOUGH) & (determinant >= F(1))
    s, determinant = np.where(enough, s, ENOUGH), np.where(enough, determinant, F(1))
    mean, ud, vd = sd / s, sud - mean_u * sd, svd - mean_v * sd
    slope_u, slope_v = (vv * ud - uv * vd) / determinant, (uu * vd - uv * ud) / determinant
    rest = squares - s * dot(mean, mean) - dot(slope_u, ud) - dot(slope_v, vd)
    return np.where(enough, np.maximum(rest, F(0)) / (F(2) * (s - F(3))), UNLIKE)[:, 0]


def tilt_variance(surface_map: np.ndarray, pixel: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """(n,)"""
    wide, near = (variance_apart(surface_map, pixel, intrinsics, apart) for apart in (APART, APART // 2))
    return np.where(wide < UNLIKE, wide, near)


def steepest_variance(noise: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """noise (..., 2), as of `noise_at`."""
    tilt = noise[..., 0] * F(0.5) * (abs(intrinsics[0]) + abs(intrinsics[1]))
    return tilt * tilt * (UNSHARED * UNSHARED + noise[..., 1] * noise[..., 1])
