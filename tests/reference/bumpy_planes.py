"""Mirror of shaders/common/bumpy_planes.glsl. Cells and pixels are pairs (u, v) of integer arrays of one shape, planes
(..., 4) float32; arrays of 49 in GLSL are lists of 49 arrays here."""

from __future__ import annotations

import numpy as np

from pointshade_gl.estimation.noise_model import FLAT_CELL

from .flat_cells import (
    KNOWN_SAMPLES,
    LEAST,
    WIDE,
    WIDE_REACH,
    depth_near,
    flat_middle,
    flat_offset,
    move_plane,
)
from .inverse_depth import relative_step
from .robust_plane import solve_plane

f32 = np.float32
FAR_REACH, FAR_STRETCH, FULL, LATERAL = 40, 2, f32(49), f32(0.8)
TOLERANCE, SURE, NOISIER, AGREEING, SHAPED = f32(4), f32(0.6), f32(1.8), f32(0.75), f32(20)
AROUND, CLOSE, SPAN = 6, 3, f32(27)
ELECTED, CALM, FEWEST_VOTES, UNKNOWN = f32(0.25), f32(2.3), f32(3.5), f32(-1)
ZERO, ONE, TINY = f32(0), f32(1), f32(1e-30)


def length(*parts):
    return np.sqrt(sum(part * part for part in parts))


def window_place(k, stretch):
    u, v = flat_offset(k, WIDE) if k < 48 else (0, 0)
    return f32(stretch * u), f32(stretch * v)


def window_samples(depth_map, pixel, stretch):
    """Return (d, m): relative steps to the 49 samples, and which are known."""
    here, d, m = depth_near(depth_map, pixel, (0, 0)), [], []
    for k in range(49):
        there = depth_near(depth_map, pixel, [int(n) for n in window_place(k, stretch)])
        known = np.minimum(here, there) > 0
        m.append(known.astype(f32))
        d.append(np.where(known, relative_step(np.where(known, here, ONE), np.where(known, there, ONE)), ZERO))
    return d, m


def window_plane(d, m, stretch):
    """Return (value, slope u, slope v) of the plane through the samples with weight m."""
    sums = [np.zeros_like(d[0]) for _ in range(9)]
    for k in range(49):
        x, y = window_place(k, stretch)
        u, v = m[k] * x, m[k] * y
        for total, term in zip(sums, (m[k], u, v, u * x, u * y, v * y, m[k] * d[k], u * d[k], v * d[k]), strict=True):
            total += term
    return solve_plane(*sums)


def window_rest(d, m, plane, stretch):
    """Return (variance, shape, number of samples) of what a plane leaves."""
    wide = ZERO
    for k in range(49):
        u, v = window_place(k, stretch)
        wide += (u * u + v * v) / FULL
    s, squares = np.zeros_like(d[0]), np.zeros_like(d[0])
    along, size = ([np.zeros_like(d[0]) for _ in range(3)] for _ in range(2))
    for k in range(49):
        u, v = window_place(k, stretch)
        rest = m[k] * (d[k] - (plane[0] + plane[1] * u + plane[2] * v))
        s += m[k]
        squares += rest * rest
        for i, shape in enumerate((u * u + v * v - wide, u * u - v * v, u * v)):
            along[i] += rest * shape
            size[i] += m[k] * shape * shape
    total = sum(a * a / np.maximum(b, f32(1e-6)) for a, b in zip(along, size, strict=True))
    other = np.maximum(squares - total, TINY) / np.maximum(s - f32(6), ONE)
    return squares / np.maximum(s - f32(3), ONE), total / (f32(3) * other), s


def window_bumps(depth_map, pixel):
    """Return (..., 4): deviation of w in the wide and in the widest window, shape, slope of w; see the GLSL."""
    here = np.maximum(depth_near(depth_map, pixel, (0, 0)), TINY)
    d, m = window_samples(depth_map, pixel, FAR_STRETCH)
    far = np.sqrt(window_rest(d, m, window_plane(d, m, FAR_STRETCH), FAR_STRETCH)[0]) / here
    d, m = window_samples(depth_map, pixel, 1)
    plane = window_plane(d, m, 1)
    variance, shape, count = window_rest(d, m, plane, 1)
    wide = np.where(count > FULL - f32(9), np.sqrt(variance) / here, UNKNOWN)
    return np.stack([wide, far, shape, length(*plane[1:]) / here], -1)


