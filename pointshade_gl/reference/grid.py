"""Mirror of shaders/common/grid.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .look_up import SAME_SURFACE
from .splat import inverse_depth_slope, lies_on_plane
from .vectors import dot, length, normalize

F = np.float32
FIRST, SECOND = 1, 2
OTHER_DIAGONAL = 4
CORNERS = np.array([(0, 0), (1, 0), (0, 1), (1, 1), (1, 0), (1, 1), (0, 0), (0, 1)])


def is_joined(
    own: np.ndarray, other: np.ndarray, pixel: np.ndarray, off: np.ndarray, intrinsics: np.ndarray, max_step: np.ndarray
) -> np.ndarray:
    z, other_z = own[..., 3], other[..., 3]
    known = (z > 0) & (other_z > 0)
    if max_step.any():
        return known & (np.abs(z - other_z) <= max_step[0] + max_step[1] * np.minimum(z, other_z))
    safe, other_safe = np.where(known, z, F(1)), np.where(known, other_z, F(1))
    slope = inverse_depth_slope(own[..., :3], pixel_ray(pixel, intrinsics), safe, intrinsics)
    other_slope = inverse_depth_slope(other[..., :3], pixel_ray(pixel + off, intrinsics), other_safe, intrinsics)
    one = lies_on_plane(other_z, off, z, slope, float(SAME_SURFACE))
    return one | lies_on_plane(z, -off, other_z, other_slope, float(SAME_SURFACE))


def square_triangles(
    a: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    d: np.ndarray,
    pixel: np.ndarray,
    intrinsics: np.ndarray,
    max_step: np.ndarray,
) -> np.ndarray:
    right, down = np.array((1, 0), F), np.array((0, 1), F)
    above = is_joined(a, b, pixel, right, intrinsics, max_step)
    below = is_joined(c, d, pixel + down, right, intrinsics, max_step)
    left = is_joined(a, c, pixel, down, intrinsics, max_step)
    beside = is_joined(b, d, pixel + right, down, intrinsics, max_step)
    rising = is_joined(b, c, pixel + right, down - right, intrinsics, max_step)
    falling = is_joined(a, d, pixel, right + down, intrinsics, max_step)
    usual = FIRST * (above & left & rising) + SECOND * (below & beside & rising)
    others = FIRST * (above & beside & falling) + SECOND * (left & below & falling)
    return np.where((usual == 0) & (others != 0), OTHER_DIAGONAL + others, usual)


def vertex_corner(triangles: np.ndarray, vertex: np.ndarray | int) -> np.ndarray:
    is_unused = np.equal(vertex, 0) & (triangles & FIRST == 0) | np.equal(vertex, 3) & (triangles & SECOND == 0)
    return CORNERS[np.where(triangles & OTHER_DIAGONAL, 4, 0) + np.where(is_unused, 1, vertex)]


def triangle_normal(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    n = np.cross((q - p) / p[..., 2:], (r - p) / p[..., 2:]).astype(F)
    size = length(n)
    facing = n / np.where(size > 0, np.where(dot(n, p) > 0, -size, size), F(1))
    return np.where(size > 0, facing, -normalize(p))


def triangle_position(at: np.ndarray, is_whole: np.ndarray) -> np.ndarray:
    return np.where(np.asarray(is_whole)[..., None], at, np.floor(at + F(0.5)))
