"""Mirror of shaders/common/picture.glsl."""

from __future__ import annotations

import numpy as np

from .vectors import texel

F = np.float32


def mix_picture(picture: np.ndarray, low: np.ndarray, high: np.ndarray, share: np.ndarray) -> np.ndarray:
    def fetch(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return texel(picture, np.stack([u[..., 0], v[..., 1]], -1))[..., :3].astype(F)

    across, down = share[..., :1], share[..., 1:]
    top = fetch(low, low) * (F(1) - across) + fetch(high, low) * across
    bottom = fetch(low, high) * (F(1) - across) + fetch(high, high) * across
    return top * (F(1) - down) + bottom * down


def sample_picture(picture: np.ndarray, position: np.ndarray) -> np.ndarray:
    last = np.array(picture.shape[1::-1]) - 1
    corner = np.floor(position)
    low, high = np.clip(corner.astype(int), 0, last), np.clip(corner.astype(int) + 1, 0, last)
    return mix_picture(picture, low, high, (position - corner).astype(F))


def cubic_weights(share: np.ndarray) -> np.ndarray:
    rest, none = F(1) - share, np.zeros_like(share)
    outer = F(0.5) * share * rest
    second = rest * (F(1) + share * (F(1) - F(1.5) * share))
    third = share * (F(1) + rest * (F(1) - F(1.5) * rest))
    return np.stack([outer * -rest, none, none, outer * -share], -1) + np.stack([none, second, third, none], -1)


def sample_sharply(picture: np.ndarray, position: np.ndarray) -> np.ndarray:
    last, first = np.array(picture.shape[1::-1]) - 1, np.floor(position).astype(int) - 1
    share = position - np.floor(position)
    across, down = cubic_weights(share[..., 0]), cubic_weights(share[..., 1])
    total = np.zeros((*position.shape[:-1], 3), F)
    for k in range(16):
        weight = across[..., k & 3] * down[..., k >> 2]
        total += weight[..., None] * texel(picture, np.clip(first + np.array([k & 3, k >> 2]), 0, last))[..., :3]
    return np.clip(total, F(0), F(1))


def rescale_position(position: np.ndarray, size: np.ndarray, other_size: np.ndarray) -> np.ndarray:
    if (size == other_size).all():
        return position
    return (position + F(0.5)) * (other_size / size).astype(F) - F(0.5)


def picture_at(picture: np.ndarray, position: np.ndarray, size: np.ndarray) -> np.ndarray:
    return sample_picture(picture, rescale_position(position, size, np.array(picture.shape[1::-1], F)))
