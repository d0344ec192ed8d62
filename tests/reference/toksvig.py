"""Mirror of shaders/common/toksvig.glsl."""

from __future__ import annotations

import numpy as np

from .picture import rescale_position
from .vectors import texel

F = np.float32
WANDERING, LEAST_CERTAINTY, LEAST_SHARE = F(4), F(0.4), F(0.4)


def normal_certainty(variance: np.ndarray) -> np.ndarray:
    return F(1) / (F(1) + variance)


def mean_certainty(share: np.ndarray, others: float) -> np.ndarray:
    return normal_certainty(np.maximum(F(1) / np.maximum(share, F(0.5)) - F(1), F(0)) / F(others))


def certainty_at(certainty_map: np.ndarray, at: np.ndarray, size: np.ndarray) -> np.ndarray:
    """(..., 1), bilinear; certainty_map (rows, columns) float32."""
    last = np.array(certainty_map.shape[::-1]) - 1
    position = rescale_position(at, size, last.astype(F) + F(1))
    low = np.floor(position).astype(int)
    share = (position - low).astype(F)
    low, high = np.clip(low, 0, last), np.clip(low + 1, 0, last)
    across, down = share[..., 0], share[..., 1]
    top = texel(certainty_map, low) * (F(1) - across) + texel(certainty_map, _right(high, low)) * across
    bottom = texel(certainty_map, _right(low, high)) * (F(1) - across) + texel(certainty_map, high) * across
    return (top * (F(1) - down) + bottom * down)[..., None]


def widened(material: np.ndarray, certainty: np.ndarray) -> np.ndarray:
    """(..., 4), of a material (4,) and certainties (..., 1)."""
    share = certainty / (certainty + F(4) * material[3] * (F(1) - certainty))
    fade = np.clip(certainty / LEAST_CERTAINTY, F(0), F(1))
    dimmed = (F(1) + share * material[3]) / (F(1) + material[3]) * fade * fade * (F(3) - F(2) * fade)
    same = np.broadcast_to(material[:2], (*share.shape[:-1], 2))
    return np.concatenate([same, dimmed * material[2], np.maximum(share, LEAST_SHARE) * material[3]], -1).astype(F)


def _right(column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """The pixel in one's column and the other's row."""
    return np.stack([column[..., 0], row[..., 1]], -1)
