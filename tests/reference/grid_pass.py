"""Which triangles a frame's mesh has, on the CPU: what grid_triangles.frag does around grid.glsl."""

from __future__ import annotations

import numpy as np

from pointshade_gl.scene.camera import Camera
from pointshade_gl.scene.noise import Step

from .grid import edge_reach, grid_code, square_triangles

F = np.float32


def triangle_map_of(surface_map: np.ndarray, source: Camera, max_step: Step) -> np.ndarray:
    """(h, w) float32, the codes of grid_triangles.frag; surface_map (h, w, 4), unit normal and depth."""
    padded = np.pad(np.concatenate([surface_map[..., :3], np.abs(surface_map[..., 3:])], -1), ((0, 1), (0, 1), (0, 0)))
    corners = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    height, width = surface_map.shape[:2]
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    intrinsics = np.array(source.intrinsics, F)
    triangles = square_triangles(*corners, pixel.astype(F), intrinsics, np.array(max_step, F))
    known = surface_map[..., 3] != 0
    reach = np.full((height, width, 4), 0.5, F)
    reach[known] = edge_reach(surface_map, pixel[known], intrinsics)
    return grid_code(triangles, reach)
