"""Mirror of shaders/common/film_planes.glsl."""

from __future__ import annotations

import numpy as np

F = np.float32


def unfolded_normal(place: np.ndarray) -> np.ndarray:
    p = place * F(2) - F(1)
    z = np.abs(p[..., :1]) + np.abs(p[..., 1:]) - F(1)
    inward = np.maximum(z, F(0))
    normal = np.concatenate([p - np.where(p >= 0, inward, -inward), z], -1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def color_of_luma(luma: np.ndarray, chromas: np.ndarray) -> np.ndarray:
    cb, cr = np.split(chromas - F(128 / 255), 2, -1)
    rgb = [F(1.402) * cr, F(-0.344136) * cb - F(0.714136) * cr, F(1.772) * cb]
    return np.clip(luma + np.concatenate(rgb, -1), F(0), F(1))
