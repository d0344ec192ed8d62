"""Mirror of shaders/common/sample_mean.glsl."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb
from .texels import texel_at

F = np.float32
PATTERN = 4


def smooth_ground(grounds: np.ndarray, sums: np.ndarray, pixel: np.ndarray, count: float) -> np.ndarray:
    last = np.array(sums.shape[1::-1]) - 1
    own = F(count) - texel_at(sums, pixel)[..., 3]
    around, whole = np.zeros_like(own), np.zeros_like(own)
    for k in range((PATTERN + 1) ** 2):
        off = np.array([k % (PATTERN + 1), k // (PATTERN + 1)]) - PATTERN // 2
        place = pixel + off
        place = np.clip(place + PATTERN * ((place < 0).astype(int) - (place > last)), 0, last)
        weight = F(np.where(np.abs(off) == PATTERN // 2, 0.5, 1).prod())
        around += weight * texel_at(grounds, place)[..., 1]
        whole += weight * np.maximum(F(count) - texel_at(sums, place)[..., 3], F(0))
    some = (own > 0) & (whole > 0)
    return texel_at(grounds, pixel)[..., 0] + np.where(some, own * around / np.where(some, whole, F(1)), F(0))


def developed(surfaces: np.ndarray, ground: np.ndarray, count: float, background: np.ndarray) -> np.ndarray:
    mean = np.concatenate([surfaces[..., :3], surfaces[..., 3:] + ground[..., None]], -1) / F(count)
    light = mean[..., :3] + (F(1) - mean[..., 3:]) * background[3] * background[:3]
    alpha = mean[..., 3:] * (F(1) - background[3]) + background[3]
    color = linear_to_srgb(np.clip(light / np.maximum(alpha, F(1e-6)), F(0), F(1)))
    return np.concatenate([color, alpha], -1)
