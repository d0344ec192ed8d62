"""Mirror of shaders/common/flat_cells.glsl. Cells and pixels are pairs (u, v) of integer arrays of one shape, planes
(..., 4) float32."""

from __future__ import annotations

import numpy as np

from pointshade_gl.estimation.noise_model import FLAT_CELL

from .inverse_depth import relative_step
from .robust_plane import solve_plane

f32 = np.float32
WIDE = (27, 9), (25, 3), (22, 13), (18, 6), (15, 11), (8, 2)
NARROW = (13, 5), (12, 2), (10, 7), (9, 3), (8, 1), (6, 4)
WIDE_REACH, NARROW_REACH = 10, 2
KNOWN_SAMPLES, IN_STEP, LEAST = f32(24.5), f32(0.7), f32(1e-3)
BESIDE = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))


def flat_middle(cell, first):
    return tuple(f + FLAT_CELL * k for k, f in zip(cell, first, strict=True))


def flat_offset(k, places):
    u, v = places[k // 8][:: -1 if k % 2 else 1]
    return u * (-1 if k // 2 % 2 else 1), v * (-1 if k // 4 % 2 else 1)


def move_plane(plane, offset):
    """Return planes (..., 3) whose origin is moved by offset = (u, v) float32."""
    factor = np.maximum(f32(1) + plane[..., 1] * offset[0] + plane[..., 2] * offset[1], LEAST)
    return plane / factor[..., None]


def is_in_step(plane_depth, there, rounding):
    return np.abs(there - plane_depth) < IN_STEP * (rounding[0] + rounding[1] * there * there)


def with_reach(plane, reach):
    return np.concatenate([plane, np.full((*plane.shape[:-1], 1), reach, f32)], -1)


def depth_near(depth_map, pixel, offset):
    """Return the depths (...) at pixels + offset, 0 outside the picture."""
    (height, width), u, v = depth_map.shape, pixel[0] + offset[0], pixel[1] + offset[1]
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    return np.where(inside, depth_map[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)], f32(0))


def may_be_flat(depth_map, pixel, places, rounding):
    """Return whether the farthest samples do not rule a plane out."""
    here = depth_near(depth_map, pixel, (0, 0))
    may = here > 0
    for k in range(4):
        u, v = flat_offset(k, places)
        before, after = depth_near(depth_map, pixel, (-u, -v)), depth_near(depth_map, pixel, (u, v))
        middle = f32(2) * before * after / np.maximum(before + after, f32(1e-30))
        may &= (np.minimum(before, after) <= 0) | is_in_step(here, f32(0.5) * (here + middle), rounding)
    return may


def flat_window(depth_map, pixel, places, reach, rounding):
    """Return the planes of the windows around pixels."""
    here = depth_near(depth_map, pixel, (0, 0))
    offsets = [flat_offset(k, places) for k in range(48)]
    samples = [depth_near(depth_map, pixel, offset) for offset in offsets]
    sums = [np.ones_like(here), *(np.zeros_like(here) for _ in range(8))]
    for (u, v), there in zip(offsets, samples, strict=True):
        known, u, v = (there > 0).astype(f32), f32(u), f32(v)
        d = np.where(here > 0, known * relative_step(np.where(here > 0, here, f32(1)), there), f32(0))
        terms = known, known * u, known * v, known * (u * u), known * (u * v), known * (v * v), d, d * u, d * v
        for total, term in zip(sums, terms, strict=True):
            total += term
    value, slope_u, slope_v = solve_plane(*sums)
    plane = np.stack([here, slope_u, slope_v], -1) / np.maximum(f32(1) + value, LEAST)[..., None]
    holds = may_be_flat(depth_map, pixel, places, rounding) & (sums[0] > KNOWN_SAMPLES)
    for offset, there in zip(offsets, samples, strict=True):
        depth = move_plane(plane, [f32(k) for k in offset])[..., 0]
        holds &= ~(there > 0) | is_in_step(depth, there, rounding)
    return np.where(holds[..., None], with_reach(plane, reach), f32(0))


def widest_window(depth_map, pixel, rounding):
    """Return the planes of the widest windows around pixels."""
    wide = flat_window(depth_map, pixel, WIDE, WIDE_REACH, rounding)
    narrow = flat_window(depth_map, pixel, NARROW, NARROW_REACH, rounding)
    return np.where(wide[..., 3:] > 0, wide, narrow)


def flat_plane(planes, depth_map, cell, first, rounding):
    """Return the planes of cells, their own or those of windows that contain their middles."""
    own, here = planes[cell[1], cell[0]], depth_near(depth_map, flat_middle(cell, first), (0, 0))
    (rows, columns), total, sums = planes.shape[:2], np.zeros_like(here), np.zeros_like(own[..., :3])
    for k in range(49):
        away = k % 7 - 3, k // 7 - 3
        u, v = cell[0] + away[0], cell[1] + away[1]
        square = f32(max(away[0] ** 2 + away[1] ** 2, 1))
        plane = planes[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1)]
        moved = move_plane(plane[..., :3], [f32(-FLAT_CELL * n) for n in away])
        reaches = (u >= 0) & (u < columns) & (v >= 0) & (v < rows) & (square <= plane[..., 3])
        counts = reaches & is_in_step(moved[..., 0], here, rounding)
        weight = np.where(counts, plane[..., 3] * plane[..., 3] / square, f32(0))
        sums += weight[..., None] * moved
        total += weight
    found = (here > 0) & (total > 0)
    lent = np.where(found[..., None], with_reach(sums / np.where(found, total, f32(1))[..., None], 1), f32(0))
    return np.where(own[..., 3:] > 0, own, lent)


def is_on_plane(depth_map, pixel, plane, rounding):
    """Return whether pixels and their four neighbours lie on planes (..., 3)."""
    height, width = depth_map.shape
    on_plane = np.ones(plane.shape[:-1], bool)
    for du, dv in BESIDE:
        u, v = np.clip(pixel[0] + du, 0, width - 1), np.clip(pixel[1] + dv, 0, height - 1)
        there, offset = depth_map[v, u], ((u - pixel[0]).astype(f32), (v - pixel[1]).astype(f32))
        on_plane &= (there > 0) & is_in_step(move_plane(plane, offset)[..., 0], there, rounding)
    return on_plane


def flat_surface(planes, depth_map, pixel, first, rounding):
    """Return the planes (..., 4) at pixels; w is 1, or 0 for none."""
    here = depth_near(depth_map, pixel, (0, 0))
    low = [(k - f) // FLAT_CELL for k, f in zip(pixel, first, strict=True)]
    total, sums = np.zeros_like(here), np.zeros((*here.shape, 3), f32)
    for k in range(4):
        cell = low[0] + k % 2, low[1] + k // 2
        plane = planes[cell[1], cell[0]]
        away = [(p - m).astype(f32) for p, m in zip(pixel, flat_middle(cell, first), strict=True)]
        moved = move_plane(plane[..., :3], away)
        near = [np.maximum(f32(1) - np.abs(n) / f32(FLAT_CELL), f32(0.01)) for n in away]
        counts = (plane[..., 3] > 0) & is_in_step(moved[..., 0], here, rounding)
        weight = np.where(counts, near[0] * near[1], f32(0))
        sums += weight[..., None] * moved
        total += weight
    plane = sums / np.where(total > 0, total, f32(1))[..., None]
    holds = (total > 0) & is_on_plane(depth_map, pixel, plane, rounding)
    return np.where(holds[..., None], with_reach(plane, 1), f32(0))
