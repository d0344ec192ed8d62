"""Mirror of shaders/common/cloud_front.glsl: the pictures are (h, w) of 1 - near/z, pixels (..., 2) as (u, v)."""

from __future__ import annotations

import numpy as np

from .vectors import texel

F = np.float32
FARTHEST_RING = F(60)
PAIRS = 3
RINGS = 3
SAME = F(0.5)


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


def is_before(other: np.ndarray, z: np.ndarray, step_back: float) -> np.ndarray:
    return (other > 0) & ((z == 0) | (z - other > F(step_back)))


def around_hole(
    cores: np.ndarray, pixel: np.ndarray, near: float, z: np.ndarray, step_back: float, distance: np.ndarray, pairs: int
) -> np.ndarray:
    """(..., 3)"""
    count, total, low, high = (np.zeros(z.shape, F) for _ in range(4))
    for k in range(pairs):
        aside = ring_step(k, distance)
        one, other = (front_depth(cores, pixel + side, near) for side in (aside, -aside))
        counts = is_before(one, z, step_back) & is_before(other, z, step_back)
        middle = F(0.5) * (one + other)
        low = np.where(counts, np.where(count == 0, middle, np.minimum(low, middle)), low)
        high = np.where(counts, np.maximum(high, middle), high)
        total = np.where(counts, total + middle, total)
        count = count + counts.astype(F)
    return np.stack([count, total / np.maximum(count, F(1)), high - low], -1)


def shows_surface(around: np.ndarray, step_back: float) -> np.ndarray:
    return (around[..., 0] >= PAIRS) & (around[..., 2] <= SAME * F(step_back))


def closed_depth(cores: np.ndarray, pixel: np.ndarray, near: float, step_back: float, ring: np.ndarray) -> np.ndarray:
    """(...)"""
    z = front_depth(cores, pixel, near)
    usual = np.full(z.shape, np.clip(F(2) * F(ring[1]), F(2), FARTHEST_RING), F)
    beside = around_hole(cores, pixel, near, z, step_back, usual, 4)
    distance = np.clip(F(ring[0]) / np.maximum(beside[..., 1], F(near)), F(1), FARTHEST_RING)
    result = z
    for k in range(RINGS, 0, -1):
        around = around_hole(cores, pixel, near, z, step_back, distance * F(k), 4)
        result = np.where((beside[..., 0] > 0) & shows_surface(around, step_back), around[..., 1], result)
    return result
