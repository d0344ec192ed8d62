"""Mirror of shaders/common/cloud_splat.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .vectors import dot, length, normalize

F = np.float32
GRAZING = F(0.12)
NEAREST_SPLAT = F(2)
OUTLINE = F(0.5)


class CloudSplat(NamedTuple):
    centre: np.ndarray  # (..., 3)
    normal: np.ndarray  # (..., 3)
    radius: np.ndarray  # (..., 1)


class SplatHit(NamedTuple):
    depth: np.ndarray  # (..., 1), 0: it misses
    outside: np.ndarray  # (..., 1)
    normal: np.ndarray  # (..., 3)


def facing(normal: np.ndarray, centre: np.ndarray) -> np.ndarray:
    return np.where(dot(normal, centre) > 0, -normal, normal)


def steeper(n: np.ndarray, centre: np.ndarray) -> np.ndarray:
    ray = normalize(centre)
    cosine = -dot(n, ray)
    across = n + cosine * ray
    flat = cosine < GRAZING
    turned = normalize(np.where(flat, across, F(1))) * np.sqrt(F(1) - GRAZING * GRAZING) - GRAZING * ray
    return np.where(flat, turned, n)


def splat_extent(splat: CloudSplat, intrinsics: np.ndarray) -> np.ndarray:
    c, z = splat.centre, splat.centre[..., 2:]
    along = []
    for k in (0, 1):
        axis = np.zeros_like(c)
        axis[..., k], axis[..., 2] = 1, -c[..., k] / c[..., 2]
        pixels = intrinsics[..., k : k + 1] / z * axis
        along.append(length(pixels - splat.normal * dot(splat.normal, pixels)))
    nearer = z / (z - np.minimum(splat.radius, F(0.5) * z))
    return splat.radius * nearer * np.concatenate(along, -1)


def hit_ball(splat: CloudSplat, offset: np.ndarray, intrinsics: np.ndarray) -> SplatHit:
    z = splat.centre[..., 2:]
    beside, ray = _beside(splat, offset, intrinsics)
    along = dot(beside, ray) / dot(ray, ray)
    closest = z * (beside - along * ray)
    outside = dot(closest, closest) / (splat.radius * splat.radius)
    hits = outside <= 1
    inside = splat.radius * np.sqrt(np.where(hits, F(1) - outside, F(0))) / length(ray)
    normal = (closest - inside * ray) / splat.radius
    return SplatHit(np.where(hits, z * (F(1) - along) - inside, F(0)), outside, np.where(hits, normal, F(0)))


def hit_disc(
    splat: CloudSplat, n: np.ndarray, edge: np.ndarray, offset: np.ndarray, intrinsics: np.ndarray
) -> SplatHit:
    z = splat.centre[..., 2:]
    beside, ray = _beside(splat, offset, intrinsics)
    rise = np.clip(-z * dot(n, beside) / dot(n, ray), F(-2) * splat.radius, F(2) * splat.radius)
    away = z * beside + rise * ray
    outside = dot(away, away) / (splat.radius * splat.radius)
    is_middle = np.abs(offset).max(-1, keepdims=True) <= 0.5
    misses = ((outside > 1) | (dot(away, edge) < 0)) & ~is_middle
    normal = np.broadcast_to(splat.normal, away.shape)
    return SplatHit(np.where(misses, F(0), z + rise), np.where(misses, outside, np.minimum(outside, F(1))), normal)


def outline_normal(normal: np.ndarray, beside: np.ndarray, ray: np.ndarray) -> np.ndarray:
    away = dot(normal, beside) < 0
    turned = dot(normal, ray) * ray - normal
    return np.where(away, normalize(np.where(away, turned, F(1))), normal)


def hit_weight(outside: np.ndarray) -> np.ndarray:
    inside = F(1) - outside
    return inside * inside + F(1e-4)


def facing_weight(normal: np.ndarray, centre: np.ndarray) -> np.ndarray:
    cosine = dot(normal, normalize(centre))
    return cosine * cosine + F(1e-4)


def _beside(splat: CloudSplat, offset: np.ndarray, intrinsics: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far a pixel's ray lies beside the centre's at depth 1, and the ray, both (..., 3)."""
    at = offset / intrinsics[..., :2]
    beside = np.concatenate([at, np.zeros_like(at[..., :1])], -1)
    return beside, splat.centre / splat.centre[..., 2:] + beside
