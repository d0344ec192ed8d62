"""The chain of gpu/surface/refinement.py on the CPU, around the mirrored functions."""

from __future__ import annotations

import numpy as np

from .completion import SIDE, guide_at, hidden_below_at
from .completion_cells import join_points
from .completion_pixels import complete_pixel, join_completed
from .completion_rays import cast_rays, cell_hidden_below, settle_cell, stops_map_of

F = np.float32


def completed_surface(
    surface_map: np.ndarray,
    color_map: np.ndarray,
    source: np.ndarray,
    hidden_map: np.ndarray | None = None,
    is_alone: bool = False,
) -> np.ndarray:
    """Return the surface (h, w, 4) float32 with what was completed.

    surface_map  unit normals and depth, negative at rims, 0 where missing
    color_map    (h, w, 3 or 4) in 0..1, of any size
    hidden_map   as `hidden_below` in estimation/stereo_shadows.py returns it
    """
    near_planes, other_planes, colors_map, plane_map = completed_planes(
        surface_map, color_map, source, hidden_map, is_alone
    )
    size = np.array(surface_map.shape[1::-1])
    pixel = places(size)
    color = guide_at(color_map, pixel, size)
    limit = np.zeros(len(pixel), F) if hidden_map is None else hidden_below_at(hidden_map, pixel, size)
    found = complete_pixel(near_planes, other_planes, colors_map, plane_map, pixel, color[:, :3], limit, source)
    wanted = (surface_map[..., 3].reshape(-1) == 0) & (color[:, 3] > 0)
    completed = np.where(wanted[:, None], found, F(0)).reshape(surface_map.shape)
    return join_completed(surface_map, completed, pixel, source, 0.0).reshape(surface_map.shape)


def completed_planes(
    surface_map: np.ndarray,
    color_map: np.ndarray,
    source: np.ndarray,
    hidden_map: np.ndarray | None = None,
    is_alone: bool = False,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the maps of cells: their near planes, their other planes, their colours, and their completed planes."""
    cells = -(-np.array(surface_map.shape[1::-1]) // SIDE)
    cell = places(cells)

    def as_map(values: np.ndarray) -> np.ndarray:
        return values.reshape(cells[1], cells[0], -1)

    (near_plane, other_plane), colors = join_points(surface_map, color_map, cell, source)
    maps = as_map(near_plane), as_map(other_plane), as_map(colors)
    limit = np.zeros(len(cell), F) if hidden_map is None else cell_hidden_below(surface_map, hidden_map, cell)
    planes, evidence = map(as_map, cast_rays(*maps, stops_map_of(maps[0], maps[2], is_alone), cell, limit, is_alone))
    return *maps, as_map(settle_cell(planes, evidence, cell))


def places(size: np.ndarray) -> np.ndarray:
    """Every pixel (u, v) of a picture, row by row: (n, 2)."""
    return np.stack(np.meshgrid(*map(np.arange, size)), -1).reshape(-1, 2)
