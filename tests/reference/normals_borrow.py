"""Mirror of shaders/common/normals_borrow.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import start
from .texels import depth_at

f32 = np.float32
MUCH_BETTER = f32(0.1)
COST_FLOOR = f32(1e-5)
STEEPEST_STEP = f32(7.0)
AROUND = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1), (2, 0), (-2, 0), (0, 2), (0, -2))


def surface_at(normal_map, pixel, offset):
    """Return normal and residual (h, w, 4) at `offset` pixels away, zeros outside the picture."""
    return np.stack([depth_at(normal_map[..., k], pixel, offset) for k in range(4)], -1)


def borrow(depth_map, normal_map, pixel, intrinsics):
    """Return (h, w, 4) float32: normals, of a neighbour where its plane explains a pixel better, and residuals."""
    known, here, (ray_x, ray_y), (fx, fy, cx, cy) = start(depth_map, pixel, intrinsics)
    step_u, step_v = STEEPEST_STEP / fx, STEEPEST_STEP / fy
    limit = np.minimum(MUCH_BETTER * normal_map[..., 3], np.sqrt(step_u * step_u + step_v * step_v))
    x, y, z = (normal_map[..., k].copy() for k in range(3))
    for du, dv in AROUND:
        there = depth_at(depth_map, pixel, (du, dv))
        other = surface_at(normal_map, pixel, (du, dv))
        its_x, its_y = (pixel[0] + f32(du) - cx) / fx, (pixel[1] + f32(dv) - cy) / fy
        facing_here = other[..., 0] * ray_x + other[..., 1] * ray_y + other[..., 2]
        facing_there = other[..., 0] * its_x + other[..., 1] * its_y + other[..., 2]
        usable = (there > 0) & (facing_here < 0)
        span = np.where(usable, there * facing_there, f32(1))
        miss = np.abs(here * facing_here / span - f32(1))
        cost = np.where(usable, other[..., 3] + miss + COST_FLOOR, f32(1))
        better = np.where(usable, np.maximum(limit / cost - f32(1), f32(0)), f32(0))
        weight = better * better
        x, y, z = x + weight * other[..., 0], y + weight * other[..., 1], z + weight * other[..., 2]
    length = np.where(known, np.sqrt(x * x + y * y + z * z), f32(1))
    return np.where(known[..., None], np.stack([x / length, y / length, z / length, normal_map[..., 3]], -1), f32(0))
