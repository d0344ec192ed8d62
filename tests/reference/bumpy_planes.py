"""Mirror of shaders/common/bumpy_planes.glsl. Cells and pixels are pairs (u, v) of integer arrays of one shape, planes
(..., 4) float32; arrays of 49 in GLSL are lists of 49 arrays here."""

from __future__ import annotations

import numpy as np

from pointshade_gl.estimation.noise_model import FLAT_CELL

from .flat_cells import KNOWN_SAMPLES, LEAST, NARROW, WIDE, WIDE_REACH, depth_near, flat_middle, flat_offset
from .flat_cells import move_plane, with_reach
from .inverse_depth import relative_step
from .robust_plane import solve_plane

f32 = np.float32
FAR_REACH, FAR_STRETCH = 40, 2
WINDOW_SAMPLES, MEASURED = f32(49), f32(40)
LATERAL = f32(0.8)
TOLERANCE, NOISIER, AGREEING, SHAPELESS = f32(4.2), f32(1.6), f32(0.75), f32(8.0)
SURE = f32(0.6)
AROUND, VOTERS, ELECTED, FEWEST = 6, 3, f32(0.35), f32(3.5)
ZERO, ONE = f32(0), f32(1)


def window_samples(depth_map, pixel, stretch, places):
    """Return (d, m): relative steps to the 49 samples, and which are known."""
    here, d, m = depth_near(depth_map, pixel, (0, 0)), [], []
    for k in range(49):
        u, v = flat_offset(k, places) if k < 48 else (0, 0)
        there = depth_near(depth_map, pixel, (stretch * u, stretch * v))
        known = np.minimum(here, there) > 0
        m.append(known.astype(f32))
        d.append(np.where(known, relative_step(np.where(known, here, ONE), np.where(known, there, ONE)), ZERO))
    return d, m


def sample_place(k, stretch, places):
    u, v = flat_offset(k, places) if k < 48 else (0, 0)
    return f32(stretch * u), f32(stretch * v)


def window_plane(d, m, stretch, places):
    """Return (value, slope u, slope v) of the plane through the samples with weight m."""
    s, su, sv, suu, suv, svv, sd, sud, svd = (np.zeros_like(d[0]) for _ in range(9))
    for k in range(49):
        u, v = sample_place(k, stretch, places)
        s += m[k]
        su += m[k] * u
        sv += m[k] * v
        suu += m[k] * (u * u)
        suv += m[k] * (u * v)
        svv += m[k] * (v * v)
        sd += m[k] * d[k]
        sud += m[k] * d[k] * u
        svd += m[k] * d[k] * v
    return solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd)


def window_rest(d, m, plane, stretch, places):
    """Return (variance, shape, number of samples) of what a plane leaves."""
    middle = ZERO
    for k in range(49):
        u, v = sample_place(k, stretch, places)
        middle += (u * u + v * v) / WINDOW_SAMPLES
    s, squares = np.zeros_like(d[0]), np.zeros_like(d[0])
    along, size = ([np.zeros_like(d[0]) for _ in range(3)] for _ in range(2))
    for k in range(49):
        u, v = sample_place(k, stretch, places)
        rest = m[k] * (d[k] - (plane[0] + plane[1] * u + plane[2] * v))
        s += m[k]
        squares += rest * rest
        for i, shape in enumerate((u * u + v * v - middle, u * u - v * v, u * v)):
            along[i] += rest * shape
            size[i] += m[k] * shape * shape
    shaped = sum(a * a / np.maximum(b, f32(1e-6)) for a, b in zip(along, size, strict=True))
    other = np.maximum(squares - shaped, f32(1e-30)) / np.maximum(s - f32(6), ONE)
    return squares / np.maximum(s - f32(3), ONE), shaped / (f32(3) * other), s


def length(u, v):
    return np.sqrt(u * u + v * v)


def window_spread(depth_map, pixel):
    """Return (..., 4): deviation of w in the wide and in the narrow window, shape, slope of w; see the GLSL."""
    here = np.maximum(depth_near(depth_map, pixel, (0, 0)), f32(1e-30))
    d, m = window_samples(depth_map, pixel, 1, NARROW)
    narrow = np.sqrt(window_rest(d, m, window_plane(d, m, 1, NARROW), 1, NARROW)[0]) / here
    d, m = window_samples(depth_map, pixel, 1, WIDE)
    plane = window_plane(d, m, 1, WIDE)
    variance, shape, count = window_rest(d, m, plane, 1, WIDE)
    wide = np.where(count > MEASURED, np.sqrt(variance) / here, f32(-1))
    return np.stack([wide, narrow, shape, length(plane[1], plane[2]) / here], -1)


