"""Mirror of shaders/common/noise_levels.glsl.

GLSL computes one block, this computes all of them: `block` = (u, v), integers of the grid's shape.
"""

from __future__ import annotations

import numpy as np

from .noise_patch import HALF, NOTHING, ONE, ZERO, fetch

f32 = np.float32
PATCH_PITCH, BLOCK_PATCHES, PATCHES, FEWEST = 8, 6, 36, 4


def indices(columns, rows):
    """Return (u, v), integers (rows, columns): all texels of a target of that size."""
    v, u = np.mgrid[0:rows, 0:columns]
    return u, v


def patch_corner(patch_index, first, stride):
    """Return the first pixels (u, v) of patches; the grid starts at `first` and is centred on the picture."""
    return tuple(first[k] + patch_index[k] * PATCH_PITCH - 3 * (stride - 1) // 2 for k in (0, 1))


def patch_value(patch_texel, which):
    """Return one number of each patch: 0 noise of w, 1 noise of z, 2 isolated jump of w, 3 lattice step of z."""
    noise, depth = patch_texel[..., 0], patch_texel[..., 3]
    if which == 1:
        return np.where(noise < 0, NOTHING, noise * depth * depth)
    return patch_texel[..., (0, 0, 1, 2)[which]]


def block_quantile(patches, block, which, share):
    """Return (rows, cols) float32: the value below which `share` of a block's patches lie, NOTHING for too few."""
    bits, total = [], np.zeros(block[0].shape, np.int32)
    for k in range(PATCHES):
        u, v = block[0] * BLOCK_PATCHES + k % BLOCK_PATCHES, block[1] * BLOCK_PATCHES + k // BLOCK_PATCHES
        inside = (u < patches.shape[1]) & (v < patches.shape[0])
        value = np.ascontiguousarray(patch_value(fetch(patches, u, v), which), f32)
        counts = inside & (value >= 0)
        bits.append(np.where(counts, value.view(np.int32), 0x7FFFFFFF))
        total += counts
    rank = np.maximum(np.floor(f32(share) * (total + 1).astype(f32) + HALF).astype(np.int32) - 1, 0)
    prefix = np.zeros_like(total)
    for b in range(30, 14, -1):
        trial = prefix | (1 << b)
        below = sum((x < trial).astype(np.int32) for x in bits)
        prefix = np.where(below <= rank, trial, prefix)
    return np.where(total >= (FEWEST if which < 2 else 1), (prefix | 0x4000).astype(np.int32).view(f32), NOTHING)


def block_counts(patches, patch_steps, block):
    """Return (rows, cols, 4) float32: shares of copied lines and of jumps, steps per pixel, mean depth."""
    copies, lines, jumps, pairs, depth, known = (np.zeros(block[0].shape, f32) for _ in range(6))
    steps = [np.zeros_like(pairs), np.zeros_like(pairs)]
    for k in range(PATCHES):
        u, v = block[0] * BLOCK_PATCHES + k % BLOCK_PATCHES, block[1] * BLOCK_PATCHES + k // BLOCK_PATCHES
        inside = (u < patches.shape[1]) & (v < patches.shape[0])
        value, step = fetch(patches, u, v), fetch(patch_steps, u, v)
        copies += np.where(inside, step[..., 2], ZERO)
        lines += np.where(inside, step[..., 3], ZERO)
        jumps += inside & (value[..., 1] >= 0)
        known += inside & (value[..., 3] > 0)
        depth += np.where(inside, value[..., 3], ZERO)
        pairs += np.where(inside & (step[..., 0] >= 0), f32(4), ZERO)
        for axis in (0, 1):
            steps[axis] += np.where(inside, np.maximum(step[..., axis], ZERO), ZERO)
    along = np.sqrt(steps[0] * steps[0] + steps[1] * steps[1]) / np.maximum(pairs, ONE)
    along = np.where(pairs > 0, along, ONE)
    depth = np.where(known > 0, depth / np.maximum(known, ONE), ZERO)
    copies = np.where(lines > 0, copies / np.maximum(lines, ONE), NOTHING)
    return np.stack([copies, jumps / f32(PATCHES), along, depth], -1)


def noise_at(grid, pixel, first, z, powers):
    """Return (h, w) float32 noise over depth, and the part that neighbours share; pixel = (u, v) float32, z > 0."""
    block = f32(PATCH_PITCH * BLOCK_PATCHES)
    middle = HALF * (block - f32(PATCH_PITCH) + f32(3))
    place = [((pixel[k] - f32(first[k])) - middle) / block for k in (0, 1)]
    corner = [np.floor(p) for p in place]
    t = [(place[k] - corner[k])[..., None] for k in (0, 1)]
    low = [np.clip(corner[k].astype(np.int32), 0, grid.shape[1 - k] - 1) for k in (0, 1)]
    high = [np.clip(corner[k].astype(np.int32) + 1, 0, grid.shape[1 - k] - 1) for k in (0, 1)]

    def mix(a, b, share):
        return a * (ONE - share) + b * share

    top = mix(grid[low[1], low[0]], grid[low[1], high[0]], t[0])
    bottom = mix(grid[high[1], low[0]], grid[high[1], high[0]], t[0])
    level = mix(top, bottom, t[1])
    return np.maximum(level[..., 0] * z ** f32(powers[0]), level[..., 1] * z ** f32(powers[1])), level[..., 2]
