"""Mirror of shaders/common/pixel_mean.glsl."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb, srgb_to_linear
from .depth_lookup import carry_back
from .picture import picture_at
from .vectors import texel

F = np.float32
LEAST_CHANGE, GROWN = F(1 / 512), F(1.001)


def sample_offset(k: int) -> np.ndarray:
    side = F(1 if k & 1 else -1)
    return side * (np.modf(F(0.5) + F((k + 1) // 2) * F([0.75487767, 0.56984029]))[0] - F(0.5))


def source_step(target_pixel: np.ndarray, target: np.ndarray, view: np.ndarray, source: np.ndarray) -> np.ndarray:
    """(n, 2, 2), its columns last but one."""

    def seen(x: float, y: float) -> np.ndarray:
        nowhere = np.zeros(len(target_pixel), F)
        return carry_back(target_pixel + F([x, y]), nowhere, target, view, source)[..., :2]

    return np.stack([seen(0.5, 0) - seen(-0.5, 0), seen(0, 0.5) - seen(0, -0.5)], -2)


def shows_all(wide: np.ndarray) -> np.ndarray:
    return np.linalg.norm(wide, axis=-1).max(-1) <= GROWN


def mean_color(picture: np.ndarray, at: np.ndarray, wide: np.ndarray, size: np.ndarray, samples: int) -> np.ndarray:
    total = np.zeros((len(at), 3), F)
    for k in range(samples):
        total += srgb_to_linear(picture_at(picture, at + sample_offset(k) @ wide, size))
    return total / F(samples)


def mean_of_nine(picture: np.ndarray, at: np.ndarray, wide: np.ndarray, samples: int) -> np.ndarray:
    first, last = np.floor(at - F(0.5)).astype(int), np.array(picture.shape[1::-1]) - 1
    places, total = np.arange(3, dtype=F), np.zeros((len(at), 3), F)
    for k in range(samples):
        off = at - first.astype(F) + wide * sample_offset(k)
        weights = np.maximum(F(1) - np.abs(places - off[..., None]), F(0))
        color = np.zeros((len(at), 3), F)
        for y in range(3):
            for x in range(3):
                there = texel(picture, np.clip(first + np.array([x, y]), 0, last))[..., :3]
                color += (weights[:, 0, x] * weights[:, 1, y])[:, None] * there
        total += srgb_to_linear(color)
    return total / F(samples)


def opposed(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.where(one * other < 0, np.minimum(np.abs(one), np.abs(other)), F(0))


def mean_error(before: np.ndarray, own: np.ndarray, after: np.ndarray) -> np.ndarray:
    return F(0.5) * np.abs(before + after - F(2) * own)


def mean_error_of_five(
    far_before: np.ndarray, before: np.ndarray, own: np.ndarray, after: np.ndarray, far_after: np.ndarray
) -> np.ndarray:
    here = before + after - F(2) * own
    back = np.maximum(opposed(here, far_before + own - F(2) * before), opposed(here, far_after + own - F(2) * after))
    return F(0.5) * back + F(0.125) * np.abs(here)


def slope_error(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    return np.abs(after - before) / F(24)


def is_steady(light: np.ndarray, error: np.ndarray) -> np.ndarray:
    change = linear_to_srgb(np.minimum(light, F(1))) - linear_to_srgb(np.clip(light - error, F(0), F(1)))
    return change.max(-1) <= LEAST_CHANGE
