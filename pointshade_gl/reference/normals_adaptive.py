"""Mirror of shaders/common/normals_adaptive.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import normal_of_slope, relative_step, start
from .normals_star import star_slope
from .robust_plane import GATE, best_corner, bowl_slope, refine_plane

f32 = np.float32
TILT, FIT_GAIN, WIDEST = f32(0.006), f32(7.07), f32(12)
BOWL_FIT, PLANE_FIT, FOOTING = f32(2.0), f32(1.3), f32(4.0)
ZERO, HALF = f32(0), f32(0.5)


def slope_at_stride(picture, pixel, here, stride):
    """Return (slope u, slope v, holds), 1-D: for the pixels `pixel` = (u, v) integer indices; here = (depth, noise)."""
    depth = picture[..., 0]
    height, width = depth.shape
    d, m = [], []
    known, variance = np.zeros_like(here[0]), here[1] * here[1]
    for k in range(25):
        u, v = pixel[0] + (k % 5 - 2) * stride, pixel[1] + (k // 5 - 2) * stride
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        there = np.where(inside, depth[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)], ZERO)
        m.append((there > 0).astype(f32))
        d.append(np.where(there > 0, relative_step(here[0], there), ZERO))
        known += m[k]
    slope_u, slope_v, rest = bowl_slope(d)
    bowl = (known > f32(24.5)) & (rest < BOWL_FIT * f32(19) * variance)
    holds = bowl.copy()
    ask = np.flatnonzero(~bowl)
    d, m, variance = [x[ask] for x in d], [x[ask] for x in m], variance[ask]
    plane, _ = refine_plane(d, m, best_corner(d, m, variance), variance)
    plane, fit = refine_plane(d, m, plane, variance)
    slope_u[ask], slope_v[ask] = plane[1], plane[2]
    holds[ask] = (fit[0] < PLANE_FIT) & (fit[1] > FOOTING) & (np.abs(plane[0]) < GATE * here[1][ask])
    return slope_u / f32(stride), slope_v / f32(stride), holds


def adaptive_slope(picture, pixel, here, intrinsics):
    """Return (slope u, slope v) (h, w) of w per pixel over w; pixel = pixel_grid(depth), here = (depth, noise)."""
    focal = HALF * (abs(f32(intrinsics[0])) + abs(f32(intrinsics[1])))
    wanted = here[1] * focal / (FIT_GAIN * TILT)
    stride = np.minimum(wanted + f32(0.7), WIDEST).astype(np.int32)
    slope_u, slope_v, _ = star_slope(picture[..., 0], pixel, here[0], intrinsics, here[1])
    open_ = (picture[..., 0] > 0) & (stride > 0)
    rows, cols = np.indices(stride.shape)
    for width in range(int(WIDEST), 0, -1):
        at = open_ & (stride == width)
        if not at.any():
            continue
        u, v, holds = slope_at_stride(picture, (cols[at], rows[at]), (here[0][at], here[1][at]), width)
        slope_u[at], slope_v[at] = np.where(holds, u, slope_u[at]), np.where(holds, v, slope_v[at])
        stride[at] = np.where(holds, 0, width * 2 // 5)
    return slope_u, slope_v


def estimate_adaptive(picture, pixel, intrinsics):
    """Return unit normals (h, w, 3) float32 towards the camera, zeros where depth is missing.

    picture (h, w, 2) float32: depth and noise over depth after average_pairs; pixel = pixel_grid(picture[..., 0]).
    """
    known, depth, ray, intrinsics = start(picture[..., 0], pixel, intrinsics)
    slope = adaptive_slope(picture, pixel, (depth, picture[..., 1]), intrinsics)
    return np.where(known[..., None], normal_of_slope(slope, ray, intrinsics), ZERO)
