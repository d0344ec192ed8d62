"""Mirror of shaders/common/cloud_front.glsl: the pictures are (h, w) of 1 - near/z, pixels (..., 2) as (u, v)."""

from __future__ import annotations

import numpy as np

from .vectors import texel

F = np.float32
MOST_AROUND = 6
FARTHEST_RING = F(60)


def front_depth(cores: np.ndarray, pixel: np.ndarray, near: float) -> np.ndarray:
    """(...)"""
    inside = np.clip(pixel, 0, np.array(cores.shape[::-1]) - 1)
    depth = np.where((inside == pixel).all(-1), texel(cores, inside), F(1))
    known = depth < 1
    return np.where(known, F(near) / np.where(known, F(1) - depth, F(1)), F(0))


def ring_step(direction: int, distance: np.ndarray) -> np.ndarray:
    """distance (...); (..., 2) int"""
    angle = F(0.785398163) * F(direction)
    aside = np.array((np.cos(angle), np.sin(angle)), F)
    return np.floor(np.asarray(distance, F)[..., None] * aside + F(0.5)).astype(int)


def nearer_around(
    cores: np.ndarray, pixel: np.ndarray, near: float, z: np.ndarray, step_back: float, distance: np.ndarray,
    directions: int,
) -> np.ndarray:  # fmt: skip
    """(..., 3)"""
    count, nearest, farthest = (np.zeros(z.shape, F) for _ in range(3))
    for k in range(directions):
        other = front_depth(cores, pixel + ring_step(k, distance), near)
        counts = (other > 0) & ((z == 0) | (z - other >= F(step_back)))
        nearest = np.where(counts, np.where(count == 0, other, np.minimum(nearest, other)), nearest)
        farthest = np.where(counts, np.maximum(farthest, other), farthest)
        count = count + counts.astype(F)
    return np.stack([count, nearest, farthest], -1)


def closed_depth(cores: np.ndarray, pixel: np.ndarray, near: float, step_back: float, ring: np.ndarray) -> np.ndarray:
    """(...)"""
    z = front_depth(cores, pixel, near)
    usual = np.clip(np.full(z.shape, ring[1], F), F(1), FARTHEST_RING)
    beside = nearer_around(cores, pixel, near, z, step_back, usual, 8)
    distance = np.clip(F(ring[0]) / np.maximum(beside[..., 1], F(near)), F(1), FARTHEST_RING)
    around = nearer_around(cores, pixel, near, z, step_back, distance, 8)
    is_closed = (beside[..., 0] > 3) & (around[..., 0] >= MOST_AROUND)
    return np.where(is_closed, around[..., 2], z)
