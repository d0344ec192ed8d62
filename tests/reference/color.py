"""Mirror of shaders/common/color.glsl."""

from __future__ import annotations

import numpy as np

F = np.float32


def srgb_to_linear(e: np.ndarray) -> np.ndarray:
    high = F(0.0872854) * e - F(0.3073866)
    for coefficient in (F(0.6671696), F(0.5193783), F(0.0327467), F(0.0009169)):
        high = high * e + coefficient
    return np.where(e < F(0.04045), e / F(12.92), high)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    root2 = np.sqrt(linear)
    root4 = np.sqrt(root2)
    root8 = np.sqrt(root4)
    high = F(0.6423769) * root2 + F(0.7120979) * root4 - F(0.3368648) * root8 - F(0.0175668) * linear
    return np.where(linear < F(0.0031308), linear * F(12.92), high)
