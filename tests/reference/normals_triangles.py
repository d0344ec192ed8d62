"""Mirror of shaders/common/normals_triangles.glsl, for whole pictures: `pixel` is `pixel_grid`."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .texels import depth_at
from .vectors import dot, length, normalize

F = np.float32
RING = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
TRIANGLE_ORDER = (0, 4, 2, 6, 1, 5, 3, 7)


def normal_from_triangles(
    depth_map: np.ndarray,
    pixel: tuple[np.ndarray, np.ndarray],
    intrinsics: np.ndarray,
    count: int,
    max_step: tuple[float, float],
) -> np.ndarray:
    z, at = depth_map, np.stack(pixel, -1)
    ray = pixel_ray(at, intrinsics)
    safe = np.where(z > 0, z, F(1))
    limit = F(max_step[0]) + F(max_step[1]) * z
    edge, usable = [], []
    for step in RING:
        z_k = depth_at(depth_map, pixel, step)
        usable.append((z_k > 0) & (np.abs(z_k - z) <= limit))
        edge.append(pixel_ray(at + np.array(step, F), intrinsics) * (z_k / safe)[..., None] - ray)
    total, taken = np.zeros_like(ray), np.zeros(z.shape, int)
    for k in TRIANGLE_ORDER:
        after = (k + 1) & 7
        used = usable[k] & usable[after] & (taken < count)
        total = np.where(used[..., None], total + np.cross(edge[k], edge[after]).astype(F), total)
        taken += used
    size = length(total)
    answered = size > 0
    turned = total / np.where(answered, np.where(dot(total, ray) > 0, -size, size), F(1))
    return np.where((z > 0)[..., None], np.where(answered, turned, -normalize(ray)), F(0))
