"""Mirror of shaders/common/highlights.glsl."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb, srgb_to_linear
from .consensus import BRIGHTEST
from .texels import texel_at

F = np.float32
DARKER_COUNTS, ENOUGH, AROUND, ROUGH = F(0.2), F(1.5), 3, F(0.6)
SURE, AGREED, BEYOND = (F(2), F(6)), (F(0.3), F(0.5)), (F(2), F(3))


def brightness(linear: np.ndarray) -> np.ndarray:
    return F(85) * linear_to_srgb(linear).sum(-1)


def may_be_clipped(encoded: np.ndarray) -> np.ndarray:
    return encoded.max(-1) > BRIGHTEST


def darker_part(encoded: np.ndarray, gain: np.ndarray) -> np.ndarray:
    linear = srgb_to_linear(encoded) * gain
    weight = np.exp(-DARKER_COUNTS * brightness(linear)) * ~may_be_clipped(encoded)
    return weight[..., None] * np.concatenate([linear, np.ones_like(linear[..., :1])], -1)


def brightness_vote(encoded: np.ndarray, gain: np.ndarray, own: np.ndarray) -> np.ndarray:
    off = own - brightness(srgb_to_linear(encoded) * gain)
    off = np.where(may_be_clipped(encoded), np.minimum(off, F(0)), off)
    sure = [_ramp(one, SURE) for one in (off, -off)]
    return np.stack([*sure, np.maximum(-off, F(0)), np.ones_like(off)], -1)


def excess_over(sum: np.ndarray, votes: np.ndarray, own: np.ndarray) -> np.ndarray:
    agreed = _ramp(votes[..., :2] / np.maximum(votes[..., 3:], F(1e-9)), AGREED)
    shown = sum[..., :3] / np.where(sum[..., 3:] > 0, sum[..., 3:], F(1))
    brighter = np.where(sum[..., 3] > 0, np.maximum(own - brightness(shown), F(0)), F(0))
    darker = votes[..., 2] / np.maximum(votes[..., 3], F(1e-9))
    found = np.stack([agreed[..., 0] * brighter, agreed[..., 1] * darker, np.ones_like(own)], -1)
    return np.where(votes[..., 3:] < ENOUGH, F(0), found)


def excess_in_row(excess_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    last, total = np.array(excess_map.shape[1::-1]) - 1, np.zeros((*pixel.shape[:-1], 4), F)
    for k in range(-AROUND, AROUND + 1):
        place = np.clip(pixel + np.array([k, 0]), 0, last)
        own = texel_at(excess_map, place)
        squares = np.zeros(pixel.shape[:-1], F)
        for step in ((1, 0), (0, 1)):
            other = texel_at(excess_map, np.minimum(place + step, last))
            off = (other[..., 0] - other[..., 1]) - (own[..., 0] - own[..., 1])
            squares += (off * own[..., 2] * other[..., 2]) ** 2
        total += np.stack([own[..., 0], own[..., 1], F(0.5) * squares, own[..., 2]], -1)
    return total


def excess_around(rows_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    last, total = np.array(rows_map.shape[1::-1]) - 1, np.zeros((*pixel.shape[:-1], 4), F)
    for k in range(-AROUND, AROUND + 1):
        total = total + texel_at(rows_map, np.clip(pixel + np.array([0, k]), 0, last))
    means = total[..., :3] / np.maximum(total[..., 3:], F(1e-9))
    found = means[..., :2] - ROUGH * np.sqrt(means[..., 2:])
    found = np.concatenate([found, np.ones_like(found[..., :1])], -1)
    return np.where(total[..., 3:] > 0, found, F(0))


def highlight_share(excess: np.ndarray, noise: np.ndarray) -> np.ndarray:
    return _ramp(excess / noise, BEYOND)


def found_at(found_map: np.ndarray, at: np.ndarray) -> np.ndarray:
    last = np.array(found_map.shape[1::-1]) - 1
    low, high = (np.clip(np.floor(at).astype(int) + k, 0, last) for k in (0, 1))
    across, down = np.split((at - np.floor(at)).astype(F), 2, -1)

    def row(v: np.ndarray) -> np.ndarray:
        left, right = (texel_at(found_map, np.stack([u[..., 0], v[..., 1]], -1)) for u in (low, high))
        return left * (F(1) - across) + right * across

    return row(low) * (F(1) - down) + row(high) * down


def _ramp(value: np.ndarray, ends: tuple[np.floating, np.floating]) -> np.ndarray:
    low, high = ends
    return np.clip((value - low) / (high - low), F(0), F(1)).astype(F)
