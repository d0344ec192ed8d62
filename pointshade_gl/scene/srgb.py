"""sRGB and linear light (IEC 61966-2-1): 0 to 1 both ways, and 8-bit pictures of linear light."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def srgb_to_linear(encoded: NDArray[np.floating[Any]] | float) -> NDArray[Any]:
    """Return the linear light of sRGB, 0 to 1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(linear: NDArray[np.floating[Any]] | float) -> NDArray[Any]:
    """Return linear light as sRGB, 0 to 1."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


def linear_to_bytes(linear: NDArray[Any]) -> NDArray[np.uint8]:
    """Return linear light from 0 to 1 as 8-bit sRGB."""
    return np.rint(linear_to_srgb(linear) * 255).astype(np.uint8)
