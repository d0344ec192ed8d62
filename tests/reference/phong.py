"""Mirror of shaders/common/phong.glsl."""

from __future__ import annotations

import numpy as np

from .vectors import dot

F = np.float32


def attenuation(distance: np.ndarray, k: np.ndarray) -> np.ndarray:
    return F(1) / (k[0] + k[1] * distance + k[2] * distance * distance)


def phong(
    n: np.ndarray,
    v: np.ndarray,
    l: np.ndarray,  # noqa: E741 (the field's name)
    albedo: np.ndarray,
    material: np.ndarray,
    light: np.ndarray,
) -> np.ndarray:
    """material (4,), or (n, 4) of each surface."""
    NoL = dot(n, l)
    r = F(2) * NoL * n - l
    result = material[..., 1:2] * NoL * albedo
    if (material[..., 2] > 0).any():
        result = result + material[..., 2:3] * np.maximum(dot(r, v), F(0)) ** material[..., 3:]
    return np.where(NoL <= 0, F(0), result * light)
