"""Mirror of shaders/common/texels.glsl."""

from __future__ import annotations

import numpy as np

from .vectors import texel


def texel_at(map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    return texel(map, pixel)


def texel_or_zero(map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    near = np.clip(pixel, 0, np.array(map.shape[1::-1]) - 1)
    return np.where((pixel == near).all(-1, keepdims=True), texel(map, near), 0)


def depth_at(depth_map, pixel, offset):
    """Return depth (h, w) float32 `offset` = (du, dv) pixels away, 0 outside; `pixel` is the whole grid."""
    (height, width), (du, dv) = depth_map.shape, offset
    moved = np.zeros_like(depth_map)
    if abs(du) < width and abs(dv) < height:
        to = np.s_[max(-dv, 0) : height + min(-dv, 0), max(-du, 0) : width + min(-du, 0)]
        moved[to] = depth_map[max(dv, 0) : height + min(dv, 0), max(du, 0) : width + min(du, 0)]
    return moved


def depth_and_noise_at(picture, pixel, offset):
    """Return (h, w, 2) float32 depth and relative noise `offset` = (du, dv) away, 0 outside."""
    return np.stack([depth_at(picture[..., k], pixel, offset) for k in (0, 1)], -1)
