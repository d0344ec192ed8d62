"""Mirror of shaders/common/temporal.glsl, for any number of pixels: `pixel` is (..., 2) integers."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray, project
from .depth_average import NEGLIGIBLE
from .inverse_depth import relative_step

f32 = np.float32
SAME_STEP, WIDEST_CHANGE = f32(0.02), f32(4)
CALM_POWER, CALM_OWN, DOUBT, MOST_SHARE, LEAST_SHARE = f32(3), f32(9), f32(2), f32(0.97), f32(0.0625)
ZERO, ONE = f32(0), f32(1)


def history_at(picture, pixel, offset):
    """Return texels (..., channels) at pixel + offset, 0 outside the picture."""
    size = np.array(picture.shape[1::-1])
    at = np.asarray(pixel).astype(int) + np.asarray(offset)
    inside = np.all((at >= 0) & (at < size), -1, keepdims=True)
    at = np.clip(at, 0, size - 1)
    return np.where(inside, picture[at[..., 1], at[..., 0]], ZERO)


def fresh_noise(here, rounding):
    """Return (...) the noise over depth of new depths (..., 2), rounding of their steps included."""
    step, power = map(f32, rounding)
    known = here[..., 0] > 0
    rounded = np.where(known, step * np.where(known, here[..., 0], ONE) ** power, ZERO)
    return np.sqrt(here[..., 1] * here[..., 1] + rounded * rounded / f32(12) + NEGLIGIBLE * NEGLIGIBLE)


def _where_known(known, step, noise):
    return np.where(known[..., None], np.stack([step, noise], -1), ZERO)


def old_step(history_map, pixel, here):
    """Return (..., 2): step of w from the new to the old depth, and the old noise; 0 and 0 of nothing."""
    old = history_at(history_map, pixel, (0, 0))
    known = (here > 0) & (old[..., 0] > 0)
    step = relative_step(np.where(known, here, ONE), np.where(known, old[..., 0], ONE))
    return _where_known(known, step, old[..., 2])


def carry_to_old(pixel, here, intrinsics, view):
    """Return (..., 3): where new points lie in the old picture, and their depth there."""
    there = here[..., None] * pixel_ray(np.asarray(pixel).astype(f32), intrinsics) @ view[:3, :3].T + view[:3, 3]
    return np.concatenate([project(there, intrinsics), there[..., 2:]], -1)


def carried_step(history_map, there):
    """Return old_step for a camera that has moved."""
    ahead = there[..., 2] > 0
    z = np.where(ahead, there[..., 2], ONE)
    corner = np.floor(there[..., :2])
    share = there[..., :2] - corner
    mean, same = np.zeros((*z.shape, 2), f32), ahead.copy()
    for k in range(4):
        side = np.array([k % 2, k // 2])
        old = history_at(history_map, corner, side)
        known = old[..., 0] > 0
        step = np.where(known, relative_step(z, np.where(known, old[..., 0], ONE)), ZERO)
        weight = np.where(side, share, ONE - share)
        same &= known & (np.abs(step) < SAME_STEP + WIDEST_CHANGE * old[..., 2])
        mean += (weight[..., 0] * weight[..., 1])[..., None] * np.stack([step, old[..., 2]], -1)
    return _where_known(same, mean[..., 0], mean[..., 1])


def carried_normal(normal_map, there):
    """Return (..., 3) the normals that are remembered there, in the old axes."""
    corner = np.floor(there[..., :2])
    share = there[..., :2] - corner

    def row(v):
        left, right = (history_at(normal_map, corner, (u, v))[..., :3] for u in (0, 1))
        return left * (ONE - share[..., :1]) + right * share[..., :1]

    return row(0) * (ONE - share[..., 1:]) + row(1) * share[..., 1:]


def change_of(step, noise):
    """Return (..., 2): old steps in standard deviations, and the old noise."""
    return np.stack([step[..., 0] / np.sqrt(step[..., 1] * step[..., 1] + noise * noise), step[..., 1]], -1)


def change_power(change_map, pixel, stride):
    """Return (...) the power of the changes of 25 pixels, `stride` (...) apart; 1 is that of noise alone."""
    stride = np.broadcast_to(stride, np.shape(pixel)[:-1])
    known, total, along_u, along_v, uu, vv = (np.zeros(stride.shape, f32) for _ in range(6))
    for k in range(25):
        u, v = k % 5 - 2, k // 5 - 2
        change = history_at(change_map, pixel, np.array([u, v]) * stride[..., None])
        weight = (change[..., 1] > 0).astype(f32)
        size = weight * np.clip(change[..., 0], -WIDEST_CHANGE, WIDEST_CHANGE)
        known += weight
        total += size
        along_u += f32(u) * size
        along_v += f32(v) * size
        uu += weight * f32(u * u)
        vv += weight * f32(v * v)
    tilt = along_u * along_u / np.maximum(uu, ONE) + along_v * along_v / np.maximum(vv, ONE)
    return (total * total / np.maximum(known, ONE) + tilt) / f32(3)


def fresh_share(noise, change, power):
    """Return (..., 2): share of the new frame, and the noise that is left."""
    fresh, left = noise * noise, change[..., 1] * change[..., 1]
    both = fresh + left
    own = change[..., 0] * change[..., 0]
    old = left + DOUBT * (np.maximum(power - CALM_POWER, ZERO) + np.maximum(own - CALM_OWN, ZERO)) * both
    share = np.maximum(old / (old + fresh), LEAST_SHARE)
    share = np.where(share > MOST_SHARE, ONE, share)
    noise_left = np.minimum(np.sqrt((ONE - share) * (ONE - share) * old + share * share * fresh), noise)
    known = (change[..., 1] > 0)[..., None]
    return np.where(known, np.stack([share, noise_left], -1), np.stack([np.ones_like(noise), noise], -1))


def mixed_depth(here, noise, change, share):
    """Return (...) the depth that is remembered from now on."""
    step = change[..., 0] * np.sqrt(change[..., 1] * change[..., 1] + noise * noise)
    return here / (ONE + (ONE - share) * step)


def mixed_normal(fresh, old, share, ray):
    """Return (..., 3) the normals that are remembered from now on."""
    mixed = old * (ONE - share[..., None]) + fresh * share[..., None]
    length = np.sqrt((mixed * mixed).sum(-1, keepdims=True))
    towards = (share[..., None] < 1) & ((mixed * ray).sum(-1, keepdims=True) < 0)
    return np.where(towards, mixed / np.where(towards, length, ONE), fresh)
