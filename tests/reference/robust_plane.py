"""Mirror of shaders/common/robust_plane.glsl.

Arrays of 25 in GLSL are lists of 25 arrays here, one entry per pixel.
"""

from __future__ import annotations

import numpy as np

f32 = np.float32
GATE, OUTLIER, BEND, CENTRE_FIRST = f32(5.0), f32(9.0), f32(10.0), f32(0.8)
ZERO, HALF, ONE, FOUR, LEAST = f32(0), f32(0.5), f32(1), f32(4), f32(1e-6)


def solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd):
    """Return (value at the pixel, slope u, slope v) by least squares, from the sums of weights and products."""
    over_s = np.maximum(s, LEAST)
    mean_u, mean_v, mean_d = su / over_s, sv / over_s, sd / over_s
    uu, uv, vv = suu - su * mean_u, suv - su * mean_v, svv - sv * mean_v
    ud, vd = sud - su * mean_d, svd - sv * mean_d
    determinant = uu * vv - uv * uv
    regular = determinant > f32(1e-3)
    over = np.where(regular, ONE / np.where(regular, determinant, ONE), ZERO)
    slope_u, slope_v = (vv * ud - uv * vd) * over, (uu * vd - uv * ud) * over
    return mean_d - slope_u * mean_u - slope_v * mean_v, slope_u, slope_v


def fit_bowl(d, variance):
    """Return (value, slope u, slope v, remaining squares) of a quadratic surface through all samples; see the GLSL."""
    total, squares, u, v, uu, vv, uv = (np.zeros_like(d[0]) for _ in range(7))
    for k in range(25):
        x, y = k % 5 - 2, k // 5 - 2
        total += d[k]
        squares += d[k] * d[k]
        u += d[k] * f32(x)
        v += d[k] * f32(y)
        uu += d[k] * f32(x * x - 2)
        vv += d[k] * f32(y * y - 2)
        uv += d[k] * f32(x * y)
    rest = squares - total * total / f32(25) - (u * u + v * v) / f32(50)
    rest = rest - (uu * uu + vv * vv) / f32(70) - uv * uv / f32(100)
    bend, noise = uu * uu + vv * vv, f32(70) * BEND * variance
    certain = bend * bend / np.maximum(bend * bend + noise * noise, f32(1e-30))
    return total / f32(25) - certain * (uu + vv) / f32(35), u / f32(50), v / f32(50), rest


def corner_plane(d, m, u, v):
    """Return the plane through 3x3 of the samples around (u, v), each -1, 0 or 1."""
    i = 5 * v + u + 6
    top, mid, low = (m[i + j] + m[i + j + 1] + m[i + j + 2] for j in (0, 5, 10))
    left, right = m[i] + m[i + 5] + m[i + 10], m[i + 2] + m[i + 7] + m[i + 12]
    sd = d[i] + d[i + 1] + d[i + 2] + d[i + 5] + d[i + 6] + d[i + 7] + d[i + 10] + d[i + 11] + d[i + 12]
    sud = (d[i + 2] + d[i + 7] + d[i + 12]) - (d[i] + d[i + 5] + d[i + 10])
    svd = (d[i + 10] + d[i + 11] + d[i + 12]) - (d[i] + d[i + 1] + d[i + 2])
    diagonal = m[i] - m[i + 2] - m[i + 10] + m[i + 12]
    x, slope_u, slope_v = solve_plane(
        top + mid + low, right - left, low - top, right + left, diagonal, top + low, sd, sud, svd
    )
    return x - (slope_u * f32(u) + slope_v * f32(v)), slope_u, slope_v


def plane_cost(d, m, plane, variance):
    """Return how much of the samples a plane does not explain."""
    cap = OUTLIER * variance
    cost = FOUR * np.maximum(plane[0] * plane[0] - cap, ZERO)
    for j in range(25):
        miss = d[j] - (plane[0] + plane[1] * f32(j % 5 - 2) + plane[2] * f32(j // 5 - 2))
        cost += m[j] * np.minimum(miss * miss, cap)
    return cost


def best_corner(d, m, variance):
    """Return the best of the five planes through the centre and the corner 3x3 samples."""
    planes = [corner_plane(d, m, u, v) for u, v in ((-1, -1), (1, -1), (0, 0), (-1, 1), (1, 1))]
    costs = [plane_cost(d, m, plane, variance) for plane in planes]
    costs[2] = CENTRE_FIRST * costs[2]
    best = np.argmin(costs, axis=0)
    return [np.choose(best, [plane[k] for plane in planes]) for k in range(3)]


def refine_plane(d, m, plane, variance):
    """Return (plane, fit): one round of biweighted least squares; `out fit` of the GLSL is the second value."""
    s, su, sv, suu, suv, svv, sd, sud, svd, squares = (np.zeros_like(variance) for _ in range(10))
    scale = ONE / (GATE * GATE * variance)
    for j in range(25):
        u, v = f32(j % 5 - 2), f32(j // 5 - 2)
        miss = d[j] - (plane[0] + plane[1] * u + plane[2] * v)
        near = np.maximum(ONE - miss * miss * scale, ZERO)
        weight = m[j] * near * near
        s += weight
        su += weight * u
        sv += weight * v
        suu += weight * (u * u)
        suv += weight * (u * v)
        svv += weight * (v * v)
        product = weight * d[j]
        sd += product
        sud += product * u
        svd += product * v
        squares += weight * miss * miss
    over_s = np.maximum(s, LEAST)
    uu, uv, vv = suu - su * su / over_s, suv - su * sv / over_s, svv - sv * sv / over_s
    narrow = HALF * (uu + vv - np.sqrt((uu - vv) * (uu - vv) + FOUR * uv * uv))
    fit = squares / (variance * np.maximum(s - f32(3), HALF)), narrow
    return solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd), fit
