"""Mirror of shaders/common/flying_pixel_mixing.glsl, for whole pictures: `pixel` is `pixel_grid`."""

from __future__ import annotations

import numpy as np

from .texels import depth_at

F = np.float32
LEAST_JUMP, INSIDE, LEVEL, FARTHEST, COUNTED = F(0.05), F(0.03), F(0.17), 2, 16


def known_change(z_a, z_b):
    """Return by how much 1/z differs, 0 where one is missing."""
    known = (z_a > 0) & (z_b > 0)
    return np.where(known, np.abs(F(1) / np.where(known, z_a, F(1)) - F(1) / np.where(known, z_b, F(1))), F(0))


def mixing_along(depth_map, pixel, along, reach):
    """Return (h, w, 2) float32: 1 where a sample is mixed, and 1 where it lies at a step without being mixed."""

    def depth(steps):
        return depth_at(depth_map, pixel, (steps * along[0], steps * along[1]))

    here, before, after = depth(0), depth(-reach), depth(reach)
    known = (here > 0) & (before > 0) & (after > 0)
    w, w_before, w_after = (F(1) / np.where(known, z, F(1)) for z in (here, before, after))
    jump = np.abs(w_after - w_before)
    beside = np.maximum(known_change(after, depth(reach + 1)), known_change(before, depth(-(reach + 1))))
    parts = known & ~((jump <= LEAST_JUMP * w) | (beside >= LEVEL * jump))
    inside = np.minimum(w - np.minimum(w_before, w_after), np.maximum(w_before, w_after) - w)
    mixed = inside > INSIDE * jump
    return np.stack([parts & mixed, parts & ~mixed], -1).astype(F)


def find_mixing(depth_map, pixel):
    """The same for all directions."""
    directions = ((1, 0), (0, 1), (1, 1), (1, -1))
    tried = [mixing_along(depth_map, pixel, along, r)[..., 0] for r in range(1, FARTHEST + 1) for along in directions]
    mixed = np.max(tried, axis=0)
    steps = [mixing_along(depth_map, pixel, along, 1)[..., 1] for along in directions[:2]]
    return np.stack([mixed, (F(1) - mixed) * np.maximum(*steps)], -1)


def count_mixing(mixing_map, block):
    """Return (n, 2): sums over blocks; block (n, 2) integers."""
    sums = [mixing_map[v * COUNTED : (v + 1) * COUNTED, u * COUNTED : (u + 1) * COUNTED].sum((0, 1)) for u, v in block]
    return np.array(sums, F)
