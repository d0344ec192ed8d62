"""Mirror of shaders/common/noise_patch.glsl.

GLSL computes one patch, this computes all of them: `corner` = (u, v), integers of the grid's shape.
"""

from __future__ import annotations

import numpy as np

f32 = np.float32
NOTHING, JUMP_LIMIT, ULPS, EXACT = f32(-1), f32(0.05), f32(1e-6), f32(0.06)
ZERO, HALF, ONE, THREE, NONE = f32(0), f32(0.5), f32(1), f32(3), f32(1e30)


def fetch(picture, u, v):
    """Return picture[v, u], zero outside: like depth_at, for any pixels."""
    height, width = picture.shape[:2]
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    inside = inside.reshape(inside.shape + (1,) * (picture.ndim - 2))
    return np.where(inside, picture[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)], ZERO)


def isolated_jump(a, b, c, d):
    """Return the step of 1/z where four depths are equal, step, equal; 1e30 elsewhere."""
    jump = np.abs(c - b)
    isolated = (a == b) & (c == d) & (jump > 0) & (np.minimum(a, d) > 0) & (jump < JUMP_LIMIT * np.minimum(b, c))
    return np.where(isolated, jump / np.where(isolated, b * c, ONE), NONE)


def third_difference(a, b, c, d):
    return (d - a) + THREE * (b - c)


def is_lattice(second, step):
    """Return whether a second difference is zero or a multiple of step."""
    ratio = np.abs(second) / step
    return (ratio > f32(20.5)) | (np.abs(ratio - np.floor(ratio + HALF)) < EXACT)


def noise_patch(depth_map, corner, stride):
    """Return (patch texels (rows, cols, 4), steps (rows, cols, 2)) float32; `out steps` of the GLSL comes second."""
    z = [fetch(depth_map, corner[0] + k % 4 * stride, corner[1] + k // 4 * stride) for k in range(16)]
    w = [ONE / np.maximum(a, f32(1e-30)) for a in z]
    known, total = np.zeros_like(z[0]), np.zeros_like(z[0])
    for a in z:
        known += a > 0
        total += a
    rounding = ULPS * total / np.maximum(known, ONE)
    steps = [np.zeros_like(known), np.zeros_like(known)]
    pairs, zeros, signs = (np.zeros_like(known) for _ in range(3))
    jump, smallest = np.full_like(known, NONE), np.full_like(known, NONE)
    second: list[np.ndarray] = [np.empty(0)] * 16
    third = []
    for k in range(4):
        third.append(third_difference(*w[4 * k : 4 * k + 4]))
        for axis, (a, b, c, d) in enumerate((z[4 * k : 4 * k + 4], z[k : k + 13 : 4])):
            second[4 * k + 2 * axis] = np.where(np.minimum(a, np.minimum(b, c)) > 0, (c - b) - (b - a), ZERO)
            second[4 * k + 2 * axis + 1] = np.where(np.minimum(b, np.minimum(c, d)) > 0, (d - c) - (c - b), ZERO)
            jump = np.minimum(jump, isolated_jump(a, b, c, d))
            pairs += np.minimum(b, c) > 0
            steps[axis] += b != c
    for bend in second:
        size = np.abs(bend)
        smallest = np.where(size > rounding, np.minimum(smallest, size), smallest)
        zeros += ~(size > rounding)
        signs += np.where(size > rounding, np.sign(bend), ZERO)
    lattice = (smallest < f32(1e29)) & (smallest > f32(8) * rounding) & (zeros < f32(13.5))
    lattice &= (zeros > HALF) | (np.abs(signs) < f32(15.5))
    for bend in second:
        lattice &= (np.abs(bend) <= rounding) | is_lattice(bend, smallest)
    with np.errstate(all="ignore"):  # 1 / 0 depths, not used
        noise = np.abs(third_difference(*third)) / f32(20)
    texel = np.stack([
        np.where(known > f32(15.5), noise, NOTHING),
        np.where(jump < f32(1e29), jump, NOTHING),
        np.where(lattice, smallest, NOTHING),
        np.where(known > 0, total / np.maximum(known, ONE), ZERO),
    ], -1)  # fmt: skip
    return texel, np.where((pairs < f32(7.5))[..., None], NOTHING, np.stack(steps, -1))
