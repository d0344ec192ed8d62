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
TURNED_AWAY, BENT = F(0.5), F(0.75)
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


def find_outline(
    surface_map: np.ndarray, middle: np.ndarray, direction: np.ndarray, stride: int, source: np.ndarray
) -> np.ndarray:
    def cosine_of(surface: np.ndarray, place: np.ndarray) -> np.ndarray:
        return np.abs(dot(surface[:, :3], normalize(pixel_ray(place.astype(F), source)))[..., 0])

    count = len(middle)
    away, pace = np.full(count, -stride), np.full(count, stride)
    place = middle - stride * direction
    found, last = np.zeros((count, 3), F), texel_or_zero(surface_map, place).copy()
    last[:, 3] = np.abs(last[:, 3])
    cosine = inside = cosine_of(last, place)
    goes_on = np.ones(count, bool)
    for _ in range(FARTHEST):
        place = middle + (away + pace)[:, None] * direction
        there = texel_or_zero(surface_map, place)
        z = np.abs(there[:, 3])
        ends = (z == 0) | (z > last[:, 3] * (F(1) + STEP_UP))
        is_hidden = (z > 0) & (z < last[:, 3] * (F(1) - STEP_UP))
        is_last = goes_on & (is_hidden | (ends & ((away < 0) | (pace == 1))))
        bends = is_last & ~is_hidden & (cosine < TURNED_AWAY) & (cosine < BENT * inside) & (away >= 0)
        found = _choose(bends, np.column_stack([last[:, 3], away.astype(F), cosine]), found)
        goes_on = goes_on & ~is_last
        steps = goes_on & ~ends
        inside = np.where(steps & (pace == stride), cosine, inside)
        cosine = np.where(steps, cosine_of(there, place), cosine)
        last = _choose(steps, np.column_stack([there[:, :3], z]), last)
        away, pace = away + np.where(steps, pace, 0), np.where(goes_on & ends, 1, pace)
        if not goes_on.any():
            break
    return found


def back_of(one: np.ndarray, other: np.ndarray, seen: np.ndarray, ray: np.ndarray, focal: np.float32) -> np.ndarray:
    known = np.minimum(one[:, 0], other[:, 0]) > 0
    width = np.maximum(one[:, 1] + other[:, 1], F(1))
    first, second = (F(1) / np.where(known, outline[:, 0], F(1)) for outline in (one, other))
    depth = F(1) / (first + (second - first) * (one[:, 1] / width))
    z = F(2) * depth * (F(1) + F(0.25) * (one[:, 2] + other[:, 2]) * width / focal) - seen[:, 3]
    normal = F(2) * dot(seen[:, :3], ray) * ray - seen[:, :3]
    is_behind = known & (z > seen[:, 3] * (F(1) + WELL_BEHIND))
    return _choose(is_behind, np.column_stack([normal, z]), np.zeros_like(seen))


def hidden_at(surface_map: np.ndarray, pixel: np.ndarray, stride: int, source: np.ndarray) -> np.ndarray:
    found, seen = bridge(surface_map, pixel, stride, source), surface_at(surface_map, pixel)
    ray = normalize(pixel_ray(pixel.astype(F), source))
    for direction, focal in zip(np.array([(1, 0), (0, 1)]), np.abs(source[:2]), strict=True):
        before, after = (find_outline(surface_map, pixel, way, stride, source) for way in (-direction, direction))
        found = _choose(found[:, 3] == 0, back_of(before, after, seen, ray, focal), found)
    return found


def _choose(condition: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.where(condition.reshape(-1, *[1] * (one.ndim - 1)), one, other)
