"""Mirror of shaders/common/hidden_planes.glsl, for n pixels at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import pixel_ray
from .splat import inverse_depth_slope
from .splat_corners import surface_at
from .texels import texel_or_zero
from .vectors import dot, normalize

F = np.float32
STEP_UP, MEETING, WELL_BEHIND = F(0.04), F(0.02), F(0.015)
FARTHEST, LAYERS = 96, 2


class Side(NamedTuple):
    inverse_depth: np.ndarray  # (n,)
    normal: np.ndarray  # (n, 3)
    places: np.ndarray  # (n,)


def find_sides(
    surface_map: np.ndarray, middle: np.ndarray, direction: np.ndarray, stride: int, source: np.ndarray
) -> list[Side]:
    count = len(middle)
    sides = [Side(np.zeros(count, F), np.zeros((count, 3), F), np.zeros(count, F)) for _ in range(LAYERS)]
    before = surface_at(surface_map, middle)[..., 3]
    goes_on, found = before > 0, np.zeros(count, int)
    for k in range(1, FARTHEST + 1):
        place = middle + k * stride * direction
        there = texel_or_zero(surface_map, place)
        z = np.abs(there[..., 3])
        steps_back = goes_on & (z > before * (F(1) + STEP_UP))
        depth = np.where(z > 0, z, F(1))
        slope = inverse_depth_slope(there[..., :3], pixel_ray(place.astype(F), source), depth, source)
        along = dot(slope, np.broadcast_to(direction, slope.shape).astype(F))[..., 0]
        plane = Side(F(1) / depth - F(k * stride) * along, there[..., :3], np.full(count, F(k)))
        for layer in range(LAYERS):
            is_here = steps_back & (found == layer)
            sides[layer] = Side(*(_choose(is_here, *pair) for pair in zip(plane, sides[layer], strict=True)))
        found = found + steps_back
        goes_on = goes_on & (found < LAYERS) & (z > 0)
        before = z
        if not goes_on.any():
            break
    return sides


def between(one: Side, other: Side, seen: np.ndarray) -> np.ndarray:
    known = np.minimum(one.inverse_depth, other.inverse_depth) > 0
    share = one.places / np.where(known, one.places + other.places, F(1))
    inverse_depth = one.inverse_depth + (other.inverse_depth - one.inverse_depth) * share
    meets = np.abs(one.inverse_depth - other.inverse_depth) < MEETING * inverse_depth
    known = known & meets & (inverse_depth <= seen * (F(1) - WELL_BEHIND))
    mixed = one.normal + (other.normal - one.normal) * share[:, None]
    normal = normalize(np.where(known[:, None], mixed, np.array((0, 0, 1), F)))
    surface = np.concatenate([normal, F(1) / np.where(known, inverse_depth, F(1))[:, None]], -1)
    return np.where(known[:, None], surface, F(0))


def bridge(surface_map: np.ndarray, pixel: np.ndarray, stride: int, source: np.ndarray) -> np.ndarray:
    seen = F(1) / np.maximum(surface_at(surface_map, pixel)[..., 3], F(1e-9))
    found = np.zeros((len(pixel), 4), F)
    for direction in np.array([(1, 0), (0, 1)]):
        before = find_sides(surface_map, pixel, -direction, stride, source)
        after = find_sides(surface_map, pixel, direction, stride, source)
        for j in range(LAYERS * LAYERS):
            other = between(before[j // LAYERS], after[j % LAYERS], seen)
            found = _choose(found[:, 3] == 0, other, found)
    return found


def _choose(condition: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.where(condition.reshape(-1, *[1] * (one.ndim - 1)), one, other)
