"""Mirror of shaders/common/rim_marks.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import facing_slope, relative_step
from .texels import depth_at

F = np.float32
DROP, STEEPER = F(6), F(3)
MISSING, BOTTOMLESS = F(1e5), F(-1e30)


def mean_focal_length(intrinsics):
    """Return the focal length, pixels, the mean of both axes."""
    return F(0.5) * (np.abs(F(intrinsics[0])) + np.abs(F(intrinsics[1])))


def rise_of(step, facing, focal):
    """Return by how many pixels of depth a pixel lies before the surface facing the viewer; BOTTOMLESS if missing."""
    return np.where(step < MISSING, focal * (step - facing), BOTTOMLESS)


def ends_before(rise, opposite):
    """Return whether the surface ends before a neighbour that rises so much."""
    return rise < -(DROP + STEEPER * np.maximum(opposite, F(0)))


def ends_along(steps, inside, facing, focal):
    """Return whether the surface ends along one direction; steps, inside = (..., 2): before, after."""
    before, after = rise_of(steps[..., 0], -facing, focal), rise_of(steps[..., 1], facing, focal)
    return (inside[..., 0] & ends_before(before, after)) | (inside[..., 1] & ends_before(after, before))


def is_rim(beside, pixel, size, intrinsics):
    """Return whether pixels, a pair (u, v), are rims; beside = (..., 4) steps to the left, right, above, below."""
    intrinsics = [F(k) for k in intrinsics]
    ray = (pixel[0] - intrinsics[2]) / intrinsics[0], (pixel[1] - intrinsics[3]) / intrinsics[1]
    focal, facing = mean_focal_length(intrinsics), facing_slope(ray, intrinsics)
    inside = [np.stack([at > 0, at < side - 1], -1) for at, side in zip(pixel, size, strict=True)]
    return ends_along(beside[..., :2], inside[0], facing[0], focal) | ends_along(
        beside[..., 2:], inside[1], facing[1], focal
    )


def mark_rim(depth_map, pixel, intrinsics):
    """Return (h, w) float32 depth, negative at rims; pixel = pixel_grid(depth_map)."""
    known = depth_map > 0
    here = np.where(known, depth_map, F(1))
    around = [depth_at(depth_map, pixel, off) for off in ((-1, 0), (1, 0), (0, -1), (0, 1))]
    beside = np.stack([relative_step(here, there) for there in around], -1)
    return np.where(known & is_rim(beside, pixel, depth_map.shape[::-1], intrinsics), -depth_map, depth_map)
