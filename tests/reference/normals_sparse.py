"""Mirror of shaders/common/normals_sparse.glsl, for n pixels at once: arrays of SAMPLES in GLSL are (SAMPLES, n) here.

A Fit is (plane, variance, tilt), its plane three (n,).
"""

from __future__ import annotations

import numpy as np

from pointshade_gl.scene.noise import SPARSE_LEVELS, SPARSE_TILTS

from .inverse_depth import facing_slope, normal_of_slope, start
from .robust_plane import solve_plane
from .sparse_cells import cell_at, cell_levels

f32 = np.float32
CELLS, SAMPLES = 25, 26
CLOSE, FLOOR, UNSURE, FEWEST, SURE, ACROSS = f32(3), f32(1e-4), f32(3), f32(7), f32(0.04), f32(1)


def fit_samples(samples, weights):
    """Return the Fit by least squares; samples (u, v, d), each (SAMPLES, n)."""
    s, su, sv, suu, suv, svv, sd, sud, svd = (np.zeros_like(weights[0]) for _ in range(9))
    for u, v, d, weight in zip(*samples, weights, strict=True):
        product = weight * d
        s += weight
        su += weight * u
        sv += weight * v
        suu += weight * (u * u)
        suv += weight * (u * v)
        svv += weight * (v * v)
        sd += product
        sud += product * u
        svd += product * v
    plane = solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd)
    squares = np.full_like(s, UNSURE * FLOOR * FLOOR)
    for u, v, d, weight in zip(*samples, weights, strict=True):
        miss = d - (plane[0] + plane[1] * u + plane[2] * v)
        squares += weight * miss * miss
    over_s = np.maximum(s, f32(1e-6))
    uu, uv, vv = suu - su * su / over_s, suv - su * sv / over_s, svv - sv * sv / over_s
    narrow = f32(0.5) * (uu + vv - np.sqrt((uu - vv) * (uu - vv) + f32(4) * uv * uv))
    more = np.maximum(s - f32(3), f32(0.5))
    variance = squares / more * (f32(1) + UNSURE / more)
    tilt = np.where(narrow > ACROSS, np.sqrt(variance / np.maximum(narrow, ACROSS)), f32(-1))
    return plane, variance, tilt


def in_window(cell, window):
    """Return whether a cell, 0 to 24, is in a window, 0 to 4."""
    off = cell % 5 - 2 * ((window - 1) % 2), cell // 5 - 2 * ((window - 1) // 2)
    return window == 0 or (min(off) >= 0 and max(off) <= 2)


def sparse_plane(cells, pixel, here, level, intrinsics, tilt):
    """Return (slope u, slope v, distance, whether the tilt is known well enough).

    pixel: u and v, (n,) int; here (n,)
    """
    (u, v), side = pixel, f32(1 << level)
    found = [cell_at(cells, ((u >> level) + k % 5 - 2, (v >> level) + k // 5 - 2)) for k in range(CELLS)]
    known = np.stack([cell[:, 3] > 0 for cell in found] + [np.ones_like(u, bool)]).astype(f32)
    offsets = [((c[:, 0] - u.astype(f32)) / side, (c[:, 1] - v.astype(f32)) / side) for c in found]
    values = [(*offset, c[:, 2] * here - f32(1)) for offset, c in zip(offsets, found, strict=True)]
    samples = np.stack([*np.array(values, f32), np.zeros((3, len(u)), f32)], 1) * known
    best = np.zeros((3, len(u)), f32), np.ones_like(here), np.full_like(here, -1)
    for window in range(5):
        mask = np.array([k == CELLS or in_window(k, window) for k in range(SAMPLES)])
        weights = known * mask[:, None].astype(f32)
        fit = fit_samples(samples, weights)
        better = (weights.sum(0) >= FEWEST) & (fit[2] > 0) & ((best[2] < 0) | (fit[2] < best[2]))
        best = _chosen(better, fit, best)
    for _ in range(2):
        plane, variance, _ = best
        miss = samples[2] - (plane[0] + plane[1] * samples[0] + plane[2] * samples[1])
        near = np.maximum(f32(1) - miss * miss / (CLOSE * CLOSE * variance), f32(0))
        best = _chosen(best[2] > 0, fit_samples(samples, known * near * near), best)
    plane, variance, spread = best
    slope = plane[1] / side, plane[2] / side
    ray = (u.astype(f32) - intrinsics[2]) / intrinsics[0], (v.astype(f32) - intrinsics[3]) / intrinsics[1]
    turned = intrinsics[0] * slope[0], intrinsics[1] * slope[1]
    away = ray[0] * turned[0] + ray[1] * turned[1] - f32(1)
    focal = f32(0.5) * (np.abs(intrinsics[0]) + np.abs(intrinsics[1]))
    error = focal * spread / side / np.sqrt(turned[0] * turned[0] + turned[1] * turned[1] + away * away)
    own = np.abs(plane[0]) < CLOSE * np.sqrt(variance)
    return *slope, np.where(error < SURE, plane[0], f32(0)), (spread > 0) & own & (error < f32(tilt))


def estimate_sparse(depth_map, pixel, intrinsics):
    """Return unit normal and depth (h, w, 4) float32 as gpu/surface/surface_normals.py draws them, 0 without depth."""
    known, here, ray, intrinsics = start(depth_map, pixel, intrinsics)
    plane = np.stack([*facing_slope(ray, intrinsics), np.zeros_like(here)])
    levels, left = cell_levels(depth_map, pixel, SPARSE_LEVELS), known.copy()
    for tilt in SPARSE_TILTS:
        for level, cells in enumerate(levels, 1):
            v, u = np.nonzero(left)
            *found, answered = sparse_plane(cells, (u, v), here[v, u], level, intrinsics, tilt)
            v, u = v[answered], u[answered]
            plane[:, v, u] = np.stack(found)[:, answered]
            left[v, u] = False
    normals = normal_of_slope(plane[:2], ray, intrinsics)
    return np.where(known[..., None], np.concatenate([normals, (here / (f32(1) + plane[2]))[..., None]], -1), f32(0))


def _chosen(better, fit, best):
    plane = np.where(better, np.stack(fit[0]), np.stack(best[0]))
    return plane, *(np.where(better, new, old) for new, old in zip(fit[1:], best[1:], strict=True))
