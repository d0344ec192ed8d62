"""Mirror of shaders/common/resolve.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import pixel_ray
from .depth_lookup import HIDDEN_PIXELS, NEARBY, carry_back, inverse_depth_at, source_position
from .picture import mix_picture
from .splat import carry_footprint, inverse_depth_slope
from .splat_corners import (
    Corners,
    corner_pixel,
    corner_surface,
    corner_weights,
    corners_at,
    four,
    seen_corner,
    surface_at,
)
from .texels import texel_at, texel_or_zero
from .vectors import dot, normalize, texel

F = np.float32
FEW, DEPTH_STEPS = F(0.001), F(0.0002)


class Seen(NamedTuple):
    at: np.ndarray  # (n, 2)
    inverse_depth: np.ndarray  # (n,)
    pixel: np.ndarray  # (n, 2) int
    own: np.ndarray  # (n, 4)
    corners: Corners


def see_splat(
    surface_map: np.ndarray,
    pixel: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
    rim_depth: np.ndarray,
) -> Seen:
    centre, own = pixel.astype(F), surface_at(surface_map, pixel)
    normal, z = own[..., :3], own[..., 3]
    slope = inverse_depth_slope(normal, pixel_ray(centre, source), z, source)
    at = source_position(carry_footprint(centre, z, normal, source, view, target), centre, target_pixel)
    w_at = inverse_depth_at(at, centre, F(1) / z, slope)
    ahead = pixel_ray(at, source) @ view[2, :3] + view[2, 3] * w_at
    inverse_depth = w_at / ahead
    is_rim = (rim_depth > 0) & (np.abs(rim_depth - inverse_depth) > DEPTH_STEPS * rim_depth)
    inverse_depth = np.where(is_rim, rim_depth, inverse_depth)
    back = carry_back(target_pixel, inverse_depth, target, view, source)
    at = np.where(is_rim[..., None], back[..., :2], at)
    corners = corners_at(surface_map, at)
    over = np.abs(texel_at(surface_map, np.clip(np.floor(at + F(0.5)).astype(int), corners.low, corners.high))[..., 3])
    is_hidden = is_rim & (over > 0) & (over * back[..., 2] < 1)
    return Seen(np.where(is_hidden[..., None], centre, at), inverse_depth, pixel, own, corners)


def look_up(
    surface_map: np.ndarray,
    inverse_depth: np.ndarray,
    hidden: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> Seen:
    back = carry_back(target_pixel, inverse_depth, target, view, source)
    at, w_at = back[..., :2], back[..., 2]
    corners = corners_at(surface_map, at)
    side = seen_corner(corners, at, w_at)
    seen = Seen(at, inverse_depth, corner_pixel(corners, side), corner_surface(corners, side), corners)
    least, around = np.full(len(at), F(1e30)), 2 * HIDDEN_PIXELS + 1
    for k in range(around * around):
        off = np.array((k % around, k // around)) - HIDDEN_PIXELS
        pixel = np.floor(at + F(0.5)).astype(int) + off
        surface = texel_or_zero(surface_map, pixel)
        rims, off = surface[..., 3] < 0, at - pixel.astype(F)
        z = np.where(rims, -surface[..., 3], F(1))
        slope = inverse_depth_slope(surface[..., :3], pixel_ray(pixel.astype(F), source), z, source)
        error = np.abs(F(1) / z + dot(slope, off)[..., 0] - w_at) + NEARBY * w_at * dot(off, off)[..., 0]
        better = hidden & rims & (error < least)
        least = np.where(better, error, least)
        chosen = pixel.astype(F), pixel, np.concatenate([surface[..., :3], z[..., None]], -1)
        at_k, pixel_k, own_k = (
            np.where(better[..., None], *pair) for pair in zip(chosen, (seen.at, seen.pixel, seen.own), strict=True)
        )
        seen = seen._replace(at=at_k, pixel=pixel_k, own=own_k)
    return seen


def seen_weights(seen: Seen, source: np.ndarray) -> np.ndarray:
    pixel, normal, z = seen.pixel.astype(F), seen.own[..., :3], seen.own[..., 3]
    slope = inverse_depth_slope(normal, pixel_ray(pixel, source), z, source)
    return corner_weights(seen.corners, seen.at, pixel, F(1) / z, slope)


def mix_normal(seen: Seen, weight: np.ndarray) -> np.ndarray:
    mixed, total = _mix([surface[..., :3] for surface in seen.corners[2:]], weight)
    own = seen.own[..., :3]
    return np.where(total > FEW, normalize(np.where(total > FEW, mixed, own)), own)


def mix_light(seen: Seen, weight: np.ndarray, light_map: np.ndarray) -> np.ndarray:
    pixels = four(seen.corners.low, seen.corners.high)
    mixed, total = _mix([texel(light_map, pixel)[..., :3] for pixel in pixels], weight)
    return np.where(total > FEW, mixed / np.where(total > FEW, total, F(1)), texel(light_map, seen.pixel)[..., :3])


def color_position(seen: Seen, weight: np.ndarray) -> np.ndarray:
    return np.where(weight.min(-1, keepdims=True) > 0, seen.at, seen.pixel.astype(F))


def mix_color(seen: Seen, weight: np.ndarray, color_map: np.ndarray) -> np.ndarray:
    is_between = weight.min(-1, keepdims=True) > 0
    low, high = (np.where(is_between, corner, seen.pixel) for corner in (seen.corners.low, seen.corners.high))
    return mix_picture(color_map, low, high, np.where(is_between, seen.at - low.astype(F), F(0)))


def _mix(values: list[np.ndarray], weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The weighted sum of the corners' values, each (n, 3), and (n, 1) the sum of the weights."""
    a, b, c, d = (weight[..., k : k + 1] * value for k, value in enumerate(values))
    return a + b + c + d, weight[..., :1] + weight[..., 1:2] + weight[..., 2:3] + weight[..., 3:]
