"""What each pixel of a view shows: what resolve.frag does around the mirrored functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..camera import Camera
from .camera import pixel_ray
from .color import srgb_to_linear
from .picture import picture_at
from .splat import carry_footprint, inverse_depth_slope
from .surface import carry_back, inverse_depth_at, look_up_error, neighbour_weight, pixel_of, source_position
from .vectors import normalize, texel

F = np.float32


class Seen(NamedTuple):
    """The n target pixels that show something, and where in the frame they look."""

    target_pixel: np.ndarray  # (n, 2) int
    texel: np.ndarray  # (n, 2) int, the pixel whose splat is seen
    at: np.ndarray  # (n, 2) position in the source picture
    inverse_depth: np.ndarray  # (n,) 1/z in the target view


def seen_points(
    ids: np.ndarray, depth: np.ndarray, normals: np.ndarray, source: Camera, target: Camera, view: np.ndarray
) -> Seen:
    """ids (h, w) as `source_ids` gives them."""
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    v, u = np.nonzero(ids >= 0)
    target_pixel = np.stack([u, v], -1)
    own = pixel_of(ids[v, u], source.width)
    pixel, z, normal = own.astype(F), texel(depth, own), texel(normals, own)
    slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics[0]), z, intrinsics[0])
    splat = carry_footprint(pixel, z, normal, intrinsics[0], view, intrinsics[1])
    at = source_position(splat, pixel, target_pixel.astype(F))
    w_at = inverse_depth_at(at, pixel, F(1) / z, slope)
    ahead = pixel_ray(at, intrinsics[0]) @ view[2, :3] + view[2, 3] * w_at
    return Seen(target_pixel, own, at, w_at / ahead)


def look_up(nearest: np.ndarray, depth: np.ndarray, source: Camera, target: Camera, view: np.ndarray) -> Seen:
    """nearest (h, w) 1/z."""
    intrinsics = np.array(source.intrinsics, F), np.array(target.intrinsics, F)
    v, u = np.nonzero(nearest)
    target_pixel = np.stack([u, v], -1)
    back = carry_back(target_pixel.astype(F), nearest[v, u], intrinsics[1], view, intrinsics[0])
    at, w_at = back[:, :2], back[:, 2]
    corners = _corners(at, depth)
    errors = np.stack([look_up_error(texel(depth, corner), corner.astype(F), at, w_at) for corner in corners])
    own = np.stack(corners)[errors.argmin(0), np.arange(len(at))]
    found = texel(depth, own) > 0
    return Seen(*(part[found] for part in (target_pixel, own, at, nearest[v, u])))


def surfaces(
    seen: Seen, depth: np.ndarray, normals: np.ndarray, picture: np.ndarray, source: Camera, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Surface (n, 4), unit normal and depth in target axes, and linear albedo (n, 3); picture (h, w, 3|4) 0..1."""
    own = texel(normals, seen.texel)
    mixed, total, whole = _mix(seen, depth, normals, source, normals)
    safe = np.where(total > F(0.001), mixed, own)
    normal = np.where(total > F(0.001), normalize(safe), own)
    at = np.where(whole, seen.at, seen.texel.astype(F))
    encoded = picture_at(picture, at, np.array(depth.shape[::-1], F))
    surface = np.concatenate([normal @ view[:3, :3].T, F(1) / seen.inverse_depth[:, None]], -1)
    return surface, stored(srgb_to_linear(encoded))


def stored(linear: np.ndarray) -> np.ndarray:
    """Linear light as the GPU keeps it between passes: 16 bits, 0..1."""
    return np.round(np.clip(linear, F(0), F(1)) * F(65535)) / F(65535)


def interpolate(seen: Seen, depth: np.ndarray, normals: np.ndarray, points: np.ndarray, source: Camera) -> np.ndarray:
    """The light of the points (h, w, 3) between them, (n, 3)."""
    mixed, total, _ = _mix(seen, depth, normals, source, points)
    return np.where(total > F(0.001), mixed / np.where(total > F(0.001), total, F(1)), texel(points, seen.texel))


def _mix(
    seen: Seen, depth: np.ndarray, normals: np.ndarray, source: Camera, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The weighted sum of the values (h, w, 3) at the neighbours, the weights' sum, and whether all four have one."""
    intrinsics = np.array(source.intrinsics, F)
    pixel, z, normal = seen.texel.astype(F), texel(depth, seen.texel), texel(normals, seen.texel)
    slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics), z, intrinsics)
    mixed, total = np.zeros_like(normal), np.zeros((len(z), 1), F)
    whole = np.ones((len(z), 1), bool)
    for corner in _corners(seen.at, depth):
        weight = neighbour_weight(texel(depth, corner), corner.astype(F), seen.at, pixel, F(1) / z, slope)[:, None]
        mixed += np.where(weight > 0, weight * texel(values, corner), F(0))
        total += weight
        whole &= weight > 0
    return mixed, total, whole


def _corners(at: np.ndarray, depth: np.ndarray) -> list[np.ndarray]:
    last = np.array(depth.shape[::-1]) - 1
    return [np.clip(np.floor(at).astype(int) + np.array([k & 1, k >> 1]), 0, last) for k in range(4)]
