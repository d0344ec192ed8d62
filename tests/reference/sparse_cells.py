"""Mirror of shaders/common/sparse_cells.glsl: a cell is (..., 4) float32."""

from __future__ import annotations

import numpy as np

f32 = np.float32


def cell_of_pixel(depth, pixel):
    """Return cells (h, w, 4) of single pixels, 0 where depth is missing."""
    known = depth > 0
    w = f32(1) / np.where(known, depth, f32(1))
    return np.where(known[..., None], np.stack([pixel[0], pixel[1], w, np.ones_like(w)], -1), f32(0))


def join_cells(a, b, c, d):
    """Return the cells that hold four others each."""
    count = a[..., 3:] + b[..., 3:] + c[..., 3:] + d[..., 3:]
    total = a[..., 3:] * a[..., :3] + b[..., 3:] * b[..., :3] + c[..., 3:] * c[..., :3] + d[..., 3:] * d[..., :3]
    return np.concatenate([total / np.maximum(count, f32(1)), count], -1)


def cell_at(cells, cell):
    """Return the cells (n, 4) at places (u, v), each (n,) int; 0 outside."""
    (rows, columns), (u, v) = cells.shape[:2], cell
    inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    return np.where(inside[:, None], cells[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1)], f32(0))


def cell_levels(depth, pixel, count):
    """Return the cells of sparse_cells.frag, from those of 2x2 pixels on."""
    levels = [cell_of_pixel(depth, pixel)]
    for _ in range(count):
        cells = np.pad(levels[-1], [(0, n % 2) for n in levels[-1].shape[:2]] + [(0, 0)])
        levels.append(join_cells(cells[::2, ::2], cells[::2, 1::2], cells[1::2, ::2], cells[1::2, 1::2]))
    return levels[1:]
