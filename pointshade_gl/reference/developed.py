"""Mirror of shaders/common/developed.glsl."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb

F = np.float32
CRACK = F(0.5)


def close_crack(sum: np.ndarray, least: np.ndarray, count: float) -> np.ndarray:
    cracked = np.minimum(sum[..., 3], least) >= CRACK * F(count)
    return np.where(cracked[..., None], sum * (F(count) / np.maximum(sum[..., 3:], F(1e-6))), sum)


def least_beside(alpha: np.ndarray) -> np.ndarray:
    """(h, w) the least value in the 3x3 pixels round each."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(alpha, 1, mode="edge"), (3, 3))
    return around.min((-1, -2))


def developed(sum: np.ndarray, count: float, background: np.ndarray) -> np.ndarray:
    mean = sum / F(count)
    light = mean[..., :3] + (F(1) - mean[..., 3:]) * background[3] * background[:3]
    alpha = mean[..., 3:] * (F(1) - background[3]) + background[3]
    color = linear_to_srgb(np.clip(light / np.maximum(alpha, F(1e-6)), F(0), F(1)))
    return np.concatenate([color, alpha], -1)
