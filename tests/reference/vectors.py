"""The vector functions that GLSL has built in."""

from __future__ import annotations

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(..., 1), so that it multiplies vectors; summed in the order of the components."""
    product = a * b
    total = product[..., :1]
    for k in range(1, product.shape[-1]):
        total = total + product[..., k : k + 1]
    return total


def length(a: np.ndarray) -> np.ndarray:
    """(..., 1)"""
    return np.sqrt(dot(a, a))


def normalize(a: np.ndarray) -> np.ndarray:
    return a / length(a)


def texel(texture: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    """texelFetch: pixel (..., 2) as (u, v), inside the texture."""
    return texture[pixel[..., 1], pixel[..., 0]]
