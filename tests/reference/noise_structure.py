"""Mirror of shaders/common/noise_structure.glsl.

GLSL computes one patch, this computes all of them: `first` = (u, v), integers of the grid's shape.
"""

from __future__ import annotations

import numpy as np

from .inverse_depth import relative_step
from .noise_patch import NONE, NOTHING, ONE, fetch, third_difference

f32 = np.float32
APART, WIDE_RING, NO_RING = 3, 2, NONE


def ring_residual(depth_map, pixel, reach):
    """Return |w - mean of w around it| at the pixels (u, v), integers, float32; NO_RING beside a hole."""
    here = fetch(depth_map, *pixel)
    known, total = here > 0, np.zeros_like(here)
    over = np.where(known, here, ONE)
    for k in range(9):
        there = fetch(depth_map, pixel[0] + (k % 3 - 1) * reach, pixel[1] + (k // 3 - 1) * reach)
        known &= there > 0
        if k != 4:
            total += relative_step(over, there)
    return np.where(known, np.abs(total) / (f32(8) * over), NO_RING)


def structure_patch(depth_map, first):
    """Return (rows, cols, 4) float32: noise between pixels APART, ring residuals of reach 1 and WIDE_RING, 0."""
    third, least = [], np.full(first[0].shape, NONE)
    for k in range(4):
        w = []
        for i in range(4):
            z = fetch(depth_map, first[0] + (i - 1) * APART, first[1] + (k - 1) * APART)
            least = np.minimum(least, z)
            w.append(ONE / np.maximum(z, f32(1e-30)))
        third.append(third_difference(*w))
    with np.errstate(all="ignore"):  # 1 / 0 depths, not used
        noise = np.abs(third_difference(*third)) / f32(20)
    rings = []
    for reach in (1, WIDE_RING):
        a, b, c, d = (ring_residual(depth_map, (first[0] + k % 2, first[1] + k // 2), reach) for k in range(4))
        rings.append(np.minimum(a, b) + np.minimum(c, d) + np.minimum(a, c) + np.minimum(b, d))
    lost = np.maximum(*rings) >= NO_RING
    rings = [np.where(lost, NOTHING, ring) for ring in rings]
    return np.stack([np.where(least > 0, noise, NOTHING), *rings, np.zeros_like(least)], -1)