def bumpy_window(depth_map, pixel, stretch, reach, spread):
    """Return the planes (..., 4) of the windows around pixels."""
    here = depth_near(depth_map, pixel, (0, 0))
    d, known = window_samples(depth_map, pixel, stretch, WIDE)
    plane, total = window_plane(d, known, stretch, WIDE), sum(known)
    for _ in range(2):
        noise = length(spread * here, LATERAL * length(plane[1], plane[2]))
        m = []
        for k in range(49):
            u, v = sample_place(k, stretch, WIDE)
            miss = d[k] - (plane[0] + plane[1] * u + plane[2] * v)
            m.append(np.where(np.abs(miss) < TOLERANCE * noise, known[k], ZERO))
        plane = window_plane(d, m, stretch, WIDE)
    variance, shape, count = window_rest(d, m, plane, stretch, WIDE)
    holds = (total > KNOWN_SAMPLES) & (count > AGREEING * total) & (shape < SHAPELESS)
    holds &= variance < NOISIER * NOISIER * noise * noise
    planes = np.stack([here, plane[1], plane[2]], -1) / np.maximum(ONE + plane[0], LEAST)[..., None]
    return np.where(holds[..., None], with_reach(planes, reach), ZERO)


def widest_bumpy_window(depth_map, pixel, spread):
    far = bumpy_window(depth_map, pixel, FAR_STRETCH, FAR_REACH, spread)
    wide = bumpy_window(depth_map, pixel, 1, WIDE_REACH, spread)
    return np.where(far[..., 3:] > 0, far, wide)


def distance(plane, there, spread):
    """How far a depth lies from a plane, over the tolerance."""
    near = np.where(plane[..., 0] > 0, plane[..., 0], ONE)
    noise = TOLERANCE * length(spread, LATERAL * length(plane[..., 1], plane[..., 2]) / near)
    return np.abs(there - near) / (noise * np.maximum(there, f32(1e-30)) * near)


def bumpy_plane(planes, depth_map, cell, first, spread):
    """Return the planes (..., 4) of cells, the mean of those of the windows around."""
    here, (rows, columns) = depth_near(depth_map, flat_middle(cell, first), (0, 0)), planes.shape[:2]
    total, sums = np.zeros_like(here), np.zeros((*here.shape, 3), f32)
    side = 2 * AROUND + 1
    for k in range(side * side):
        away = k % side - AROUND, k // side - AROUND
        u, v = cell[0] + away[0], cell[1] + away[1]
        square = f32(max(away[0] ** 2 + away[1] ** 2, 1))
        plane = planes[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1)]
        moved = move_plane(plane[..., :3], [f32(-FLAT_CELL * n) for n in away])
        reaches = (u >= 0) & (u < columns) & (v >= 0) & (v < rows) & (square <= plane[..., 3])
        counts = reaches & (distance(moved, here, spread) < 1)
        weight = np.where(counts, plane[..., 3] * plane[..., 3] / square, ZERO)
        sums += weight[..., None] * moved
        total += weight
    found = (here > 0) & (total > 0)
    mean = sums / np.where(found, total, ONE)[..., None]
    asked, votes, side = np.zeros_like(here), np.zeros_like(here), 2 * VOTERS + 1
    for k in range(side * side):
        away = k % side - VOTERS, k // side - VOTERS
        u, v = cell[0] + away[0], cell[1] + away[1]
        inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
        there = depth_near(depth_map, flat_middle((u, v), first), (0, 0))
        moved = move_plane(mean, [f32(FLAT_CELL * n) for n in away])
        on_it = inside & (there > 0) & (distance(moved, there, spread) < 1)
        asked += on_it
        votes += on_it & (planes[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1), 3] > 0)
    elected = found & (votes > ELECTED * asked) & (votes > FEWEST)
    return np.where(elected[..., None], with_reach(mean, 1), ZERO)


def bumpy_surface(planes, depth_map, pixel, first, spread):
    """Return the planes (..., 4) at pixels; w is their share."""
    here = depth_near(depth_map, pixel, (0, 0))
    low = [(k - f) // FLAT_CELL for k, f in zip(pixel, first, strict=True)]
    total, sums = np.zeros_like(here), np.zeros((*here.shape, 3), f32)
    for k in range(4):
        cell = low[0] + k % 2, low[1] + k // 2
        plane = planes[cell[1], cell[0]]
        away = [(p - m).astype(f32) for p, m in zip(pixel, flat_middle(cell, first), strict=True)]
        moved = move_plane(plane[..., :3], away)
        near = [np.maximum(ONE - np.abs(n) / f32(FLAT_CELL), ZERO) for n in away]
        sure = np.clip((ONE - distance(moved, here, spread)) / (ONE - SURE), ZERO, ONE)
        weight = np.where((here > 0) & (plane[..., 3] > 0), near[0] * near[1] * sure, ZERO)
        sums += weight[..., None] * moved
        total += weight
    plane = sums / np.where(total > 0, total, ONE)[..., None]
    return np.concatenate([plane, total[..., None]], -1)
