"""Mirror of shaders/common/rims.glsl, for n rim pixels at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import mean_focal_length, pixel_ray
from .depth_lookup import BEFORE
from .inverse_depth import facing_slope, relative_step
from .rim_marks import BOTTOMLESS, DROP, direction_of, ends_before, rise_of
from .splat import inverse_depth_slope
from .splat_corners import surface_at
from .texels import texel_or_zero
from .vectors import dot, length

F = np.float32
MOST_TILT = F(10)
NARROWEST, BROADEST = F(0.02), F(0.98)
FARTHEST = F(1.3)
SHALLOWEST, DEEPEST = F(1), F(200)
STRAIGHT = F(1.05)
AT_ODDS = F(0.6)
FARTHER_IN, FARTHER_OUT, ALONG_A_ROW = F(0.3), F(0.1), F(0.5)
UNSURE, CREASED, UNCREASED = F(0.5), F(1), F(0.1)


class Rim(NamedTuple):
    outward: np.ndarray  # (n, 2)
    width: np.ndarray  # (n,)
    drop: np.ndarray  # (n,)
    slope: np.ndarray  # (n, 2)
    hidden: np.ndarray  # (n, 4)
    folds: np.ndarray  # (n, 4, 3)


class Around(NamedTuple):
    pixel: np.ndarray  # (n, 2) int
    here: np.ndarray  # (n,)
    facing: np.ndarray  # (n, 2)
    focal: np.ndarray  # ()
    tilt: np.ndarray  # (n, 2)
    rises: np.ndarray  # (n, 4)
    farther: np.ndarray  # (n, 4)


def rise_at(
    surface_map: np.ndarray, pixel: np.ndarray, off: np.ndarray, here: np.ndarray, facing: np.ndarray, focal: np.ndarray
) -> np.ndarray:
    there = np.abs(texel_or_zero(surface_map, pixel + off)[..., 3])
    along = dot(facing, np.broadcast_to(off, pixel.shape).astype(F))[..., 0]
    return rise_of(relative_step(here, there), along, focal)


def borne_out(tilt: np.ndarray, rises: np.ndarray) -> np.ndarray:
    x, y = np.moveaxis(tilt, -1, 0)
    off = np.abs(rises - np.stack([-x, x, -y, y], -1))
    least = np.stack([off[..., :2].min(-1), off[..., 2:].min(-1)], -1)
    return (least <= BEFORE + UNSURE * np.abs(tilt)).astype(F)


def look_around(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> Around:
    surface = surface_at(surface_map, pixel)
    normal, here = surface[..., :3], surface[..., 3]
    ray, focal = pixel_ray(pixel.astype(F), source), mean_focal_length(source)
    facing = _facing(ray, source)
    tilt = focal * (here[..., None] * inverse_depth_slope(normal, ray, here, source) - facing)
    near = pixel, here, facing, focal
    rises, farther = (
        np.stack([rise_at(surface_map, pixel, off, *near[1:]) for off in (far * direction_of(np.arange(4)))], -1)
        for far in (1, 2)
    )
    return Around(*near, tilt * borne_out(tilt, rises), rises, farther)


def rise_around(surface_map: np.ndarray, around: Around, off: np.ndarray) -> np.ndarray:
    return rise_at(surface_map, around.pixel, off, around.here, around.facing, around.focal)


def own_pixels(surface_map: np.ndarray, around: Around) -> np.ndarray:
    leave = np.minimum(length(around.tilt)[..., 0], MOST_TILT)
    own = np.zeros(len(around.pixel), int)
    for k in range(25):
        off = np.array([k % 5 - 2, k // 5 - 2])
        rise = rise_around(surface_map, around, off) - dot(around.tilt, off.astype(F))[..., 0]
        own |= np.where(rise > -(DROP + leave * length(off.astype(F))[..., 0]), 1 << k, 0)
    return own


def is_own(own: np.ndarray, off: np.ndarray) -> np.ndarray:
    return (own >> ((off[..., 1] + 2) * 5 + off[..., 0] + 2)) & 1 == 1


def border_line(own: np.ndarray, outward: np.ndarray) -> np.ndarray:
    across = np.stack([-outward[..., 1], outward[..., 0]], -1)
    ends = []
    for row in range(-2, 3):
        end, is_open = np.full(len(own), -3), np.ones(len(own), bool)
        for k in range(-2, 3):
            belongs = is_own(own, k * outward + row * across)
            is_open &= belongs | (end == -3)
            end = np.where(is_open & belongs, k, end)
        ends.append(end)
    total, moment = sum(ends), sum(row * end for row, end in zip(range(-2, 3), ends, strict=True))
    alike = np.min(ends, 0) == np.max(ends, 0)
    return np.stack([F(0.2) * np.asarray(total, F), F(0.1) * np.asarray(moment, F), alike.astype(F)], -1)


def border_distance(line: np.ndarray) -> np.ndarray:
    return np.clip(F(0.5) + line[..., 0], NARROWEST, BROADEST)


def rim_at(outward: np.ndarray, width: np.ndarray, drop: np.ndarray) -> Rim:
    return Rim(outward, width, drop, *(np.zeros((*width.shape, *more), F) for more in ((2,), (4,), (4, 3))))


def straight_rim(line: np.ndarray, outward: np.ndarray) -> Rim:
    cosine = F(1) / np.sqrt(F(1) + line[..., 1] * line[..., 1])
    across = np.stack([-outward[..., 1], outward[..., 0]], -1).astype(F)
    direction = cosine[..., None] * (outward.astype(F) - line[..., 1:2] * across)
    return rim_at(direction, cosine * border_distance(line), np.zeros_like(cosine))


def held_distance(distance: np.ndarray, line: np.ndarray) -> np.ndarray:
    border, free = border_distance(line), line[..., 2] > 0.5
    low = border - np.where(free, ALONG_A_ROW, FARTHER_IN)
    return np.clip(distance, low, border + np.where(free, ALONG_A_ROW, FARTHER_OUT))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def bent_rim(
    surface_map: np.ndarray,
    around: Around,
    own: np.ndarray,
    outward: np.ndarray,
    a: np.ndarray,
    line: np.ndarray,
    straight: Rim,
) -> Rim:
    def rise(off: np.ndarray) -> np.ndarray:
        return rise_around(surface_map, around, off)

    b = rise(-2 * outward) - a
    bends = (a > SHALLOWEST) & (a < DEEPEST) & (np.abs(b) < F(2) * a + F(4)) & (a > STRAIGHT * b)
    side = np.stack([-outward[..., 1], outward[..., 0]], -1)
    is_before, is_after = is_own(own, -side), is_own(own, side)
    before, after = np.where(is_before, rise(-side), F(0)), np.where(is_after, rise(side), F(0))
    share = np.where(is_before & is_after, F(0.5), F(1))
    lateral = share * (after - before)
    straightness = a * a / (a * a + lateral * lateral)
    drop = (F(2) * a * b + b * b - a * a + F(2) * straightness) / (F(2) * (a - b))
    along = F(2) * drop * a + a * a + straightness
    across = share * (F(2) * drop * (after - before) + after * after - before * before)
    across = across + (is_after.astype(F) - is_before.astype(F)) * (F(1) - straightness)
    slope = np.sqrt(along * along + across * across)
    cosine = along / slope
    width = F(0.5) * (np.sqrt(slope * slope + F(4) * drop * drop) - slope)
    distance = width / cosine
    bends &= (drop > 0) & (along > 0) & (distance <= FARTHEST)
    held = held_distance(distance, line)
    moved = held != distance
    width = np.where(moved, held * cosine, width)
    full = np.sqrt(held * held * a * a + held * (a * a + cosine * cosine) + width * width)
    drop = np.where(moved, held * a + full, drop)
    direction = outward.astype(F) * cosine[..., None] - side.astype(F) * (across / slope)[..., None]
    bent = rim_at(direction, np.maximum(width, NARROWEST), drop)
    return _choose(bends, bent, straight)


def is_less(one: np.ndarray, other: np.float32) -> np.ndarray:
    return (one < other).astype(F)


def hidden_pixels(around: Around) -> np.ndarray:
    x, y = around.tilt.T
    rise = np.stack([-x, x, -y, y], -1)
    wide = is_less(np.abs(around.rises[:, [1, 0, 3, 2]] + rise), BEFORE)
    first = is_less(rise - around.rises, -BEFORE) * is_less(np.abs(rise), DROP)
    second = is_less(F(2) * rise - around.farther, -BEFORE) * is_less(F(2) * np.abs(rise), DROP)
    return first * (F(1) + wide * second)


def fold_at(surface_map: np.ndarray, around: Around, direction: int, source: np.ndarray) -> np.ndarray:
    off = np.broadcast_to(direction_of(direction), around.pixel.shape).astype(F)
    theirs = dot(around.tilt, off)[..., 0] - around.rises[:, direction]
    beside = around.pixel + direction_of(direction)
    there = texel_or_zero(surface_map, beside)
    z = np.where(there[..., 3] == 0, F(1), np.abs(there[..., 3]))
    slope = inverse_depth_slope(there[..., :3], pixel_ray(beside.astype(F), source), z, source)
    first = F(1) / z - dot(slope, off)[..., 0]
    plane = around.here[..., None] * np.concatenate([first[..., None], slope], -1)
    ours = around.focal * (plane[..., 0] - F(1))
    meets = (theirs > UNCREASED) & (theirs < -BOTTOMLESS) & (ours > -UNCREASED) & (ours + theirs > CREASED)
    plane[..., 0] = np.maximum(plane[..., 0], F(1))
    return np.where(meets[..., None], plane, F(0))


def estimate_outline(surface_map: np.ndarray, around: Around) -> Rim:
    own = own_pixels(surface_map, around)
    pixel, count, last = around.pixel, len(around.pixel), np.array(surface_map.shape[1::-1]) - 1
    corner = rim_at(np.zeros((count, 2), F), np.ones(count, F), np.zeros(count, F))
    straight, steepest, border = corner, np.zeros((count, 2), int), np.zeros((count, 3), F)
    largest, least, is_corner = np.full(count, BOTTOMLESS), np.full(count, F(1e30)), np.zeros(count, bool)
    for k in range(4):
        outward = np.broadcast_to(direction_of(k), pixel.shape)
        following = pixel + outward
        inner = around.rises[:, k ^ 1]
        ends = ends_before(around.rises[:, k], inner)
        ends &= (following == np.clip(following, 0, last)).all(-1)
        line = border_line(own, outward)
        found = straight_rim(line, outward)
        is_corner |= ends & (least < 1e30) & (dot(found.outward, straight.outward)[..., 0] < AT_ODDS)
        flatter = ends & (np.abs(line[..., 1]) < least)
        least = np.where(flatter, np.abs(line[..., 1]), least)
        straight = _choose(flatter, found, straight)
        steeper = ends & (inner > largest)
        largest = np.where(steeper, inner, largest)
        steepest = np.where(steeper[..., None], outward, steepest)
        border = np.where(steeper[..., None], line, border)
    bent = bent_rim(surface_map, around, own, steepest, largest, border, straight)
    bent = _choose(np.abs(steepest).sum(-1) > 0, bent, straight)
    return _choose(is_corner, corner, bent)


def estimate_rim(surface_map: np.ndarray, pixel: np.ndarray, source: np.ndarray) -> Rim:
    around = look_around(surface_map, pixel, source)
    x, y = around.tilt.T
    below = np.stack([-x, x, -y, y], -1) - around.rises
    first = np.stack([below[:, 0] > below[:, 1], below[:, 2] > below[:, 3]], -1)
    falls = np.stack([first[:, 0], ~first[:, 0], first[:, 1], ~first[:, 1]], -1)
    folds = np.stack([fold_at(surface_map, around, k, source) for k in range(4)], -2) * falls[..., None]
    rim = estimate_outline(surface_map, around)
    slope = around.tilt / around.focal + around.facing
    hidden = np.where((rim.drop == 0)[:, None], hidden_pixels(around), F(0))
    return rim._replace(slope=slope, hidden=hidden, folds=folds)


def _facing(ray: np.ndarray, source: np.ndarray) -> np.ndarray:
    return np.stack(facing_slope((ray[..., 0], ray[..., 1]), source), -1)


def _choose(condition: np.ndarray, one: Rim, other: Rim) -> Rim:
    def choose(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.where(condition.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return Rim(*map(choose, one, other))
