"""Mirror of shaders/common/normals_star.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import normal_of_slope, relative_step, start
from .texels import depth_at

f32 = np.float32
REJECTED = f32(1e30)
ONE_SIDED = f32(1e20)
STEEPEST = f32(7.0)
ROUNDING = f32(1e-12)
BEND_NOISE = f32(6.0)
TWIST_NOISE = f32(2.5)
FOURTH_NOISE = f32(0.1)
ONE, TWO, FOUR, HALF, FEEBLE, RIDGE = f32(1), f32(2), f32(4), f32(0.5), f32(1e-2), f32(1e-9)


def stencil_error(bend, step_a, step_b, steepest, variance):
    """Return the squared second difference, or REJECTED where a jump lies inside the stencil."""
    larger = np.maximum(np.abs(step_a), np.abs(step_b))
    square = bend * bend
    broken = (np.abs(bend) > f32(0.7) * larger) & (larger > steepest) & (square > f32(36) * variance)
    return np.where(broken, REJECTED, square + (BEND_NOISE * variance + ROUNDING))


def beyond_noise(difference, variance):
    """Return how much of a difference is more than noise: 0 well below three standard deviations, 1 well above."""
    ratio = np.minimum(difference * difference / (f32(9) * (variance + f32(0.01) * ROUNDING)), f32(1e15))
    return ratio * ratio / (ONE + ratio * ratio)


def stencils_along(steps, steepest, variance):
    """Return the second differences of the three stencils of a direction, and their errors."""
    before2, before1, after1, after2 = steps
    bend = before2 - TWO * before1, before1 + after1, after2 - TWO * after1
    ends = (before1, before2 - before1), (before1, after1), (after1, after2 - after1)
    return bend, tuple(stencil_error(b, *both, steepest, variance) for b, both in zip(bend, ends, strict=True))


def are_whole(stencils):
    error_l, error_c, error_r = stencils[1]
    return np.maximum(error_l, np.maximum(error_c, error_r)) < REJECTED


def tau_of(stencils):
    bend_l, bend_c, bend_r = stencils[0]
    fourth = bend_l - TWO * bend_c + bend_r
    return np.where(are_whole(stencils), FOURTH_NOISE * fourth * fourth, ONE_SIDED)


def mix_slopes(steps, stencils, tau, variance):
    before2, before1, after1, after2 = steps
    (bend_l, _, bend_r), (error_l, error_c, error_r) = stencils
    share_l = ONE + tau / error_l
    share_c = FOUR + FOUR * tau / error_c
    share_r = ONE + tau / error_r
    slope_l = bend_l * beyond_noise(bend_l, BEND_NOISE * variance) - HALF * before2
    slope_c = HALF * (after1 - before1)
    slope_r = HALF * after2 - bend_r * beyond_noise(bend_r, BEND_NOISE * variance)
    return (share_l * slope_l + share_c * slope_c + share_r * slope_r) / (share_l + share_c + share_r)


def straighten(steps, stencils, slope, variance):
    before2, before1, after1, after2 = steps
    twist = HALF * (after2 - before2) - (after1 - before1)
    line = f32(0.2) * (after2 - before2) + f32(0.1) * (after1 - before1)
    straight = line + beyond_noise(twist, TWIST_NOISE * variance) * (slope - line)
    return np.where(are_whole(stencils), straight, slope)


def vote_of(steps, stencils, tau, slope, steepest, variance):
    """Return (slope of w per step along one direction, its weight)."""
    _, before1, after1, _ = steps
    error_l, error_c, error_r = stencils[1]
    error = np.minimum(tau + (BEND_NOISE * variance + ROUNDING), np.minimum(error_l, np.minimum(error_c, error_r)))
    weight = ONE / error
    weak_b = np.where(np.abs(before1) < steepest, FEEBLE, f32(0))
    weak_a = np.where(np.abs(after1) < steepest, FEEBLE, f32(0))
    total = weight + weak_b + weak_a
    return (weight * slope - weak_b * before1 + weak_a * after1) / total, total


def star_slope(depth_map, pixel, here, intrinsics, sigma):
    """Return (slope u, slope v, residual) of w per pixel relative to w; and the steps beside, (h, w, 4).

    `here` = depth without zeros, sigma = depth noise over depth, scalar or (h, w).
    """
    fx, fy, cx, cy = (f32(k) for k in intrinsics)
    variance = np.asarray(sigma, f32) * np.asarray(sigma, f32)
    steep_x, steep_y = STEEPEST / abs(fx), STEEPEST / abs(fy)
    steep_diagonal = np.sqrt(steep_x * steep_x + steep_y * steep_y)
    votes, beside = [], []
    for (du, dv), steepest in (
        ((1, 0), steep_x),
        ((0, 1), steep_y),
        ((1, 1), steep_diagonal),
        ((1, -1), steep_diagonal),
    ):
        steps = [relative_step(here, depth_at(depth_map, pixel, (k * du, k * dv))) for k in (-2, -1, 1, 2)]
        beside += steps[1:3]
        stencils = stencils_along(steps, steepest, variance)
        tau = tau_of(stencils)
        slope = straighten(steps, stencils, mix_slopes(steps, stencils, tau, variance), variance)
        votes.append(vote_of(steps, stencils, tau, slope, steepest, variance))
    ray_x, ray_y = (pixel[0] - cx) / fx, (pixel[1] - cy) / fy
    square = ONE + ray_x * ray_x + ray_y * ray_y
    (u, weight_u), (v, weight_v), (p, weight_p), (q, weight_q) = votes
    u = (weight_u * u + RIDGE * (ray_x / square / fx)) / (weight_u + RIDGE)
    v = (weight_v * v + RIDGE * (ray_y / square / fy)) / (weight_v + RIDGE)
    weight_u, weight_v = weight_u + RIDGE, weight_v + RIDGE
    uv, up, uq = weight_u * weight_v, weight_u * weight_p, weight_u * weight_q
    vp, vq, pq = weight_v * weight_p, weight_v * weight_q, FOUR * weight_p * weight_q
    pairs = uv + up + uq + vp + vq + pq
    slope_u = ((uv + up + uq) * u + vp * (p - v) + vq * (q + v) + pq * (HALF * (p + q))) / pairs
    slope_v = ((uv + vp + vq) * v + up * (p - u) + uq * (u - q) + pq * (HALF * (p - q))) / pairs
    trace = weight_u + weight_v + TWO * (weight_p + weight_q)
    return slope_u, slope_v, np.sqrt(trace / pairs), np.stack(beside[:4], -1)


def estimate_star(depth_map, pixel, intrinsics, sigma):
    """Return (h, w, 4) float32: unit normals towards the camera and their residual, zeros where depth is missing.

    depth_map (h, w) float32; pixel = pixel_grid(depth_map); sigma = noise over depth, scalar or (h, w), 0 = clean.
    """
    known, here, ray, intrinsics = start(depth_map, pixel, intrinsics)
    slope_u, slope_v, residual, _ = star_slope(depth_map, pixel, here, intrinsics, sigma)
    normal = normal_of_slope((slope_u, slope_v), ray, intrinsics)
    return np.where(known[..., None], np.concatenate([normal, residual[..., None]], -1), f32(0))
