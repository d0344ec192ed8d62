"""Mirror of shaders/common/sample_mean.glsl."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb

F = np.float32


def developed(surfaces: np.ndarray, ground: np.ndarray, count: float, background: np.ndarray) -> np.ndarray:
    mean = np.concatenate([surfaces[..., :3], surfaces[..., 3:] + ground[..., None]], -1) / F(count)
    light = mean[..., :3] + (F(1) - mean[..., 3:]) * background[3] * background[:3]
    alpha = mean[..., 3:] * (F(1) - background[3]) + background[3]
    color = linear_to_srgb(np.clip(light / np.maximum(alpha, F(1e-6)), F(0), F(1)))
    return np.concatenate([color, alpha], -1)
