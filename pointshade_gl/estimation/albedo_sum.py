"""Adds up what several photographs of one view say about its albedo, pixel by pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.values import linear_to_srgb, srgb_to_linear
from .light_pairs import Array

CLIPPED = 250  # of 255: a camera may have cut such a colour off
FAINT = 1e-4  # weight of such colours, and of what no photograph shows lit, over that of others


class AlbedoSum:
    """The weighted mean of albedos."""

    def __init__(self) -> None:
        self._sum: Array = np.zeros((1, 1, 4), np.float32)

    def add(self, color: NDArray[np.uint8], albedo: Array, weight: Array, size: tuple[float, float]) -> None:
        """Add what a photograph says.

        color   (h, w, 3|4), the photograph
        albedo  (h, w, 3), sRGB, 0..1
        weight  (rows, columns), of samples
        size    of the photograph, in samples
        """
        height, width = color.shape[:2]
        shares = _between(_between(weight, height, size[1]).T, width, size[0]).T
        shares = np.where(color[..., :3].max(-1) < CLIPPED, shares, 0) + FAINT * float(weight.max()) + 1e-9
        linear = srgb_to_linear(albedo.astype(np.float32))
        self._sum = self._sum + shares[..., None] * np.concatenate([linear, np.ones((height, width, 1))], -1)

    @property
    def color(self) -> NDArray[np.uint8]:
        """(h, w, 3), sRGB"""
        mean = self._sum[..., :3] / np.maximum(self._sum[..., 3:], 1e-12)
        return np.round(255 * linear_to_srgb(np.clip(mean, 0, 1))).astype(np.uint8)


def _between(rows: Array, count: int, samples: float) -> Array:
    """Return that many rows in place of those of samples, linearly between them."""
    at = np.clip((np.arange(count) + 0.5) * (samples / count) - 0.5, 0, len(rows) - 1)
    low = np.minimum(at.astype(int), max(len(rows) - 2, 0))
    part = (at - low)[:, None]
    return (1 - part) * rows[low] + part * rows[np.minimum(low + 1, len(rows) - 1)]
