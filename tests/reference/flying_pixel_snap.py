"""Mirror of shaders/common/flying_pixel_snap.glsl, for n samples at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import pixel_ray
from .upsample_vote import Facet, add_facet, color_likeness, facet_at, gaussian
from .vectors import dot, normalize, texel

F = np.float32
SNAP_WINDOW, SNAP_REACH, LEAST_SHARE, STEEP, STEEP_WEIGHT = 7, 1.5, 0.05, 0.35, 0.01


class Side(NamedTuple):
    plane: np.ndarray  # (n, 4)
    total: np.ndarray  # (n,)
    alike: np.ndarray  # (n,)


def is_steep(facet: Facet, source: np.ndarray) -> np.ndarray:
    return -dot(facet.surface[..., :3], normalize(pixel_ray(facet.pixel, source)))[..., 0] < F(STEEP)


def needs_snap(surface_map: np.ndarray, mixing_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    last = np.array(mixing_map.shape[1::-1]) - 1
    around = [np.clip(pixel + np.array([k % 3 - 1, k // 3 - 1]), 0, last) for k in range(9)]
    beside = np.max([texel(mixing_map, place)[..., 0] for place in around], axis=0)
    facet = facet_at(surface_map, pixel, source)
    is_tilted = (beside > 0) & (facet.surface[..., 3] > 0) & is_steep(facet, source)
    return (texel(mixing_map, pixel)[..., 0] > 0) | is_tilted


def snap_offset(k: int) -> np.ndarray:
    return np.array([k % SNAP_WINDOW, k // SNAP_WINDOW]) - SNAP_WINDOW // 2


def add_to_side(side: Side, weight: np.ndarray, likeness: np.ndarray, facet: Facet, at: np.ndarray) -> Side:
    return Side(add_facet(side.plane, weight, facet, at), side.total + weight, side.alike + weight * likeness)


def mean_likeness(side: Side) -> np.ndarray:
    return np.where(side.total > 0, side.alike / np.where(side.total > 0, side.total, F(1)), F(0))


def range_around(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> np.ndarray:
    most, least = np.zeros(len(pixel), F), np.full(len(pixel), F(1e30))
    for k in range(SNAP_WINDOW**2):
        z = facet_at(surface_map, pixel + snap_offset(k), source).surface[..., 3]
        w = F(1) / np.where(z > 0, z, F(1))
        most, least = np.where(z > 0, np.maximum(most, w), most), np.where(z > 0, np.minimum(least, w), least)
    return np.where((most > 0)[..., None], np.stack([most, least], -1), F(0))


def snap_sample(
    surface_map: np.ndarray, guide_map: np.ndarray, pixel: np.ndarray, w: np.ndarray, source: np.ndarray
) -> np.ndarray:
    most, least = range_around(surface_map, pixel, source).T
    color, nothing = texel(guide_map, pixel)[..., :3], np.zeros(len(pixel), F)
    near = far = Side(np.zeros((len(pixel), 4), F), nothing, nothing)
    last = np.array(guide_map.shape[1::-1]) - 1
    for k in range(SNAP_WINDOW**2):
        place = pixel + snap_offset(k)
        facet = facet_at(surface_map, place, source)
        z, known = facet.surface[..., 3], facet.surface[..., 3] > 0
        weight = gaussian(snap_offset(k).astype(F), SNAP_REACH) * np.where(
            is_steep(facet, source), F(STEEP_WEIGHT), F(1)
        )
        likeness = color_likeness(color, texel(guide_map, np.clip(place, 0, last))[..., :3])
        is_near = F(1) / np.where(known, z, F(1)) > F(0.5) * (most + least)
        near = add_to_side(near, np.where(known & is_near, weight, F(0)), likeness, facet, pixel.astype(F))
        far = add_to_side(far, np.where(known & ~is_near, weight, F(0)), likeness, facet, pixel.astype(F))
    share = np.clip((w - least) / np.maximum(most - least, F(1e-30)), F(LEAST_SHARE), F(1 - LEAST_SHARE))
    is_near = (share * mean_likeness(near) > (F(1) - share) * mean_likeness(far)) | (far.total == 0)
    plane = np.where(is_near[..., None], near.plane, far.plane)
    total = np.where(is_near, near.total, far.total)[..., None]
    normal = normalize(np.where(total > 0, plane[..., :3], F(1)))
    depth = total / np.where(total > 0, plane[..., 3:], F(1))
    return np.where(total > 0, np.concatenate([normal, depth], -1), F(0))
