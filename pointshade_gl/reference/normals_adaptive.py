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


def widest_stride(here, intrinsics):
    """Return (...) int32: the pixels between samples that the noise here[1] requires."""
    focal = HALF * (abs(f32(intrinsics[0])) + abs(f32(intrinsics[1])))
    return np.minimum(here[1] * focal / (FIT_GAIN * TILT) + f32(0.7), f32(WIDEST)).astype(np.int32)


def samples(picture, pixel, here, stride):
    """Return (d, m), lists of 25 arrays (n,): relative steps to the samples, and 1 where they are known."""
    depth = picture[..., 0]
    height, width = depth.shape
    d, m = [], []
    for k in range(25):
        u, v = pixel[0] + (k % 5 - 2) * stride, pixel[1] + (k // 5 - 2) * stride
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        there = np.where(inside, depth[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)], ZERO)
        m.append((there > 0).astype(f32))
        d.append(np.where(there > 0, relative_step(here[0], there), ZERO))
    return d, m


def calm_slope(picture, pixel, here, stride):
    """Return (slope u, slope v, holds), (n,) each, for the pixels (u, v) integers (n,); here = (depth, noise)."""
    d, m = samples(picture, pixel, here, stride)
    slope_u, slope_v, rest = bowl_slope(d)
    holds = (stride > 0) & (sum(m) > f32(24.5)) & (rest < BOWL_FIT * f32(19) * here[1] * here[1])
    over = np.maximum(stride, 1).astype(f32)
    return slope_u / over, slope_v / over, holds


def robust_slope(picture, pixel, here, stride):
    """Return (slope u, slope v, holds) as calm_slope does."""
    d, m = samples(picture, pixel, here, stride)
    variance = here[1] * here[1]
    plane, _ = refine_plane(d, m, best_corner(d, m, variance), variance)
    plane, fit = refine_plane(d, m, plane, variance)
    holds = (stride > 0) & (fit[0] < PLANE_FIT) & (fit[1] > FOOTING) & (np.abs(plane[0]) < GATE * here[1])
    over = np.maximum(stride, 1).astype(f32)
    return plane[1] / over, plane[2] / over, holds


def nearer_slope(picture, pixel, here, stride):
    """Return (slope u, slope v, holds) as calm_slope does, for pixels where neither of the two holds."""
    slope_u, slope_v, holds = np.zeros_like(here[0]), np.zeros_like(here[0]), np.zeros(here[0].shape, bool)
    near = stride * 2 // 5
    while (ask := np.flatnonzero((near > 0) & ~holds)).size:
        for answer in (calm_slope, robust_slope):
            ask = ask[~holds[ask]]
            some = (pixel[0][ask], pixel[1][ask]), (here[0][ask], here[1][ask])
            slope_u[ask], slope_v[ask], holds[ask] = answer(picture, *some, near[ask])
        near = near * 2 // 5
    return slope_u, slope_v, holds


def estimate_adaptive(picture, pixel, intrinsics):
    """Return unit normals (h, w, 3) float32 towards the camera, zeros where depth is missing: surface_adaptive.frag.

    picture (h, w, 2) float32: depth and noise over depth after average_pairs; pixel = pixel_grid(picture[..., 0]).
    """
    known, depth, ray, intrinsics = start(picture[..., 0], pixel, intrinsics)
    noise = picture[..., 1]
    slope_u, slope_v, _, _ = star_slope(picture[..., 0], pixel, depth, intrinsics, noise)
    stride = widest_stride((depth, noise), intrinsics)
    v, u = np.nonzero(known)
    for answer in (nearer_slope, robust_slope, calm_slope):  # the preferred answer writes last
        found = answer(picture, (u, v), (depth[v, u], noise[v, u]), stride[v, u])
        slope_u[v, u] = np.where(found[2], found[0], slope_u[v, u])
        slope_v[v, u] = np.where(found[2], found[1], slope_v[v, u])
    return np.where(known[..., None], normal_of_slope((slope_u, slope_v), ray, intrinsics), ZERO)
