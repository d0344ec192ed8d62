"""Mirror of shaders/common/rim_marks.glsl."""

from __future__ import annotations

import numpy as np

from .camera import mean_focal_length
from .inverse_depth import facing_slope, relative_step
from .texels import depth_at

F = np.float32
DROP, STEEPER = F(6), F(3)
BENT, NOISY = F(1.5), F(6)
LEAST_SAY, CUT_UNIT = F(0.1), F(0.25)
MISSING, BOTTOMLESS = F(1e5), F(-1e30)


def direction_of(k):
    """Return the steps to pixels on the left, right, above and below."""
    return np.stack([np.where(k < 2, 2 * k - 1, 0), np.where(k < 2, 0, 2 * k - 5)], -1)


def rise_of(step, facing, focal):
    """Return by how many pixels of depth a pixel lies before the surface facing the viewer; BOTTOMLESS if missing."""
    return np.where(step < MISSING, focal * (step - facing), BOTTOMLESS)


def ends_before(rise, opposite):
    """Return whether the surface ends before a neighbour that rises so much."""
    return rise < -(DROP + STEEPER * np.maximum(opposite, F(0)))


def ends_along(steps, inside, facing, focal, most):
    """Return whether the surface ends or bends along one direction; steps, inside = (..., 2): before, after."""
    before, after = rise_of(steps[..., 0], -facing, focal), rise_of(steps[..., 1], facing, focal)
    bend = np.where(np.minimum(before, after) > BOTTOMLESS, before + after, F(0))
    ends = (inside[..., 0] & ends_before(before, after)) | (inside[..., 1] & ends_before(after, before))
    return ends | (np.abs(bend) > most)


def is_rim(beside, pixel, size, intrinsics, noise):
    """Return whether pixels, a pair (u, v), are rims; beside = (..., 4) steps to the left, right, above, below.

    noise: standard deviation of the depth over depth
    """
    intrinsics = [F(k) for k in intrinsics]
    ray = (pixel[0] - intrinsics[2]) / intrinsics[0], (pixel[1] - intrinsics[3]) / intrinsics[1]
    focal, facing = mean_focal_length(intrinsics), facing_slope(ray, intrinsics)
    most = np.maximum(BENT, NOISY * F(noise) * focal)
    inside = [np.stack([at > 0, at < side - 1], -1) for at, side in zip(pixel, size, strict=True)]
    return ends_along(beside[..., :2], inside[0], facing[0], focal, most) | ends_along(
        beside[..., 2:], inside[1], facing[1], focal, most
    )


def end_cut(here, there):
    """Return where others say that a rim ends along a direction: 0 not before the next pixel, 1 at once."""
    return np.where(there < 0, np.minimum(CUT_UNIT * (F(1) - there / np.maximum(here, LEAST_SAY)), F(1)), F(0))


def is_cut_off(cuts, off):
    """Return whether places so far from rim pixels are cut off; cuts (..., 4): to the left, right, up, down."""
    away = np.stack([-off[..., 0], off[..., 0], -off[..., 1], off[..., 1]], -1)
    return (np.maximum(away, F(0)) * cuts).sum(-1) > CUT_UNIT


def mark_rim(depth_map, pixel, intrinsics, noise=0.0):
    """Return (h, w) float32 depth, negative at rims; pixel = pixel_grid(depth_map)."""
    known = depth_map > 0
    here = np.where(known, depth_map, F(1))
    around = [depth_at(depth_map, pixel, off) for off in ((-1, 0), (1, 0), (0, -1), (0, 1))]
    beside = np.stack([relative_step(here, there) for there in around], -1)
    return np.where(known & is_rim(beside, pixel, depth_map.shape[::-1], intrinsics, noise), -depth_map, depth_map)
