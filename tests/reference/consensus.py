"""Mirror of shaders/common/consensus.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray, project
from .depth_lookup import SAME_SURFACE, inverse_depth_at
from .splat import inverse_depth_slope, lies_on_plane
from .splat_corners import corner_pixel, corner_surface, corners_at, seen_corner, surface_at
from .texels import texel_at
from .vectors import dot, normalize

F = np.float32
NO_OVERLAP, SEE_THROUGH = F(1e30), F(0.02)
DARKEST, BRIGHTEST = F(0.059), F(0.941)
EDGE_REACH, BORDER_REACH = 4, 24
CONTESTED, FLAT_COSINE, DENSER = F(0.75), F(0.25), F(1.3)


def carry_forth(
    pixel: np.ndarray, w: np.ndarray, source: np.ndarray, view: np.ndarray, other: np.ndarray
) -> np.ndarray:
    h = pixel_ray(pixel, source) @ view[:3, :3].T + view[:3, 3] * w[..., None]
    return np.concatenate([project(h, other), (w / h[..., 2])[..., None]], -1)


def faces(normal: np.ndarray, direction: np.ndarray) -> np.ndarray:
    return (normal * direction).sum(-1) < 0


def lies_inside(there: np.ndarray, size: np.ndarray) -> np.ndarray:
    at = there[..., :2]
    return (there[..., 2] > 0) & (at >= F(-0.5)).all(-1) & (at < size - F(0.5)).all(-1)


def depth_excess(surface_map: np.ndarray, there: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    inside = lies_inside(there, np.array(surface_map.shape[1::-1], F))
    at, w = np.where(inside[..., None], there[..., :2], F(0)), np.where(inside, there[..., 2], F(1))
    corners = corners_at(surface_map, at)
    side = seen_corner(corners, at, w)
    own, pixel = corner_surface(corners, side), corner_pixel(corners, side).astype(F)
    known = inside & (own[..., 3] > 0)
    z = np.where(known, own[..., 3], F(1))
    normal = np.where(known[..., None], own[..., :3], np.array([0, 0, -1], F))
    slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics), z, intrinsics)
    return np.where(known, w / inverse_depth_at(at, pixel, F(1) / z, slope) - F(1), NO_OVERLAP)


def vote_on(surface_map: np.ndarray, there: np.ndarray, intrinsics: np.ndarray, band: float) -> np.ndarray:
    inside = lies_inside(there, np.array(surface_map.shape[1::-1], F))
    at, w = np.where(inside[..., None], there[..., :2], F(0)), np.where(inside, there[..., 2], F(1))
    depth = np.stack([np.abs(corner[..., 3]) for corner in corners_at(surface_map, at)[2:]], -1)
    beyond = (depth * w[..., None] > F(1) + np.maximum(F(2) * F(band), SEE_THROUGH)).all(-1)
    supports = np.abs(depth_excess(surface_map, there, intrinsics)) < F(band)
    return np.stack([inside & supports, inside & beyond], -1).astype(F)


def point_density(own: np.ndarray, pixel: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    facing = -dot(own[..., :3], normalize(pixel_ray(pixel, intrinsics)))[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.abs(intrinsics[0] * intrinsics[1]) * np.maximum(facing, F(0)) / (own[..., 3] * own[..., 3])


def shows_better(
    surface_map: np.ndarray, there: np.ndarray, intrinsics: np.ndarray, band: float, density: np.ndarray
) -> np.ndarray:
    corners = corners_at(surface_map, there[..., :2])
    side = seen_corner(corners, there[..., :2], there[..., 2])
    own, pixel = corner_surface(corners, side), corner_pixel(corners, side).astype(F)
    known = own[..., 3] > 0
    z = np.where(known, own[..., 3], F(1))
    normal = np.where(known[..., None], own[..., :3], np.array([0, 0, -1], F))
    slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics), z, intrinsics)
    better = known & (point_density(own, pixel, intrinsics) > DENSER * density)
    low, high = corners.low.astype(F), corners.high.astype(F)
    for corner, x, y in (
        (corners.a, low, low),
        (corners.b, high, low),
        (corners.c, low, high),
        (corners.d, high, high),
    ):
        off = np.stack([x[..., 0], y[..., 1]], -1) - pixel
        better &= lies_on_plane(corner[..., 3], off, z, slope, 2 * float(band))
    return better


def is_shown_better(
    votes_map: np.ndarray, surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray
) -> np.ndarray:
    own, last = surface_at(surface_map, pixel), np.array(surface_map.shape[1::-1]) - 1
    known = own[..., 3] > 0
    z = np.where(known, own[..., 3], F(1))
    normal = np.where(known[..., None], own[..., :3], np.array([0, 0, -1], F))
    slope = inverse_depth_slope(normal, pixel_ray(pixel.astype(F), source), z, source)
    all_are = texel_at(votes_map, pixel)[..., 2] > 0
    for k in range(9):
        following = np.clip(pixel + np.array([k % 3 - 1, k // 3 - 1]), 0, last)
        there, off = surface_at(surface_map, following)[..., 3], (following - pixel).astype(F)
        goes_on = lies_on_plane(there, off, own[..., 3], slope, float(SAME_SURFACE))
        all_are &= ~goes_on | (texel_at(votes_map, following)[..., 2] > 0)
    return all_are


def end_vote(
    surface_map: np.ndarray, there: np.ndarray, intrinsics: np.ndarray, band: float, is_exact: bool
) -> np.ndarray:
    inside = lies_inside(there, np.array(surface_map.shape[1::-1], F))
    at, w = np.where(inside[..., None], there[..., :2], F(0)), np.where(inside, there[..., 2], F(1))
    corners, share, band = corners_at(surface_map, at), at - np.floor(at), F(band)
    total = np.zeros_like(w)
    for right, below in ((0, 0), (1, 0), (0, 1), (1, 1)):
        side = np.broadcast_to(np.array([right, below], bool), at.shape)
        surface, pixel = corner_surface(corners, side), corner_pixel(corners, side).astype(F)
        weight = np.where(side, share, F(1) - share).prod(-1)
        known = surface[..., 3] > 0
        z = np.where(known, surface[..., 3], F(1))
        normal = np.where(known[..., None], surface[..., :3], np.array([0, 0, -1], F))
        slope = inverse_depth_slope(normal, pixel_ray(pixel, intrinsics), z, intrinsics)
        excess = w / inverse_depth_at(at, pixel, F(1) / z, slope) - F(1)
        beyond = np.minimum(excess, z * w - F(1)) > band
        vote = np.where(np.abs(excess) < F(0.5) * band, F(1), np.where(beyond, F(-1), F(0)))
        total += weight * np.where(known, vote, F(-1 if is_exact else 0))
    return np.where(inside, total, F(0))


def log_ratio(
    encoded: np.ndarray, other_encoded: np.ndarray, linear: np.ndarray, other_linear: np.ndarray
) -> np.ndarray:
    clipped = (np.minimum(encoded, other_encoded) < DARKEST) | (np.maximum(encoded, other_encoded) > BRIGHTEST)
    return np.where(clipped, NO_OVERLAP, np.log(np.maximum(linear, F(1e-6)) / np.maximum(other_linear, F(1e-6))))


def surface_ends(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    own, last = surface_at(surface_map, pixel), np.array(surface_map.shape[1::-1]) - 1
    known = own[..., 3] > 0
    z = np.where(known, own[..., 3], F(1))
    normal = np.where(known[..., None], own[..., :3], np.array([0, 0, -1], F))
    slope = inverse_depth_slope(normal, pixel_ray(pixel.astype(F), source), z, source)
    ends = ~known
    for step in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        following = np.clip(pixel + step, 0, last)
        there = surface_at(surface_map, following)[..., 3]
        ends |= ~lies_on_plane(there, (following - pixel).astype(F), own[..., 3], slope, float(SAME_SURFACE))
    return ends.astype(F)


def end_in_row(ends_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    found, last = np.full(pixel.shape[:-1], EDGE_REACH), np.array(ends_map.shape[1::-1]) - 1
    for k in range(-EDGE_REACH, EDGE_REACH + 1):
        place = np.clip(pixel + np.array([k, 0]), 0, last)
        away = np.abs(place[..., 0] - pixel[..., 0])
        found = np.where(texel_at(ends_map, place) > 0.5, np.minimum(found, away), found)
    return found.astype(F) / F(EDGE_REACH)


def end_around(rows_map: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    found, last = np.full(pixel.shape[:-1], EDGE_REACH), np.array(rows_map.shape[1::-1]) - 1
    for k in range(-EDGE_REACH, EDGE_REACH + 1):
        place = np.clip(pixel + np.array([0, k]), 0, last)
        across = (texel_at(rows_map, place) * F(EDGE_REACH) + F(0.5)).astype(int)
        nearer = np.minimum(found, np.maximum(across, np.abs(place[..., 1] - pixel[..., 1])))
        found = np.where(across < EDGE_REACH, nearer, found)
    return found


def trust_in(
    votes: np.ndarray, edge: np.ndarray, border: np.ndarray, cosine: np.ndarray, is_exact: bool = False
) -> np.ndarray:
    support, through = votes[..., 0], votes[..., 1]
    floats = through > support + (edge >= 2)
    flies = (not is_exact) & ((edge == 0) | ((edge == 1) & (cosine < FLAT_COSINE))) & (support == 0)
    quality = edge.astype(F) / F(EDGE_REACH) * np.minimum(border, BORDER_REACH).astype(F) / F(BORDER_REACH)
    trust = np.where(floats | flies, F(0), np.where(through > 0, CONTESTED, F(1)))
    return np.stack([trust, np.maximum(quality, F(1) / F(255))], -1)
