"""Mirror of shaders/common/rim_splat.glsl."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .camera import mean_focal_length, pixel_ray, project
from .inverse_depth import facing_slope
from .rim_marks import BOTTOMLESS
from .rims import Rim
from .splat import FLAT, Footprint, splat_bends, splat_reach
from .vectors import dot

F = np.float32
NEXT_PIXEL, OUTLINE_NEAR = F(0.98), F(1.16)
ENLARGED = F(8)
BEHIND = F(0.1)
ENDS_HIDDEN = F(0.5)


def open_reach(rim: Rim) -> np.ndarray:
    x, y = np.moveaxis(OUTLINE_NEAR * rim.outward, -1, 0)
    n = np.stack([-x, x, -y, y], -1)
    reach = np.where(n > rim.width[..., None], NEXT_PIXEL, splat_reach(F(1), False))
    return reach[..., [0, 2, 1, 3]] * np.array((-1, -1, 1, 1), F)


def rim_reach(rim: Rim) -> np.ndarray:
    hidden = (np.sign(rim.hidden) * (rim.hidden + ENDS_HIDDEN))[..., [0, 2, 1, 3]]
    reach = open_reach(rim)
    low, high = np.minimum(reach[..., :2], -hidden[..., :2]), np.maximum(reach[..., 2:], hidden[..., 2:])
    return np.concatenate([low, high], -1)


def is_hidden(rim: Rim, off: np.ndarray) -> np.ndarray:
    open_ = open_reach(rim)
    return np.logical_not(_within(off, open_).all(-1))


def rim_comes_to(off: np.ndarray, open_: np.ndarray, reach: np.ndarray) -> np.ndarray:
    return np.logical_and(_within(off, reach).all(-1), _within(off, open_).any(-1))


def rim_diameter(rim: Rim) -> np.ndarray:
    return np.where(rim.drop > 0, (rim.drop * rim.drop + rim.width * rim.width) / rim.width, F(0))


def draws_rim(splat: Footprint, z: np.ndarray, source: np.ndarray, target: np.ndarray) -> np.ndarray:
    enlarged = splat.inverse_depth * z * mean_focal_length(target) / mean_focal_length(source)
    return (enlarged <= ENLARGED) & (splat_bends(splat, splat_reach(F(1), False)) <= FLAT)


def rim_slope(rim: Rim, ray: np.ndarray, source: np.ndarray) -> np.ndarray:
    facing = np.stack(facing_slope((ray[..., 0], ray[..., 1]), source), -1)
    return np.where((rim.drop > 0)[..., None], facing, rim.slope)


def folds_exist(rim: Rim) -> np.ndarray:
    return (rim.folds[..., 0] > 0).astype(F)


def fold_drop(rim: Rim, slope: np.ndarray, off: np.ndarray, focal: np.ndarray) -> np.ndarray:
    planes = rim.folds[..., 0] + (rim.folds[..., 1:] * off[:, None]).sum(-1)
    below = folds_exist(rim) * focal * (F(1) + dot(slope, off) - planes)
    return np.maximum(below.max(-1), F(0))


def rim_box(
    rim: Rim, pixel: np.ndarray, own: np.ndarray, source: np.ndarray, view: np.ndarray, target: np.ndarray
) -> np.ndarray:
    ray, w = pixel_ray(pixel, source), (F(1) / own[..., 3])[..., None]
    slope, reach, diameter = rim_slope(rim, ray, source), rim_reach(rim), rim_diameter(rim)
    focal, farthest = mean_focal_length(source), np.maximum(-reach[..., :2], reach[..., 2:])
    inward = np.minimum(rim.width + dot(farthest, np.abs(rim.outward))[..., 0], F(0.5) * diameter)
    top = np.sqrt(inward * (diameter - inward)) - rim.drop
    turn, shift = view[:3, :3], view[:3, 3]
    h = _turned(turn, ray) + shift * w
    h_u = turn[:, 0] / source[0] + shift * (w * slope[..., :1])
    h_v = turn[:, 1] / source[1] + shift * (w * slope[..., 1:])
    h_t = shift * (w / focal)
    low, high = np.full((len(w), 2), F(1e9)), np.full((len(w), 2), F(-1e9))
    for k in range(8):
        u, v = reach[..., 0 if k & 1 == 0 else 2, None], reach[..., 1 if k & 2 == 0 else 3, None]
        fallen = np.where(diameter > 0, rim.drop, fold_drop(rim, slope, np.concatenate([u, v], -1), focal))
        corner = h + h_u * u + h_v * v + h_t * (top if k & 4 == 0 else -fallen)[..., None]
        corner[..., 2] = np.maximum(corner[..., 2], BEHIND * h[..., 2])
        at = project(corner, target)
        low, high = np.minimum(low, at), np.maximum(high, at)
    return np.concatenate([low, high], -1)


def roots_of(square: np.ndarray, linear: np.ndarray, constant: np.ndarray) -> np.ndarray:
    rest = linear * linear - F(4) * square * constant
    root = np.sqrt(np.maximum(rest, F(0)))
    q = F(-0.5) * (linear + np.where(linear < 0, -root, root))
    return np.where((rest >= 0)[..., None], np.stack([q / square, constant / q], -1), BOTTOMLESS)


def meet_folds(
    rim: Rim,
    before: Sequence[np.ndarray],
    closer: np.ndarray,
    focal: np.ndarray,
    start: np.ndarray,
    change: np.ndarray,
) -> np.ndarray:
    none, own = -BOTTOMLESS, -before[0] / before[1]
    entry, leaving = np.where(before[1] > 0, own, none), np.where(before[1] > 0, -none, own)
    for fold in np.moveaxis(rim.folds[..., [1, 2, 0]], -2, 0):
        other = [focal * (closer - dot(fold, line)[..., 0]) for line in (start, change)]
        met, exists = -other[0] / other[1], fold[..., 2] > 0
        entry = np.where(exists & (other[1] > 0), np.minimum(entry, met), entry)
        leaving = np.where(exists & (other[1] <= 0), np.maximum(leaving, met), leaving)
    return np.where(entry == none, leaving, np.where(entry >= leaving, entry, -none))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def meet_rim(
    rim: Rim,
    pixel: np.ndarray,
    own: np.ndarray,
    inverse_depth: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    ray = pixel_ray(pixel, source)
    slope = rim_slope(rim, ray, source)
    focal, closer, diameter = mean_focal_length(source), inverse_depth * own[..., 3], rim_diameter(rim)
    change = -inverse_depth[..., None] * (view[:3, 3] @ view[:3, :3])
    start = pixel_ray(target_pixel, target) @ view[:3, :3] + change
    for line in (start, change):
        line[..., :2] = source[:2] * line[..., :2] + (source[2:] - pixel) * line[..., 2:]
    drop, width = rim.drop, rim.width
    before = [focal * (closer - (line[..., 2] + _along(slope, line))) + drop * line[..., 2] for line in (start, change)]
    inside = [width * line[..., 2] - _along(rim.outward, line) for line in (start, change)]
    plane = meet_folds(rim, before, closer, focal, start, change)
    circle = roots_of(
        before[1] * before[1] + inside[1] * (inside[1] - diameter * change[..., 2]),
        F(2) * (before[0] * before[1] + inside[0] * inside[1])
        - diameter * (inside[0] * change[..., 2] + inside[1] * start[..., 2]),
        before[0] * before[0] + inside[0] * (inside[0] - diameter * start[..., 2]),
    )
    share = np.where((diameter > 0)[..., None], circle, plane[..., None])
    open_, reach, nearest = open_reach(rim), rim_reach(rim), np.zeros_like(inverse_depth)
    nearest_off = np.zeros_like(start[..., :2])
    for k in range(2):
        here = share[..., k]
        place = start + here[..., None] * change
        off = place[..., :2] / place[..., 2:]
        ends = (inside[0] + here * inside[1] < 0) | ((diameter > 0) & (before[0] + here * before[1] < 0))
        meets = (place[..., 2] > 0) & (here > -1) & rim_comes_to(off, open_, reach) & ~ends
        met = inverse_depth * (F(1) + here)
        nearer = meets & (met > nearest)
        nearest, nearest_off = np.where(nearer, met, nearest), np.where(nearer[..., None], off, nearest_off)
    return nearest, nearest_off


def _within(off: np.ndarray, box: np.ndarray) -> np.ndarray:
    """(n, 2) whether across and down a place lies in a box: left, top, right, bottom."""
    return np.logical_and(off >= box[..., :2], off <= box[..., 2:])


def _along(direction: np.ndarray, line: np.ndarray) -> np.ndarray:
    return dot(direction, line[..., :2])[..., 0]


def _turned(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return vector[..., :1] * turn[:, 0] + vector[..., 1:2] * turn[:, 1] + vector[..., 2:] * turn[:, 2]
