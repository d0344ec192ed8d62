"""Mirror of shaders/common/depth_average.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import relative_step
from .texels import depth_at

f32 = np.float32
PAIR_GATE, PAIR_CHI2, BOWL_CHI2, NEGLIGIBLE = f32(4.0), f32(2.2), f32(2.0), f32(1e-7)


def average_pairs(depth_map, pixel, noise, correlation):
    """Return (h, w, 2) float32: depth averaged over point-symmetric pairs and its relative noise; see the GLSL."""
    correlation = np.asarray(correlation, f32)
    known, as_it_is = depth_map > 0, np.stack([depth_map, noise], -1)
    busy = known & (noise >= NEGLIGIBLE)
    here, noise = np.where(busy, depth_map, f32(1)), np.where(busy, noise, f32(1))
    wide = noise * noise * (f32(1) + f32(0.25) * correlation * correlation)
    gate = PAIR_GATE * np.sqrt(wide)
    pairs, total, squares, everything, all_squares, uu, uv, vv = (np.zeros_like(here) for _ in range(8))
    for k in range(13, 25):
        du, dv = k % 5 - 2, k // 5 - 2
        before = relative_step(here, depth_at(depth_map, pixel, (-du, -dv)))
        after = relative_step(here, depth_at(depth_map, pixel, (du, dv)))
        middle = f32(0.5) * (before + after)
        inside = (np.abs(middle) < gate).astype(f32)
        pairs += inside
        total += inside * middle
        squares += inside * middle * middle
        everything += middle
        all_squares += middle * middle
        uu += middle * f32(du * du - 2)
        vv += middle * f32(dv * dv - 2)
        uv += middle * f32(du * dv)
    step = total / (pairs + f32(0.5))
    left = f32(1) / (f32(1) + f32(2) * pairs)
    one = f32(1)
    spread = (squares - total * total / np.maximum(pairs, one)) * f32(2) / (wide * np.maximum(pairs - one, one))
    mean = everything / f32(12.5)
    bend_u, bend_v, bend_uv = uu / f32(35), vv / f32(35), uv / f32(50)
    rest = f32(2) * all_squares - f32(25) * mean * mean
    rest = rest - f32(70) * (bend_u * bend_u + bend_v * bend_v) - f32(100) * bend_uv * bend_uv
    bowl = (spread > PAIR_CHI2) & (rest < BOWL_CHI2 * f32(9) * wide)
    step = np.where(bowl, mean - f32(2) * (bend_u + bend_v), step)
    left = np.where(bowl, f32(27.0 / 175.0), left)
    busy &= ~(step < f32(-0.5))
    averaged = np.stack([here / (one + step), noise * np.sqrt(left + correlation * correlation)], -1)
    return np.where(busy[..., None], averaged, np.where(known[..., None], as_it_is, f32(0)))
