"""Mirror of shaders/common/frame_reduction.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .color import srgb_to_linear
from .picture import picture_at
from .splat_corners import surface_at

F = np.float32
FLATTEST_COSINE, DEPTH_STEP, STEP_REACH, TAPS = F(0.2), F(0.05), 2, 5


def surface_away_from_steps(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    own, ray = surface_at(surface_map, pixel), pixel_ray(pixel.astype(F), source)
    facing = -(own[..., :3] * ray).sum(-1) >= FLATTEST_COSINE * np.sqrt((ray * ray).sum(-1))
    last = np.array(surface_map.shape[1::-1]) - 1
    low, high = own[..., 3], own[..., 3]
    for v in range(-STEP_REACH, STEP_REACH + 1):
        for u in range(-STEP_REACH, STEP_REACH + 1):
            z = surface_at(surface_map, np.clip(pixel + np.array([u, v]), 0, last))[..., 3]
            low = np.where(z > 0, np.minimum(low, z), low)
            high = np.maximum(high, z)
    is_used = (own[..., 3] > 0) & facing & ~(high > (F(1) + DEPTH_STEP) * low)
    return np.where(is_used[..., None], own, F(0))


def cell_brightness(color_map: np.ndarray, pixel: np.ndarray, size: np.ndarray, cell: int) -> np.ndarray:
    taps = min(cell, TAPS)
    total = np.zeros(pixel.shape[:-1], F)
    for v in range(taps):
        for u in range(taps):
            offset = ((np.array([u, v], F) + F(0.5)) / F(taps) - F(0.5)) * F(cell)
            linear = srgb_to_linear(picture_at(color_map, pixel + offset, size))
            total = total + linear @ np.array([0.2126, 0.7152, 0.0722], F)
    return np.sqrt(total / F(taps * taps))
