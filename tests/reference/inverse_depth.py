"""Mirror of shaders/common/inverse_depth.glsl, for whole pictures: `pixel` is `pixel_grid`, a vec2 is a pair (u, v)."""

from __future__ import annotations

import numpy as np

FAR_NEARER = np.float32(1e-6)


def pixel_grid(depth_map):
    """Return (u, v), each (h, w) float32, the pixel coordinates of a depth picture."""
    height, width = depth_map.shape
    return tuple(np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)))


def relative_step(here, there):
    """Return (w_there - w_here) / w_here of w = 1/z; a missing neighbour becomes a step of a million."""
    other = np.maximum(there, here * FAR_NEARER)
    return (here - other) / other


def normal_of_slope(slope, ray, intrinsics):
    """Return unit normals (h, w, 3) of the planes whose w changes by slope * w per pixel in u and v."""
    tilt_x, tilt_y = intrinsics[0] * slope[0], intrinsics[1] * slope[1]
    n = np.stack([-tilt_x, -tilt_y, ray[0] * tilt_x + ray[1] * tilt_y - np.float32(1)], -1)
    length = np.sqrt(n[..., 0] * n[..., 0] + n[..., 1] * n[..., 1] + n[..., 2] * n[..., 2])
    return n / length[..., None]


def facing_slope(ray, intrinsics):
    """Return the slope (u, v) of w of the surface that faces the viewer."""
    square = np.float32(1) + ray[0] * ray[0] + ray[1] * ray[1]
    return ray[0] / square / intrinsics[0], ray[1] / square / intrinsics[1]


def start(depth_map, pixel, intrinsics):
    """Return (known, here, ray, intrinsics as float32): the start of every estimator; `here` is 1 where missing."""
    intrinsics = [np.float32(k) for k in intrinsics]
    known = depth_map > 0
    ray = (pixel[0] - intrinsics[2]) / intrinsics[0], (pixel[1] - intrinsics[3]) / intrinsics[1]
    return known, np.where(known, depth_map, np.float32(1)), ray, intrinsics
