"""Mirror of shaders/common/gap_filling.glsl: pixel (n, 2) int; hits (4, n, 2), counts (4, n)."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .splat import inverse_depth_slope
from .splat_corners import surface_at
from .vectors import dot, normalize, texel

F = np.float32
ONE_SURFACE, NOWHERE = F(0.05), F(255)


def known_in_row(surface_map: np.ndarray, pixel: np.ndarray, reach: int) -> np.ndarray:
    found = np.full((len(pixel), 2), NOWHERE)
    columns = surface_map.shape[1]
    for k in range(reach, -1, -1):
        for side, sign in enumerate((-1, 1)):
            at = pixel + np.array([sign * k, 0])
            inside = (at[:, 0] >= 0) & (at[:, 0] < columns)
            known = inside & (texel(surface_map, np.clip(at, 0, [columns - 1, surface_map.shape[0] - 1]))[..., 3] != 0)
            found[known, side] = k
    return found


def known_around(row_map: np.ndarray, pixel: np.ndarray, reach: int) -> np.ndarray:
    hits, nearest = np.zeros((4, len(pixel), 2), F), np.full((4, len(pixel)), 1e30, F)
    rows = row_map.shape[0]
    for v in range(-reach, reach + 1):
        at = pixel + np.array([0, v])
        inside = (at[:, 1] >= 0) & (at[:, 1] < rows)
        held = np.clip(at, 0, [row_map.shape[1] - 1, rows - 1])
        row = np.where(inside[:, None], np.floor(texel(row_map, held)[..., :2] * F(255) + F(0.5)), NOWHERE)
        for k in range(4):
            side = row[:, k % 2]
            offset = np.stack([side if k % 2 else -side, np.full_like(side, v)], -1)
            square = _dot(offset, offset)
            better = (side < NOWHERE) & (v <= 0 if k < 2 else v >= 0) & (square < nearest[k])
            hits[k] = np.where(better[:, None], offset, hits[k])
            nearest[k] = np.where(better, square, nearest[k])
    return hits


def is_enclosed(hits: np.ndarray, counts: np.ndarray) -> np.ndarray:
    all_held = np.ones(counts.shape[1], bool)
    for i in range(4):
        cross_product = hits[i, :, 0] * hits[:, :, 1] - hits[i, :, 1] * hits[:, :, 0]
        opposite = (cross_product == 0) & (_dot(hits[i], hits) < 0)
        before = (counts & ((cross_product < 0) | opposite)).any(0)
        after = (counts & ((cross_product > 0) | opposite)).any(0)
        all_held &= ~counts[i] | (before & after)
    return counts.any(0) & all_held


def fill_gap(
    surface_map: np.ndarray, row_map: np.ndarray, pixel: np.ndarray, reach: int, source: np.ndarray
) -> np.ndarray:
    own, hits = surface_at(surface_map, pixel), known_around(row_map, pixel, reach)
    there = surface_at(surface_map, pixel + hits.astype(int))
    z = np.maximum(there[..., 3], F(1e-30))
    slope = inverse_depth_slope(there[..., :3], pixel_ray(pixel.astype(F) + hits, source), z, source)
    found = np.concatenate([there[..., :3], (F(1) / z - _dot(slope, hits))[..., None]], -1)
    valid = (there[..., 3] > 0) & (found[..., 3] > 0)
    weights = np.where(valid, F(1) / np.maximum(_dot(hits, hits), F(1)), F(0))
    best, nearest = np.zeros_like(own), np.zeros(len(pixel), F)
    for i in range(4):
        counts = (weights > 0) & (np.abs(found[..., 3] - found[i, :, 3]) <= ONE_SURFACE * found[i, :, 3])
        shares = np.where(counts, weights, F(0))
        total, summed = shares.sum(0), (shares[..., None] * found).sum(0)
        better = (weights[i] > nearest) & is_enclosed(hits, counts)
        depth = total / np.where(better, summed[:, 3], F(1))
        mixed = np.concatenate([normalize(np.where(better[:, None], summed[:, :3], F(1))), depth[:, None]], -1)
        best = np.where(better[:, None], mixed, best)
        nearest = np.where(better, weights[i], nearest)
    return np.where(own[:, 3:] > 0, own, best)


def is_left_open(
    surface_map: np.ndarray, filled_map: np.ndarray, filled_depth: np.ndarray, pixel: np.ndarray, reach: int
) -> np.ndarray:
    last, is_open = np.array(surface_map.shape[1::-1]) - 1, np.zeros(len(pixel), bool)
    nothing = (filled_depth[..., 0] == 0) & (filled_map[..., 3] == 0)
    for along in ((k % 3 - 1, k // 3 - 1) for k in range(9) if k != 4):
        goes_on = np.ones(len(pixel), bool)
        for i in range(1, reach + 1):
            at = pixel + i * np.array(along)
            held = np.clip(at, 0, last)
            goes_on &= (at == held).all(-1) & (texel(surface_map, held)[..., 3] == 0)
            is_open |= goes_on & texel(nothing, held)
    return is_open


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return dot(a, b)[..., 0]
