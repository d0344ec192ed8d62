"""Mirror of shaders/common/cloud_edges.glsl, for n points at once."""

from __future__ import annotations

import numpy as np

from .cloud_moments import cloud_texel, inner, neighbours
from .cloud_planes import THICKEST

F = np.float32
OWN, SLAB, NOISY, THINNEST = F(6), F(2), F(2.5), F(0.02)
TRIMS, TRIMMED = 3, F(0.4)
NEAREST = 6


def cost_of(plane: np.ndarray, noise: float) -> np.ndarray:
    thickness = _size(plane) - F(1)
    off = np.maximum(plane[:, 3] ** 2 - OWN * F(noise), F(0))
    return np.where(thickness < -0.5, THICKEST * THICKEST, thickness * thickness + off)


def plane_from(plane: np.ndarray, d: np.ndarray, unit: float) -> np.ndarray:
    size = _size(plane)
    n = plane[:, :3] / np.maximum(size, F(0.5))[:, None]
    moved = n * (F(1) + (size - F(1)) * F(unit))[:, None]
    offset = plane[:, 3] * F(unit) + inner(n, d)
    return np.where((size < 0.5)[:, None], plane, np.concatenate([moved, offset[:, None]], -1))


def elect_plane(
    point_map: np.ndarray, plane_map: np.ndarray, range_map: np.ndarray, cell: np.ndarray, here: np.ndarray,
    least: np.ndarray, noise: float, radius: float, unit: float, most: int,
) -> np.ndarray:  # fmt: skip
    best = np.zeros((len(cell), 4), F)
    for has, at, d, _ in neighbours(point_map, range_map, cell, here, radius, most):
        u, v = cloud_texel(at).T
        plane = plane_from(plane_map[v, u], d, unit)
        cost = cost_of(plane, noise)
        better = has & (cost < least) & (inner(d, d) < 1)
        best, least = np.where(better[:, None], plane, best), np.where(better, cost, least)
    return best


def slab_of(plane: np.ndarray, noise: float) -> np.ndarray:
    size = _size(plane)
    reach = np.maximum(np.maximum(SLAB * (size - F(1)), NOISY * np.sqrt(F(noise))), THINNEST)
    n = plane[:, :3] / np.maximum(size, F(1e-20))[:, None]
    return np.concatenate([n, plane[:, 3:]], -1) / reach[:, None]


def is_thinner(plane: np.ndarray, before: np.ndarray) -> np.ndarray:
    return plane[:, :3].any(-1) & (_size(plane) - F(1) <= TRIMMED * (_size(before) - F(1)))


def nearest_points(
    point_map: np.ndarray, plane_map: np.ndarray, range_map: np.ndarray, cell: np.ndarray, here: np.ndarray,
    own: np.ndarray, radius: float, most: int,
) -> np.ndarray:  # fmt: skip
    near, alike = np.ones((len(cell), NEAREST), F), np.zeros((len(cell), NEAREST), F)
    size = np.sqrt(inner(own, own))
    for has, at, d, _ in neighbours(point_map, range_map, cell, here, radius, most):
        u, v = cloud_texel(at).T
        other, distance2 = plane_map[v, u, :3], inner(d, d)
        cosine = np.abs(inner(other, own)) / np.maximum(size * np.sqrt(inner(other, other)), F(1e-20))
        counts = has & (distance2 < near[:, -1]) & (distance2 > 0)
        near[:, -1], alike[:, -1] = np.where(counts, distance2, near[:, -1]), np.where(counts, cosine, alike[:, -1])
        order = np.argsort(near, axis=1, kind="stable")
        near, alike = np.take_along_axis(near, order, 1), np.take_along_axis(alike, order, 1)
    return np.stack([np.sqrt(near[:, -1]), alike.mean(1)], -1)


def _size(plane: np.ndarray) -> np.ndarray:
    return np.sqrt(inner(plane[:, :3], plane[:, :3]))
