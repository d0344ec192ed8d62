"""Mirror of shaders/common/normals_adaptive.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import normal_of_slope, relative_step, start
from .normals_star import star_slope
from .robust_plane import GATE, best_corner, fit_bowl, refine_plane

f32 = np.float32
TILT, FIT_GAIN, WIDEST = f32(0.006), f32(7.07), f32(12)
BOWL_FIT, PLANE_FIT, FOOTING, AMID = f32(2.0), f32(1.3), f32(4.0), f32(11.0)
BOWL_MOVE, PLANE_MOVE = f32(1.0), f32(0.5)
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


def calm_surface(picture, pixel, here, stride):
    """Return (value, slope u, slope v, holds), (n,) each, for pixels (u, v) integers (n,); here = (depth, noise)."""
    d, m = samples(picture, pixel, here, stride)
    value, slope_u, slope_v, rest = fit_bowl(d, here[1] * here[1])
    holds = (stride > 0) & (sum(m) > f32(24.5)) & (rest < BOWL_FIT * f32(19) * here[1] * here[1])
    over = np.maximum(stride, 1).astype(f32)
    value = np.clip(value, -BOWL_MOVE * here[1], BOWL_MOVE * here[1])
    return value, slope_u / over, slope_v / over, holds


def robust_surface(picture, pixel, here, stride):
    """Return (value, slope u, slope v, holds) as calm_surface does."""
    d, m = samples(picture, pixel, here, stride)
    variance = here[1] * here[1]
    plane, _ = refine_plane(d, m, best_corner(d, m, variance), variance)
    plane, fit = refine_plane(d, m, plane, variance)
    holds = (stride > 0) & (fit[0] < PLANE_FIT) & (fit[1] > FOOTING) & (np.abs(plane[0]) < GATE * here[1])
    over = np.maximum(stride, 1).astype(f32)
    value = np.where(fit[1] > AMID, np.clip(plane[0], -PLANE_MOVE * here[1], PLANE_MOVE * here[1]), ZERO)
    return value, plane[1] / over, plane[2] / over, holds


def nearer_surface(picture, pixel, here, stride):
    """Return (value, slope u, slope v, holds) as calm_surface does, for pixels where neither of the two holds."""
    found = *(np.zeros_like(here[0]) for _ in range(3)), np.zeros(here[0].shape, bool)
    near = stride * 2 // 5
    while (ask := np.flatnonzero((near > 0) & ~found[3])).size:
        for answer in (calm_surface, robust_surface):
            ask = ask[~found[3][ask]]
            some = (pixel[0][ask], pixel[1][ask]), (here[0][ask], here[1][ask])
            for whole, part in zip(found, answer(picture, *some, near[ask]), strict=True):
                whole[ask] = part
        near = near * 2 // 5
    return found


def estimate_adaptive(picture, pixel, intrinsics, bumpy=None):
    """Return (h, w, 4) float32, zeros where depth is missing: unit normals towards the camera, and the depth of the
    surfaces they belong to. As normals_adaptive.frag.

    picture (h, w, 2) float32: depth and noise over depth after average_pairs; pixel = pixel_grid(picture[..., 0]);
    bumpy = bumpy_surface(...), or None.
    """
    known, depth, ray, intrinsics = start(picture[..., 0], pixel, intrinsics)
    noise = picture[..., 1]
    slope_u, slope_v, _, _ = star_slope(picture[..., 0], pixel, depth, intrinsics, noise)
    value, stride = np.zeros_like(depth), widest_stride((depth, noise), intrinsics)
    v, u = np.nonzero(known)
    for answer in (nearer_surface, robust_surface, calm_surface):  # the preferred answer writes last
        *found, holds = answer(picture, (u, v), (depth[v, u], noise[v, u]), stride[v, u])
        for whole, part in zip((value, slope_u, slope_v), found, strict=True):
            whole[v, u] = np.where(holds, part, whole[v, u])
    if bumpy is not None:
        share = bumpy[..., 3]
        planes = relative_step(depth, np.where(share > 0, bumpy[..., 0], depth)), bumpy[..., 1], bumpy[..., 2]
        found = value, slope_u, slope_v
        mixed = (a * (f32(1) - share) + b * share for a, b in zip(found, planes, strict=True))
        value, slope_u, slope_v = (np.where(share > 0, new, old) for new, old in zip(mixed, found, strict=True))
    normals = normal_of_slope((slope_u, slope_v), ray, intrinsics)
    surface = np.concatenate([normals, (depth / (f32(1) + value))[..., None]], -1)
    return np.where(known[..., None], surface, ZERO)
