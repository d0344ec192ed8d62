"""Mirror of shaders/common/flying_pixels.glsl, for whole pictures: `pixel` is `pixel_grid`."""

from __future__ import annotations

import numpy as np

from .inverse_depth import relative_step
from .texels import depth_at

F = np.float32
STEEPEST, CERTAIN, RAMP, WIDEST_RAMP, UNKNOWN = F(8.0), F(6.0), F(0.1), F(4.0), F(0.5e6)
ENDS = F(2.5), F(4.5), F(6.5)


def steps_along(depth_map, pixel, here, along):
    """Return (h, w, 4) float32, the steps of 1/z to the pixels 1 to 4 away along (du, dv)."""
    there = [depth_at(depth_map, pixel, (k * along[0], k * along[1])) for k in (1, 2, 3, 4)]
    return np.stack([relative_step(here, z) for z in there], -1)


def step_aside(steps, side, steepest, noise):
    """Return (h, w, 2): the step to the surface on one side that does not lead here, and how many pixels away; or 0."""
    missing = steps > UNKNOWN
    away, found = np.where(missing, -UNKNOWN, F(side) * steps), np.zeros_like(steps[..., :2])
    for k in (2, 1, 0):
        leads = np.maximum(away[..., k + 1] - away[..., k], F(0))
        if k < 2:
            leads = np.maximum(leads, F(0.5) * (away[..., k + 2] - away[..., k]))
        ends = ~missing[..., k + 1] & (away[..., k] > ENDS[k] * leads + np.maximum(F(k + 1) * steepest, noise))
        for within in range(k):
            ends &= np.abs(away[..., within] - F(0.5) * away[..., k]) < (F(0.5) - RAMP) * away[..., k]
        answer = np.stack([steps[..., k], np.full_like(steps[..., k], k + 1)], -1)
        found = np.where(ends[..., None], answer, found)
    return found


def step_between(before, after, steepest, noise):
    """Return (h, w): the smaller one of two steps, nearer on one side and farther on the other; 0 without both."""
    nearer, farther = step_aside(before, 1, steepest, noise), step_aside(after, -1, steepest, noise)
    one, other = nearer[..., 0], farther[..., 0]
    lacks = (one == 0) | (other == 0) | (nearer[..., 1] + farther[..., 1] > WIDEST_RAMP)
    return np.where(lacks, F(0), np.where(one < -other, one, other))


def smaller_step(one, other):
    """Return the smaller one of two steps, where 0 is none."""
    return np.where((other != 0) & ((one == 0) | (np.abs(other) < np.abs(one))), other, one)


def beside_step(depth_map, pixel, here, least):
    """Return (h, w) bool: whether 1/z two pixels away, in the row or column, differs by more than the least step."""
    there = [depth_at(depth_map, pixel, offset) for offset in ((-2, 0), (2, 0), (0, -2), (0, 2))]
    return np.max([np.abs(relative_step(here, z)) for z in there], axis=0) > least


def flying_step(depth_map, pixel, here, noise, focal):
    """Return (h, w) float32: the step of 1/z that puts a flying pixel onto a surface beside it, 0 for all others."""
    found, limits = np.zeros_like(here), (STEEPEST / F(focal), CERTAIN * noise)
    for along in ((1, 0), (0, 1)):
        before = steps_along(depth_map, pixel, here, (-along[0], -along[1]))
        after = steps_along(depth_map, pixel, here, along)
        found = smaller_step(found, step_between(before, after, *limits))
        found = smaller_step(found, step_between(after, before, *limits))
    return np.where(beside_step(depth_map, pixel, here, np.maximum(*limits)), found, F(0))
