"""Mirror of shaders/common/cloud_moments.glsl, for n points at once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .vectors import dot

F = np.float32
CLOUD_WIDTH = 4096


class Moments(NamedTuple):
    weight: np.ndarray  # (n,)
    offset: np.ndarray  # (n, 3)
    squares: np.ndarray  # (n, 3)
    products: np.ndarray  # (n, 3)
    plain: np.ndarray  # (n, 4)


def inner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,)"""
    return dot(a, b)[:, 0]


def cloud_texel(k: np.ndarray) -> np.ndarray:
    return np.stack([k % CLOUD_WIDTH, k // CLOUD_WIDTH], -1)


def add_neighbour(m: Moments, d: np.ndarray, count: np.ndarray) -> Moments:
    near = np.maximum(F(1) - inner(d, d), F(0))
    w = count * near * near
    inside = (near > 0)[:, None] * count[:, None]
    return Moments(
        m.weight + w,
        m.offset + w[:, None] * d,
        m.squares + w[:, None] * d * d,
        m.products + w[:, None] * d[:, [1, 2, 0]] * d[:, [2, 0, 1]],
        m.plain + inside * np.concatenate([d, np.ones_like(d[:, :1])], -1),
    )


def neighbours(
    point_map: np.ndarray, range_map: np.ndarray, cell: np.ndarray, here: np.ndarray, radius: float, most: int
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield, one after the other, a neighbour of each point: which ones have one, its number, offset, and stride."""
    scale = F(1) / F(radius)
    for k in range(9):
        u, v = cloud_texel(9 * cell + k).T
        first, end = range_map[v, u, 0], range_map[v, u, 1]
        stride = 1 + np.trunc((end - first - 1) / most).astype(int)
        i = first.copy()
        while (i < end).any():
            at = np.where(i < end, i, 0)
            u, v = cloud_texel(at).T
            yield i < end, at, (point_map[v, u, :3] - here) * scale, stride.astype(F)
            i = i + stride


def gather_moments(
    point_map: np.ndarray, range_map: np.ndarray, cell: np.ndarray, here: np.ndarray, radius: float, slab: np.ndarray,
    most: int,
) -> Moments:  # fmt: skip
    count = len(cell)
    m = Moments(np.zeros(count, F), *(np.zeros((count, 3), F) for _ in range(3)), np.zeros((count, 4), F))
    for has, _, d, stride in neighbours(point_map, range_map, cell, here, radius, most):
        within = has & (np.abs(inner(slab[:, :3], d) - slab[:, 3]) <= 1)
        more = add_neighbour(m, d, stride)
        m = Moments(*(np.where(within.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in zip(m, more, strict=True)))
    return m
