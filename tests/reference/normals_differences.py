"""Mirror of shaders/common/normals_differences.glsl."""

from __future__ import annotations

import numpy as np

from .inverse_depth import facing_slope, normal_of_slope, relative_step, start
from .texels import depth_at

f32 = np.float32
MISSING_STEP = f32(5e5)


def axis_steps(depth_map, pixel, here):
    """Return the relative steps of w, (h, w) each, to the left, right, upper and lower neighbour."""
    return [relative_step(here, depth_at(depth_map, pixel, offset)) for offset in ((-1, 0), (1, 0), (0, -1), (0, 1))]


def central_difference(before, after, otherwise):
    """Return half the step from one neighbour to the other, one-sided where a neighbour is missing."""
    has_before, has_after = before < MISSING_STEP, after < MISSING_STEP
    one = np.where(has_after, after, np.where(has_before, -before, otherwise))
    return np.where(has_before & has_after, f32(0.5) * (after - before), one)


def smaller_difference(before, after, otherwise):
    """Return the smaller of the two one-sided differences."""
    one = np.where(np.abs(after) < np.abs(before), after, -before)
    one = np.where(np.abs(after) == np.abs(before), f32(0.5) * (after - before), one)
    return np.where(np.minimum(before, after) >= MISSING_STEP, otherwise, one)


def _estimate(difference, depth_map, pixel, intrinsics):
    known, here, ray, intrinsics = start(depth_map, pixel, intrinsics)
    otherwise = facing_slope(ray, intrinsics)
    left, right, above, below = axis_steps(depth_map, pixel, here)
    slope = difference(left, right, otherwise[0]), difference(above, below, otherwise[1])
    return np.where(known[..., None], normal_of_slope(slope, ray, intrinsics), f32(0))


def estimate_central(depth_map, pixel, intrinsics):
    """Return normals (h, w, 3) float32 from central differences in w, zeros where depth is missing."""
    return _estimate(central_difference, depth_map, pixel, intrinsics)


def estimate_one_sided(depth_map, pixel, intrinsics):
    """Return normals (h, w, 3) float32 from the smaller one-sided differences in w, zeros where depth is missing."""
    return _estimate(smaller_difference, depth_map, pixel, intrinsics)
