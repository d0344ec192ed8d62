"""Mirror of shaders/common/rim_marks.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import depth_at, facing_slope, relative_step, start

F = np.float32
DROP, STEEPER = F(6), F(3)
BOTTOMLESS = F(-1e30)


def mean_focal_length(intrinsics):
    """Return the focal length, pixels, the mean of both axes."""
    return F(0.5) * (np.abs(F(intrinsics[0])) + np.abs(F(intrinsics[1])))


def rise_of(here, there, facing, focal):
    """Return by how many pixels of depth `there` lies before the surface facing the viewer; BOTTOMLESS if missing."""
    return np.where(there > 0, focal * (relative_step(here, there) - facing), BOTTOMLESS)


def ends_before(rise, opposite):
    """Return whether the surface ends before a neighbour that rises so much."""
    return rise < -(DROP + STEEPER * np.maximum(opposite, F(0)))


def ends_along(here, before, after, inside, facing, focal):
    """Return whether the surface ends along one direction; inside = (before, after) lie in the picture."""
    rise_b, rise_a = rise_of(here, before, -facing, focal), rise_of(here, after, facing, focal)
    return (inside[0] & ends_before(rise_b, rise_a)) | (inside[1] & ends_before(rise_a, rise_b))


def mark_rim(depth_map, pixel, intrinsics):
    """Return (h, w) float32 depth, negative at rims; pixel = pixel_grid(depth_map)."""
    known, here, ray, intrinsics = start(depth_map, pixel, intrinsics)
    focal, facing = mean_focal_length(intrinsics), facing_slope(ray, intrinsics)
    (u, v), (height, width) = pixel, depth_map.shape
    left, right = depth_at(depth_map, pixel, (-1, 0)), depth_at(depth_map, pixel, (1, 0))
    above, below = depth_at(depth_map, pixel, (0, -1)), depth_at(depth_map, pixel, (0, 1))
    is_rim = ends_along(here, left, right, (u > 0, u < width - 1), facing[0], focal)
    is_rim |= ends_along(here, above, below, (v > 0, v < height - 1), facing[1], focal)
    return np.where(known & is_rim, -depth_map, depth_map)
