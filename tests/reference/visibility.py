"""Mirror of shaders/common/visibility.glsl."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import mean_focal_length, pixel_ray
from .texels import texel_at
from .vectors import dot, length, normalize

F = np.float32
SECTORS, STEPS, PLANES = 32, 10, 4
THIN, STEEP, ON_PLANE, MISSED = F(0.12), F(4), F(0.01), F(1e15)


class Plane(NamedTuple):
    way: np.ndarray
    across: np.ndarray
    m: np.ndarray
    share: np.ndarray
    v: np.ndarray
    tilt: np.ndarray
    hidden: np.ndarray


def plane_of(pixel: np.ndarray) -> np.ndarray:
    x, y = np.asarray(pixel)[..., 0], np.asarray(pixel)[..., 1]
    return np.stack([((((x + y) & 3) << 2) + (x & 3)) / F(16), ((y - x) & 3) / F(4)], -1).astype(F)


def sector_bits(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return uint32, of the sectors between two places."""
    first = np.floor(np.minimum(one, other) * F(SECTORS) + F(0.5)).astype(np.int64)
    count = np.floor(np.maximum(one, other) * F(SECTORS) + F(0.5)).astype(np.int64) - first
    return np.where(count > 0, ((1 << np.maximum(count, 0)) - 1) << np.minimum(first, SECTORS - 1), 0).astype(np.uint32)


def sector_place(direction: np.ndarray, end: float) -> np.ndarray:
    across = direction[..., 1] / np.sqrt(np.maximum((direction * direction).sum(-1), F(1e-20)))
    return np.where(direction[..., 0] > 0, F(0.5) + F(0.5) * across, F(end))


def bits_in_fours(bits: np.ndarray) -> np.ndarray:
    pairs = bits - ((bits >> 1) & np.uint32(0x55555555))
    return (pairs & np.uint32(0x33333333)) + ((pairs >> 2) & np.uint32(0x33333333))


def plane_through(pixel, turned, point, n, intrinsics) -> Plane:
    v = normalize(-point)
    angle = (plane_of(pixel)[..., :1] + F(turned)) * F(3.14159265)
    way = np.concatenate([np.cos(angle), np.sin(angle)], -1)
    along = np.concatenate([way / intrinsics[:2], np.zeros_like(angle)], -1)
    t = normalize(along - v * dot(along, v))
    normal = np.concatenate([dot(n, v), dot(n, t)], -1)
    share = length(normal)
    normal = np.where(share > 0, normal / np.where(share > 0, share, F(1)), np.array([1, 0], F))
    c, s = normal[..., :1], normal[..., 1:]
    hidden = np.zeros(point.shape[:-1], np.uint32)
    return Plane(
        way, c * t - s * v, c * v + s * t, share[..., 0], np.concatenate([c, -s], -1), normal[..., ::-1], hidden
    )


def step_place(pixel, texel, plane: Plane, k: int, reach) -> np.ndarray:
    i = F(k % STEPS)
    far = (i + plane_of(pixel)[..., 1:]) / F(STEPS)
    offset = np.maximum(far * far * np.asarray(reach)[..., None], F(1.5) + i)
    return np.floor(texel + (offset if k < STEPS else -offset) * plane.way + F(0.5))


def hidden_by(away, plane: Plane, k: int, thickness) -> np.ndarray:
    end = 1 - k // STEPS
    front = np.concatenate([dot(away, plane.m), dot(away, plane.across)], -1)
    behind = front - np.asarray(thickness)[..., None] * plane.v
    return sector_bits(sector_place(front, end), sector_place(behind, end))


def run_of(run, step, v) -> np.ndarray:
    deep = dot(step, v)[..., 0]
    wide = np.sqrt(np.maximum((step * step).sum(-1) - deep * deep, F(0)))
    return np.where((np.abs(deep) < STEEP * wide) & (wide < F(1e-5) * MISSED), run + wide, F(0)).astype(F)


def sum_of_sectors(plane: Plane, sectors: np.ndarray) -> np.ndarray:
    fours = bits_in_fours(sectors)
    total = np.zeros((*sectors.shape, 4), F)
    for k in range(8):
        sine = F((k - 3.5) / 4)
        x, y = np.sqrt(F(1) - sine * sine), sine
        weight = ((fours >> np.uint32(4 * k)) & 15) * np.abs(x * plane.tilt[..., 0] + y * plane.tilt[..., 1])
        direction = x * plane.m + y * plane.across
        total += weight[..., None] * np.concatenate([direction, np.ones_like(direction[..., :1])], -1)
    return (total * plane.share[..., None] / F(16)).astype(F)


def weight_of_plane(plane: Plane) -> np.ndarray:
    return sum_of_sectors(plane, np.full_like(plane.hidden, 0xFFFFFFFF))[..., 3]


def met_at(surface, place, at, intrinsics) -> np.ndarray:
    ray, z = pixel_ray(np.asarray(at, F), intrinsics), np.abs(surface[..., 3:])
    here, beyond = dot(surface[..., :3], pixel_ray(np.asarray(place, F), intrinsics)), dot(surface[..., :3], ray)
    farther = z * here / np.where(beyond == 0, F(1e-30), beyond)
    z = np.where((place == at).all(-1, keepdims=True), z, farther)
    return np.where(z > 0, ray * z, MISSED)