def plane_noise(plane, bumps):
    """Return the standard deviation of w about planes (..., 3)."""
    return length(bumps, LATERAL * length(plane[..., 1], plane[..., 2]) / np.maximum(plane[..., 0], TINY))


def bumpy_window(depth_map, pixel, stretch, bumps):
    """Return the planes of the windows around pixels; w: deviation, negative of the widest, 0 for no plane."""
    here = depth_near(depth_map, pixel, (0, 0))
    d, known = window_samples(depth_map, pixel, stretch)
    plane, total = window_plane(d, known, stretch), sum(known)
    for _ in range(2):
        noise, m = plane_noise(np.stack([here, *plane[1:]], -1), bumps) * here, []
        for k in range(49):
            u, v = window_place(k, stretch)
            miss = d[k] - (plane[0] + plane[1] * u + plane[2] * v)
            m.append(np.where(np.abs(miss) < TOLERANCE * noise, known[k], ZERO))
        plane = window_plane(d, m, stretch)
    variance, shape, count = window_rest(d, m, plane, stretch)
    holds = (total >= KNOWN_SAMPLES) & (variance < NOISIER * NOISIER * noise * noise) & (shape < SHAPED)
    holds &= count > AGREEING * total
    deviation = np.maximum(np.sqrt(variance), noise) / np.where(here > 0, here, ONE)
    planes = np.stack([here, plane[1], plane[2]], -1) / np.maximum(ONE + plane[0], LEAST)[..., None]
    signed = -deviation if stretch > 1 else deviation
    return np.where(holds[..., None], np.concatenate([planes, signed[..., None]], -1), ZERO)


def widest_bumpy_window(depth_map, pixel, bumps):
    far, wide = (bumpy_window(depth_map, pixel, stretch, bumps) for stretch in (FAR_STRETCH, 1))
    return np.where(far[..., 3:] == 0, wide, far)


def plane_miss(plane_depth, there, deviation):
    """Return how far w of depths misses that of planes, over the tolerance; infinite without a deviation."""
    least = np.maximum(np.minimum(plane_depth, there), TINY)
    allowed = least * np.maximum(plane_depth, there) * TOLERANCE * deviation
    return np.where(allowed > 0, np.abs(there - plane_depth) / np.where(allowed > 0, allowed, ONE), np.inf)


def around(reach):
    """Return the offsets of cells within a square, row by row."""
    return [(u, v) for v in range(-reach, reach + 1) for u in range(-reach, reach + 1)]


