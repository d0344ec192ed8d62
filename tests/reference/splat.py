"""Mirror of shaders/common/splat.glsl."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .camera import pixel_ray, project
from .vectors import dot, length

F = np.float32
MARGIN, EXACT_MARGIN = F(0.1), F(0.02)
ASIDE = F(0.02)
MIN_COSINE = F(0.05)
FLAT = F(0.1)
ENDLESS = F(3)
WIDEST = F(4)


class Footprint(NamedTuple):
    centre: np.ndarray  # (..., 2)
    to_target: np.ndarray  # (..., 4)
    inverse_depth: np.ndarray  # (...,)
    tilt: np.ndarray  # (..., 2)
    bend: np.ndarray  # (..., 2)


def inverse_depth_slope(normal: np.ndarray, ray: np.ndarray, z: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    cosine = np.minimum(dot(normal, ray), -MIN_COSINE * length(ray))
    return normal[..., :2] / (intrinsics[:2] * (cosine * z[..., None]))


def carry_footprint(
    pixel: np.ndarray, z: np.ndarray, normal: np.ndarray, source: np.ndarray, view: np.ndarray, target: np.ndarray
) -> Footprint:
    ray = pixel_ray(pixel, source)
    w = F(1) / z
    slope = inverse_depth_slope(normal, ray, z, source)
    turn, shift = view[:3, :3], view[:3, 3]
    h = ray[..., :1] * turn[:, 0] + ray[..., 1:2] * turn[:, 1] + ray[..., 2:] * turn[:, 2] + shift * w[..., None]
    h_u = turn[:, 0] / source[0] + shift * slope[..., :1]
    h_v = turn[:, 1] / source[1] + shift * slope[..., 1:]
    ahead = h[..., 2] > ASIDE * np.abs(h[..., :2]).max(-1)
    safe = np.where(ahead, h[..., 2], F(1))
    scale = target[:2] / (safe * safe)[..., None]
    columns = [scale * (d[..., :2] * h[..., 2:] - h[..., :2] * d[..., 2:]) for d in (h_u, h_v)]
    centre = project(np.concatenate([h[..., :2], safe[..., None]], -1), target)
    change = np.concatenate([h_u[..., 2:], h_v[..., 2:]], -1)
    tilt = (slope * h[..., 2:] - w[..., None] * change) / (safe * safe)[..., None]
    bend = change / safe[..., None]
    return Footprint(centre, np.concatenate(columns, -1), np.where(ahead, w / safe, F(0)), tilt, bend)


def splat_is_ahead(splat: Footprint, near: float) -> np.ndarray:
    return (splat.inverse_depth > 0) & (splat.inverse_depth * F(near) < 1)


def splat_bends(splat: Footprint, reach: np.ndarray) -> np.ndarray:
    return reach * np.abs(splat.bend).sum(-1)


def splat_bend(splat: Footprint, reach: np.ndarray) -> np.ndarray:
    return np.where((splat_bends(splat, reach) > FLAT)[..., None], splat.bend, F(0))


def splat_reach(size: Any, is_round: bool) -> np.ndarray:
    return size * F(0.70710678 if is_round else 0.5) + MARGIN


def exact_reach(size: Any, is_round: bool) -> np.ndarray:
    return splat_reach(size, is_round) + (EXACT_MARGIN - MARGIN)


def footprint_extent(splat: Footprint, reach: np.ndarray, is_round: bool) -> np.ndarray:
    a, b = splat.to_target[..., :2], splat.to_target[..., 2:]
    bends = splat_bends(splat, reach)
    widening = np.where(bends > FLAT, F(1) / (F(1) - np.minimum(bends, F(1) - F(1) / WIDEST)), F(1))
    if is_round:
        return (widening * reach)[..., None] * np.sqrt(a * a + b * b)
    return (widening * reach)[..., None] * (np.abs(a) + np.abs(b))


def invert_footprint(to_target: np.ndarray) -> np.ndarray:
    a, b, c, d = np.moveaxis(to_target, -1, 0)
    determinant = a * d - c * b
    safe = np.where(determinant == 0, F(1), determinant)
    return np.where((determinant == 0)[..., None], F(0), np.stack([d, -b, -c, a], -1) / safe[..., None])


def carry_offset_back(to_source: np.ndarray, bend: np.ndarray, offset: np.ndarray) -> np.ndarray:
    back = to_source[..., :2] * offset[..., :1] + to_source[..., 2:] * offset[..., 1:]
    ahead = F(1) - dot(bend, back)
    return np.concatenate([back / np.where(ahead == 0, F(1e-30), ahead), ahead], -1)


def footprint_covers(
    to_source: np.ndarray, bend: np.ndarray, offset: np.ndarray, reach: np.ndarray, is_round: bool
) -> np.ndarray:
    back = carry_offset_back(to_source, bend, offset)
    at = back[..., :2]
    inside = dot(at, at)[..., 0] <= reach * reach if is_round else np.abs(at).max(-1) <= reach
    return inside & (back[..., 2] > 0)


def footprint_inverse_depth(splat: Footprint, to_source: np.ndarray, offset: np.ndarray) -> np.ndarray:
    back = to_source[..., :2] * offset[..., :1] + to_source[..., 2:] * offset[..., 1:]
    return np.maximum(splat.inverse_depth + dot(splat.tilt, back)[..., 0], F(0.01) * splat.inverse_depth)


def lies_on_plane(z: np.ndarray, off: np.ndarray, own_z: np.ndarray, slope: np.ndarray, tolerance: float) -> np.ndarray:
    known = (z > 0) & (own_z > 0)
    w = F(1) / np.where(known, own_z, F(1))
    error = np.abs(F(1) / np.where(known, z, F(1)) - (w + dot(slope, off)[..., 0]))
    return known & (error < F(tolerance) * w)
