"""Mirror of shaders/common/normals_triangles.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .vectors import dot, length, normalize, texel

F = np.float32
RING = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
TRIANGLE_ORDER = (0, 4, 2, 6, 1, 5, 3, 7)


def depth_at(depth_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    last = np.array(depth_map.shape[::-1]) - 1
    inside = np.clip(pixel, 0, last)
    return np.where((inside == pixel).all(-1), texel(depth_map, inside), F(0))


def normal_from_triangles(
    depth_map: np.ndarray, pixel: np.ndarray, intrinsics: np.ndarray, count: int, max_step: tuple[float, float]
) -> np.ndarray:
    z = depth_at(depth_map, pixel)
    ray = pixel_ray(pixel.astype(F), intrinsics)
    centre = ray * z[..., None]
    limit = F(max_step[0]) + F(max_step[1]) * z
    edge, usable = [], []
    for step in RING:
        z_k = depth_at(depth_map, pixel + step)
        usable.append((z_k > 0) & (np.abs(z_k - z) <= limit))
        edge.append(pixel_ray((pixel + step).astype(F), intrinsics) * z_k[..., None] - centre)
    total, taken = np.zeros_like(ray), np.zeros(z.shape, int)
    for k in TRIANGLE_ORDER:
        after = (k + 1) & 7
        used = usable[k] & usable[after] & (taken < count)
        total = np.where(used[..., None], total + np.cross(edge[k], edge[after]).astype(F), total)
        taken += used
    size = length(total)
    answered = size > 0
    turned = total / np.where(answered, np.where(dot(total, centre) > 0, -size, size), F(1))
    return np.where((z > 0)[..., None], np.where(answered, turned, -normalize(ray)), F(0))
