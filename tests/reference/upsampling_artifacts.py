"""Mirror of shaders/common/upsampling_artifacts.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import relative_step
from .noise_patch import NONE, ZERO, fetch
from .texels import depth_at

f32 = np.float32
STEEP, EDGE_STEP, LINES_SHARE, SLOPE_REACH = f32(2.5), f32(0.05), f32(0.4), 4


def count_copies(depth_map, corner, across):
    """Return (rows, cols, 2) float32: copied lines and possible ones, for the patches at `corner` = (u, v)."""
    z = []
    for k in range(16):
        u, v = (across[i] * (k // 4) + (1 - across[i]) * (k % 4) for i in (0, 1))
        z.append(fetch(depth_map, corner[0] + u, corner[1] + v))
    least, finest = np.minimum.reduce(z), np.full_like(z[0], NONE)
    largest, copies = np.zeros_like(least), np.zeros_like(least)
    for line in range(4):
        moved, most = np.full_like(least, NONE), np.zeros_like(least)
        for k in range(4 * line, 4 * line + 4):
            along = np.abs(z[k] - z[k - 1]) if k % 4 else np.zeros_like(least)
            step = np.abs(z[k] - z[k - 4]) if line else np.zeros_like(least)
            finest = np.where(along > 0, np.minimum(finest, along), finest)
            finest = np.where(step > 0, np.minimum(finest, step), finest)
            moved, most = np.minimum(moved, step), np.maximum(most, step)
        largest = np.maximum(largest, moved)
        copies += (line > 0) & (most == 0)
    counts = (least > 0) & (largest > STEEP * finest) & (largest < EDGE_STEP * least)
    return np.stack([np.where(counts, copies, ZERO), np.where(counts, f32(3), ZERO)], -1)


def add_misplaced(noise, moved):
    """Return (noise over depth, share in common) with misplacement added; the argument `noise` is such a pair, too."""
    total = noise[0] * noise[0] + moved * moved
    shared = noise[0] * noise[1] * noise[0] * noise[1] + LINES_SHARE * moved * LINES_SHARE * moved
    return np.sqrt(total), np.sqrt(shared / np.maximum(total, f32(1e-30)))


def misplaced_noise(depth_map, pixel, z, misplaced):
    """Return (h, w) float32 noise over depth; pixel = pixel_grid(depth_map), z = depth_map without zeros."""
    squares = np.zeros_like(z)
    for reach in ((SLOPE_REACH, 0), (0, SLOPE_REACH)):
        before, after = depth_at(depth_map, pixel, (-reach[0], -reach[1])), depth_at(depth_map, pixel, reach)
        rise = relative_step(z, np.where(after > 0, after, z))
        fall = -relative_step(z, np.where(before > 0, before, z))
        rise = np.where(after > 0, rise, fall)
        fall = np.where(before > 0, fall, rise)
        least = np.minimum(np.abs(fall), np.abs(rise)) / f32(SLOPE_REACH)
        slope = np.where((fall * rise > 0) & (least < EDGE_STEP), least, ZERO)
        squares += slope * slope
    return f32(misplaced) * np.sqrt(squares)
