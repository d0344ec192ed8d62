"""Mirror of shaders/common/rim_splat.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray, project
from .inverse_depth import facing_slope
from .rim_marks import BOTTOMLESS, mean_focal_length
from .rims import Rim
from .splat import FLAT, Footprint, inverse_depth_slope, splat_bends, splat_reach
from .vectors import dot

F = np.float32
NEXT_PIXEL, OUTLINE_NEAR = F(0.98), F(1.16)
ENLARGED = F(8)
BEHIND = F(0.1)


def rim_reach(rim: Rim) -> np.ndarray:
    n, width, reach = OUTLINE_NEAR * rim.outward, rim.width[..., None], splat_reach(F(1), False)
    low, high = np.where(-n > width, -NEXT_PIXEL, -reach), np.where(n > width, NEXT_PIXEL, reach)
    return np.concatenate([low, high], -1)


def rim_diameter(rim: Rim) -> np.ndarray:
    return np.where(rim.drop > 0, (rim.drop * rim.drop + rim.width * rim.width) / rim.width, F(0))


def draws_rim(splat: Footprint, z: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    enlarged = splat.inverse_depth * z * mean_focal_length(target) / mean_focal_length(source)
    return (enlarged <= ENLARGED) & (splat_bends(splat, splat_reach(F(1), False)) <= FLAT)


def rim_slope(rim: Rim, ray: np.ndarray, own: np.ndarray, source: np.ndarray) -> np.ndarray:
    facing = np.stack(facing_slope((ray[..., 0], ray[..., 1]), source), -1)
    plane = own[..., 3:] * inverse_depth_slope(own[..., :3], ray, own[..., 3], source)
    return np.where((rim.drop > 0)[..., None], facing, plane)


def rim_box(
    rim: Rim, pixel: np.ndarray, own: np.ndarray, source: np.ndarray, view: np.ndarray, target: np.ndarray
) -> np.ndarray:
    ray, w = pixel_ray(pixel, source), (F(1) / own[..., 3])[..., None]
    slope, reach, diameter = w * rim_slope(rim, ray, own, source), rim_reach(rim), rim_diameter(rim)
    inward = np.minimum(rim.width + NEXT_PIXEL * np.abs(rim.outward).sum(-1), F(0.5) * diameter)
    top = np.sqrt(inward * (diameter - inward)) - rim.drop
    turn, shift = view[:3, :3], view[:3, 3]
    h = _turned(turn, ray) + shift * w
    h_u = turn[:, 0] / source[0] + shift * slope[..., :1]
    h_v = turn[:, 1] / source[1] + shift * slope[..., 1:]
    h_t = shift * (w / mean_focal_length(source))
    low, high = np.full((len(w), 2), F(1e9)), np.full((len(w), 2), F(-1e9))
    for k in range(8):
        u, v = reach[..., 0 if k & 1 == 0 else 2, None], reach[..., 1 if k & 2 == 0 else 3, None]
        corner = h + h_u * u + h_v * v + h_t * (top if k & 4 == 0 else -rim.drop)[..., None]
        corner[..., 2] = np.maximum(corner[..., 2], BEHIND * h[..., 2])
        at = project(corner, target)
        low, high = np.minimum(low, at), np.maximum(high, at)
    return np.concatenate([low, high], -1)


def roots_of(square: np.ndarray, linear: np.ndarray, constant: np.ndarray) -> np.ndarray:
    rest = linear * linear - F(4) * square * constant
    root = np.sqrt(np.maximum(rest, F(0)))
    q = F(-0.5) * (linear + np.where(linear < 0, -root, root))
    return np.where((rest >= 0)[..., None], np.stack([q / square, constant / q], -1), BOTTOMLESS)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def rim_inverse_depth(
    rim: Rim,
    pixel: np.ndarray,
    own: np.ndarray,
    inverse_depth: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> np.ndarray:
    ray = pixel_ray(pixel, source)
    slope = rim_slope(rim, ray, own, source)
    focal, closer, diameter = mean_focal_length(source), inverse_depth * own[..., 3], rim_diameter(rim)
    change = -inverse_depth[..., None] * (view[:3, 3] @ view[:3, :3])
    start = pixel_ray(target_pixel, target) @ view[:3, :3] + change
    for line in (start, change):
        line[..., :2] = source[:2] * line[..., :2] + (source[2:] - pixel) * line[..., 2:]
    drop, width = rim.drop, rim.width
    before = [focal * (closer - (line[..., 2] + _along(slope, line))) + drop * line[..., 2] for line in (start, change)]
    inside = [width * line[..., 2] - _along(rim.outward, line) for line in (start, change)]
    plane = -before[0] / before[1]
    circle = roots_of(
        before[1] * before[1] + inside[1] * (inside[1] - diameter * change[..., 2]),
        F(2) * (before[0] * before[1] + inside[0] * inside[1])
        - diameter * (inside[0] * change[..., 2] + inside[1] * start[..., 2]),
        before[0] * before[0] + inside[0] * (inside[0] - diameter * start[..., 2]),
    )
    share = np.where((diameter > 0)[..., None], circle, plane[..., None])
    reach, nearest = rim_reach(rim), np.zeros_like(inverse_depth)
    for k in range(2):
        here = share[..., k]
        place = start + here[..., None] * change
        off = place[..., :2] / place[..., 2:]
        reaches = (off >= reach[..., :2]).all(-1) & (off <= reach[..., 2:]).all(-1)
        ends = (inside[0] + here * inside[1] < 0) | ((diameter > 0) & (before[0] + here * before[1] < 0))
        meets = (place[..., 2] > 0) & (here > -1) & reaches & ~ends
        nearest = np.where(meets, np.maximum(nearest, inverse_depth * (F(1) + here)), nearest)
    return nearest


def _along(direction: np.ndarray, line: np.ndarray) -> np.ndarray:
    return dot(direction, line[..., :2])[..., 0]


def _turned(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return vector[..., :1] * turn[:, 0] + vector[..., 1:2] * turn[:, 1] + vector[..., 2:] * turn[:, 2]