def lent_plane(planes, cell, away, here):
    """Return (planes, weight) of the windows around other cells, at the middles of cells of depth `here`."""
    (rows, columns), u, v = planes.shape[:2], cell[0] + away[0], cell[1] + away[1]
    plane = planes[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1)]
    square, reach = max(away[0] ** 2 + away[1] ** 2, 1), np.where(plane[..., 3] < 0, FAR_REACH, WIDE_REACH)
    moved, deviation = move_plane(plane[..., :3], [f32(-FLAT_CELL * n) for n in away]), np.abs(plane[..., 3])
    reaches = (deviation > 0) & (square <= reach) & (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    miss = np.where(reaches & (here > 0), plane_miss(moved[..., 0], here, deviation), ONE)
    close = np.maximum(ONE - miss, ZERO)
    lent = np.concatenate([moved, deviation[..., None]], -1)
    return lent, (reach * reach).astype(f32) / f32(square) * close * close


def bumpy_plane(planes, depth_map, cell, first, bumps):
    """Return the planes of cells; w: deviation, 0 for no plane, UNKNOWN where nothing is known."""
    here, (rows, columns) = depth_near(depth_map, flat_middle(cell, first), (0, 0)), planes.shape[:2]
    most, best = np.zeros_like(here), np.zeros((*here.shape, 4), f32)
    total, sums, asked, votes, squares = np.zeros_like(here), np.zeros_like(best), *np.zeros((3, *here.shape), f32)
    for away in around(AROUND):
        lent, weight = lent_plane(planes, cell, away, here)
        best = np.where((weight > most)[..., None], lent, best)
        most = np.maximum(weight, most)
    for away in around(AROUND):
        lent, weight = lent_plane(planes, cell, away, here)
        apart = length(lent[..., 1] - best[..., 1], lent[..., 2] - best[..., 2]) * SPAN
        weight = np.where(apart < TOLERANCE * best[..., 3] * best[..., 0], weight, ZERO)
        sums += weight[..., None] * lent
        total += weight
    found = (most > 0) & (total > 0)
    mean = sums / np.where(found, total, ONE)[..., None]
    for away in around(CLOSE):
        place = cell[0] + away[0], cell[1] + away[1]
        inside = (place[0] >= 0) & (place[0] < columns) & (place[1] >= 0) & (place[1] < rows)
        there = depth_near(depth_map, flat_middle(place, first), (0, 0))
        expected = move_plane(mean[..., :3], [f32(FLAT_CELL * n) for n in away])[..., 0]
        miss = np.where(found & inside & (there > 0), plane_miss(expected, there, mean[..., 3]), ONE)
        on_it = miss < 1
        squares += np.where(on_it, miss * miss, ZERO)
        asked += on_it
        votes += on_it & (planes[np.clip(place[1], 0, rows - 1), np.clip(place[0], 0, columns - 1), 3] != 0)
    deviation = TOLERANCE * mean[..., 3] * np.sqrt(squares / np.maximum(asked, ONE))
    holds = (deviation < CALM * plane_noise(mean[..., :3], bumps)) & (votes > np.maximum(ELECTED * asked, FEWEST_VOTES))
    nothing = np.zeros_like(mean)
    nothing[..., 3] = np.where(here > 0, ZERO, UNKNOWN)
    return np.where(holds[..., None], mean, nothing)


def bumpy_surface(planes, depth_map, pixel, first):
    """Return the planes at pixels; w: their share of the surface."""
    here = depth_near(depth_map, pixel, (0, 0))
    low = [(k - f) // FLAT_CELL for k, f in zip(pixel, first, strict=True)]
    (total, held, every), sums = np.zeros((3, *here.shape), f32), np.zeros((*here.shape, 3), f32)
    for k in range(4):
        cell = low[0] + k % 2, low[1] + k // 2
        plane = planes[cell[1], cell[0]]
        away = [(p - m).astype(f32) for p, m in zip(pixel, flat_middle(cell, first), strict=True)]
        moved = move_plane(plane[..., :3], away)
        near = [np.maximum(ONE - np.abs(n) / f32(FLAT_CELL), f32(0.01)) for n in away]
        known = (plane[..., 3] > 0) & (here > 0)
        close = np.where(known, np.maximum(ONE - plane_miss(moved[..., 0], here, plane[..., 3]), ZERO), ZERO)
        sure = np.minimum(close / (ONE - SURE), ONE)
        weight = near[0] * near[1] * close * close
        sums += weight[..., None] * moved
        total += weight
        held += near[0] * near[1] * sure
        every += np.where((sure > 0) | (plane[..., 3] == 0), near[0] * near[1], ZERO)
    found = total > 0
    plane = sums / np.where(found, total, ONE)[..., None]
    share = np.minimum(held / np.where(found, every, ONE), ONE)
    return np.where(found[..., None], np.concatenate([plane, share[..., None]], -1), ZERO)


def is_bumpy_plane(depth_map, pixel, plane, bumps):
    """Return whether the four neighbours of pixels lie on planes (..., 3), too."""
    height, width = depth_map.shape
    on_plane = np.ones(plane.shape[:-1], bool)
    for du, dv in (-1, 0), (1, 0), (0, -1), (0, 1):
        u, v = np.clip(pixel[0] + du, 0, width - 1), np.clip(pixel[1] + dv, 0, height - 1)
        expected = move_plane(plane, ((u - pixel[0]).astype(f32), (v - pixel[1]).astype(f32)))[..., 0]
        there = depth_map[v, u]
        on_plane &= (there > 0) & (plane_miss(expected, there, plane_noise(plane, bumps)) < 1)
    return on_plane
