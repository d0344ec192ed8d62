"""Mirror of shaders/common/normals_plane_fit.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import facing_slope, normal_of_slope, relative_step, start
from .texels import depth_at

f32 = np.float32
DEPTH_GATE = f32(0.02)
DEGENERATE = f32(1e-3)


def estimate_plane_fit(depth_map, pixel, intrinsics, window):
    """Return normals (h, w, 3) float32 of planes fitted to w in a window (odd, 3..13 pixels), zeros where missing."""
    known, here, ray, intrinsics = start(depth_map, pixel, intrinsics)
    reach = window // 2
    count, x, y, xx, xy, yy, s, xs, ys = (np.zeros_like(here) for _ in range(9))
    for dv in range(-reach, reach + 1):
        for du in range(-reach, reach + 1):
            there = depth_at(depth_map, pixel, (du, dv))
            near = np.abs(there - here) <= DEPTH_GATE * here
            one, u, v = near.astype(f32), f32(du), f32(dv)
            step = np.where(near, relative_step(here, there), f32(0))
            count += one
            x += u * one
            y += v * one
            xx += u * u * one
            xy += u * v * one
            yy += v * v * one
            s += step
            xs += u * step
            ys += v * step
    a, b, c = count * xx - x * x, count * xy - x * y, count * yy - y * y
    r, t = count * xs - x * s, count * ys - y * s
    determinant = a * c - b * b
    solvable = determinant > DEGENERATE * (a * c)
    safe = np.where(solvable, determinant, f32(1))
    facing = facing_slope(ray, intrinsics)
    slope_u = np.where(solvable, (c * r - b * t) / safe, facing[0])
    slope_v = np.where(solvable, (a * t - b * r) / safe, facing[1])
    return np.where(known[..., None], normal_of_slope((slope_u, slope_v), ray, intrinsics), f32(0))