def look_along(surface_map, pixel, texel, own, intrinsics, radius, turned) -> Plane:
    return look_among(surface_map, surface_map, False, 0, pixel, texel, own, intrinsics, radius, turned)


def look_among(surface_map, numbers_map, some_count, number, pixel, texel, own, intrinsics, radius, turned) -> Plane:
    pixel, texel, last = np.asarray(pixel), np.asarray(texel), np.array(surface_map.shape[1::-1]) - 1
    depth = np.where(own[..., 3:] == 0, F(1), np.abs(own[..., 3:]))
    point = pixel_ray(texel.astype(F), intrinsics) * depth
    v = normalize(-point)
    plane = plane_through(pixel, turned, point, own[..., :3] / np.maximum(length(own[..., :3]), F(1e-4)), intrinsics)
    reach = (F(radius) * mean_focal_length(intrinsics) / depth)[..., 0]
    hidden, before, run = plane.hidden, np.zeros_like(point), np.zeros(point.shape[:-1], F)
    for k in range(2 * STEPS):
        if k == STEPS:
            before, run = np.zeros_like(point), np.zeros_like(run)
        at = step_place(pixel, texel, plane, k, reach)
        place = np.clip(at, 0, last)
        away = met_at(texel_at(surface_map, place.astype(np.int64)), place, at, intrinsics) - point
        run, before = run_of(run, away - before, v), away
        counts = (own[..., 3] != 0) & ((away * away).sum(-1) < F(radius) * F(radius))
        if some_count:
            counts &= texel_at(numbers_map, place.astype(np.int64))[..., 3] != number
        bits = hidden_by(away, plane, k, THIN * F(radius) + run)
        hidden = hidden | np.where(counts, bits, np.uint32(0))
    return plane._replace(hidden=hidden)


def without(hidden: np.ndarray, n: np.ndarray) -> np.ndarray:
    share = np.clip(F(1) - hidden[..., 3:], F(0), F(1))
    some = share >= F(1e-3)
    bent = (F(2 / 3) * n - hidden[..., :3]) / np.where(some, share, F(1))
    bent = np.where(some, bent / np.maximum(length(bent), F(1)), F(2 / 3) * n)
    return np.concatenate([bent, np.where(some, share, F(0))], -1)


def seen_from_plane(surface_map, pixel, texel, own, intrinsics, radius, turned) -> np.ndarray:
    plane = look_along(surface_map, pixel, texel, own, intrinsics, radius, turned)
    weight = np.maximum(weight_of_plane(plane), F(1e-4))[..., None]
    return without(sum_of_sectors(plane, plane.hidden) / weight, own[..., :3])


def mean_hidden(plane_map, weight_map, has_weights, surface_map, pixel, first, stride, intrinsics) -> np.ndarray:
    size, last = np.array(plane_map.shape[1::-1]), np.array(surface_map.shape[1::-1]) - 1
    texel = np.minimum(pixel * stride, last)
    own = texel_at(surface_map, texel)
    point = pixel_ray(texel.astype(F), intrinsics) * np.abs(own[..., 3:])
    total, weights = np.zeros_like(own), np.zeros_like(own[..., :1])
    for k in range(PLANES * PLANES):
        place = np.clip(pixel + np.array([k % PLANES, k // PLANES]) + first, 0, size - 1)
        other = np.minimum(place * stride, last)
        there = texel_at(surface_map, other)
        z, alike = np.abs(there[..., 3:]), np.maximum(dot(there[..., :3], own[..., :3]), F(0))
        off = dot(own[..., :3], pixel_ray(other.astype(F), intrinsics) * z - point)
        counts = ((z > 0) & (np.abs(off) < ON_PLANE * np.abs(own[..., 3:]))).astype(F) * alike**4
        total, weights = (
            total + counts * texel_at(plane_map, place),
            weights + counts * (texel_at(weight_map, place) if has_weights else F(1)),
        )
    some = (own[..., 3:] != 0) & (weights > 0)
    return np.where(some, total / np.where(weights > 0, weights, F(1)), F(0))


def visibility_at(mean_map, surface_map, texel, stride, intrinsics) -> np.ndarray:
    last, end = (np.array(map.shape[1::-1]) - 1 for map in (surface_map, mean_map))
    own = texel_at(surface_map, texel)
    point = pixel_ray(texel.astype(F), intrinsics) * np.abs(own[..., 3:])
    at = texel.astype(F) / F(stride)
    low = np.floor(at).astype(np.int64)
    total, weights = np.zeros_like(own), np.zeros_like(own[..., :1])
    for k in range(4):
        cell = low + np.array([k & 1, k >> 1])
        place = np.clip(cell, 0, end)
        other = np.minimum(place * stride, last)
        z = np.abs(texel_at(surface_map, other)[..., 3:])
        off = dot(own[..., :3], pixel_ray(other.astype(F), intrinsics) * z - point)
        off = off / np.where(own[..., 3:] != 0, ON_PLANE * np.abs(own[..., 3:]), F(1))
        near = (F(1) - np.abs(at - cell)).prod(-1, keepdims=True)
        weight = np.where(z > 0, (near + F(1e-3)) / (F(1) + off**4), F(0))
        total, weights = total + weight * texel_at(mean_map, place), weights + weight
    some = (own[..., 3:] != 0) & (weights > 0)
    return without(np.where(some, total / np.where(weights > 0, weights, F(1)), F(0)), own[..., :3])
