"""Mirror of shaders/common/completion_cells.glsl, for n cells at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import pixel_ray
from .completion import (
    SIDE,
    agrees,
    candidate_of,
    cell_middle,
    elect,
    guide_at,
    moved_plane,
    pack_color,
    supporters_of,
)
from .splat import inverse_depth_slope
from .splat_corners import surface_at

F = np.float32


class Cell(NamedTuple):
    planes: tuple[np.ndarray, np.ndarray]  # (n, 4) each
    colors: np.ndarray  # (n, 4)


def join_points(surface_map: np.ndarray, color_map: np.ndarray, cell: np.ndarray, source: np.ndarray) -> Cell:
    size = np.array(surface_map.shape[1::-1])
    candidates, colors = [], []
    gap, missing = np.zeros((len(cell), 3), F), np.zeros((len(cell), 1), F)
    for k in range(SIDE * SIDE):
        wanted = SIDE * cell + np.array([k % SIDE, k // SIDE])
        pixel = np.minimum(wanted, size - 1)
        inside = (wanted == pixel).all(-1)
        surface, color = surface_at(surface_map, pixel), guide_at(color_map, pixel, size)
        known = inside & (surface[:, 3] > 0)
        facing = np.where(known[:, None], surface, np.array([0, 0, -1, 1], F))
        z, at = facing[:, 3], pixel.astype(F)
        slope = inverse_depth_slope(facing[:, :3], pixel_ray(at, source), z, source)
        plane = moved_plane(np.concatenate([F(1) / z[:, None], slope], -1), cell_middle(cell) - at)
        candidates.append(candidate_of(plane, known.astype(F), np.zeros_like(z)))
        colors.append(color[:, :3])
        lacks = (inside & (surface[:, 3] == 0) & (color[:, 3] > 0))[:, None]
        gap, missing = gap + np.where(lacks, color[:, :3], F(0)), missing + lacks
    left = np.stack(candidates, 1)
    planes, packed = [], []
    for _ in range(2):
        w = elect(left)
        total = supporters_of(left, w)
        taken = (left[..., 3] > 0) & agrees(left[..., 0], w[:, None])
        planes.append(np.where(total[:, 3:] > 0, _divided(total[:, :3], total[:, 3:]), F(0)))
        packed.append(_mean_of(colors, taken))
        left = np.concatenate([left[..., :3], np.where(taken, F(0), left[..., 3])[..., None]], -1)
    packed += [pack_color(gap / np.maximum(missing, F(1))), missing[:, 0]]
    return Cell((planes[0], planes[1]), np.stack(packed, -1))


def _divided(total: np.ndarray, votes: np.ndarray) -> np.ndarray:
    return np.concatenate([total / np.where(votes > 0, votes, F(1)), votes], -1)


def _mean_of(colors: list[np.ndarray], taken: np.ndarray) -> np.ndarray:
    total = np.zeros_like(colors[0])
    for color, counts in zip(colors, taken.T, strict=True):
        total = total + np.where(counts[:, None], color, F(0))
    return pack_color(total / np.maximum(taken.sum(1), 1).astype(F)[:, None])
