"""Mirror of shaders/common/color.glsl."""

from __future__ import annotations

import numpy as np

F = np.float32


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    low = encoded / F(12.92)
    high = ((encoded + F(0.055)) / F(1.055)) ** F(2.4)
    return np.where(encoded < F(0.04045), low, high)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    low = linear * F(12.92)
    high = F(1.055) * linear ** F(1 / 2.4) - F(0.055)
    return np.where(linear < F(0.0031308), low, high)
