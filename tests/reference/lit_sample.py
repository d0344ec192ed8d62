"""Mirror of shaders/common/lit_sample.glsl."""

from __future__ import annotations

import numpy as np

from .color import srgb_to_linear
from .picture import picture_at
from .splat_corners import surface_at
from .vectors import dot

F = np.float32
CLIPPED, SAME_SIDE = F(0.93), F(0.95)


def mean_lit_color(
    picture: np.ndarray, surface_map: np.ndarray, pixel: np.ndarray, span: float, aligned: bool
) -> np.ndarray:
    size = np.array(surface_map.shape[1::-1], F)
    centre = surface_at(surface_map, pixel)
    total, brightest = np.zeros((len(pixel), 4), F), np.zeros(len(pixel), F)
    for k in range(8):
        off = (np.array((k % 4, k // 4 * 2 + k % 2), F) - F(1.5)) * F(0.25 * span)
        place = np.clip(np.floor(pixel.astype(F) + off + F(0.5)), F(0), size - 1)
        surface = surface_at(surface_map, place.astype(int))
        alike = (surface[:, 3] > 0) & (dot(surface[:, :3], centre[:, :3])[:, 0] > SAME_SIDE)
        column, row = place.astype(int).T
        linear = srgb_to_linear(picture[row, column, :3] if aligned else picture_at(picture, place, size))
        total += np.where(alike[:, None], np.concatenate([linear, np.ones_like(linear[:, :1])], -1), F(0))
        brightest = np.maximum(brightest, np.where(alike, linear.max(-1), F(0)))
    mean = total / np.maximum(total[:, 3:], F(1))
    mean[:, 3] = np.where(brightest < CLIPPED, mean[:, 3], F(0.5))
    return mean
