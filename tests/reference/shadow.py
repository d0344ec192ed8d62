"""Mirror of shaders/common/shadow.glsl."""

from __future__ import annotations

import builtins

import numpy as np

from .camera import project
from .trained_splats import share_past_splats
from .vectors import dot, length, texel

F = np.float32
FLATTEST = F(0.1)
SHARP, BLURRED, MOST_BLUR = F(3), F(1.125), F(48)
SPREAD_TAPS = 16
ONWARDS = np.array(((-0.73736888, -0.67549029), (0.67549029, -0.73736888)), F)


def occluder_at(shadow_map: np.ndarray, pixel: np.ndarray, tile: np.ndarray, range: np.ndarray) -> np.ndarray:
    outside = (pixel < 0).any(-1) | (pixel > range[1] - F(1)).any(-1)
    at = np.where(outside[..., None], F(0), pixel + tile[2:]).astype(int)
    return np.where(outside, F(-1), (F(1) - texel(shadow_map, at)) / range[0])


def tent(offset: np.ndarray) -> np.ndarray:
    before, after = F(0.5) - offset, F(0.5) + offset
    return np.stack([F(0.5) * before * before, F(0.75) - offset * offset, F(0.5) * after * after], -1)


def stands_out(occluder: np.ndarray, own: np.ndarray, away: np.ndarray, contact: np.ndarray) -> np.ndarray:
    return (occluder - own) * away > contact * own * occluder


def blur_at(
    shadow_map: np.ndarray,
    tile: np.ndarray,
    range: np.ndarray,
    pixel: np.ndarray,
    at: np.ndarray,
    surface: np.ndarray,
    away: np.ndarray,
    contact: np.ndarray,
) -> np.ndarray:
    own = np.maximum(surface[..., 0] + dot(surface[..., 1:], pixel - at)[..., 0], F(0))
    occluder = occluder_at(shadow_map, pixel, tile, range)
    blur = np.where(stands_out(occluder, own, away, contact), range[3] * (occluder - own), F(0))
    return np.where(occluder < 0, F(-1), blur)


def soft_share(
    shadow_map: np.ndarray,
    tile: np.ndarray,
    range: np.ndarray,
    at: np.ndarray,
    surface: np.ndarray,
    away: np.ndarray,
    contact: np.ndarray,
    widest: np.ndarray,
) -> np.ndarray:
    found, blurs, seen, opened = (np.zeros(widest.shape, F) for _ in "1234")
    way = np.array((1, 0), F)
    for k in builtins.range(SPREAD_TAPS):
        aside = widest[..., None] * (F(k) + F(0.5)) / F(SPREAD_TAPS) * way
        blur = blur_at(shadow_map, tile, range, np.floor(at + aside + F(0.5)), at, surface, away, contact)
        hides = blur >= np.maximum(BLURRED, length(aside)[..., 0])
        found += hides
        blurs += np.where(hides, blur, F(0))
        way = ONWARDS @ way
    reach = np.minimum(blurs / np.maximum(found, F(1)), widest)
    way = np.array((1, 0), F)
    for k in builtins.range(SPREAD_TAPS):
        aside = reach[..., None] * np.sqrt((F(k) + F(0.5)) / F(SPREAD_TAPS)) * way
        blur = blur_at(shadow_map, tile, range, np.floor(at + aside + F(0.5)), at, surface, away, contact)
        seen += blur >= 0
        opened += (blur >= 0) & (blur <= BLURRED)
        way = ONWARDS @ way
    share = np.where(seen > 0, opened / np.maximum(seen, F(1)), F(1))
    return np.where((found == 0) | (widest < BLURRED), F(1), share)


def light_share(shadow_map: np.ndarray, views: np.ndarray, row: int, point: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(..., 1), so that it multiplies colours."""
    turn, shift, tile, range = views[row, :3, :3], views[row, :3, 3], views[row, 3], views[row, 4]
    seen = _turned(turn, point) + shift
    ahead = seen[..., 2:] > range[0]
    seen = np.where(ahead, seen, np.array((0, 0, 1), F))
    intrinsics = tile[[0, 0, 1, 1]]
    at = project(seen, intrinsics)
    normal = _turned(turn, n)
    z = seen[..., 2:]
    ray = seen / z
    cosine = dot(normal, ray)
    away = np.abs(cosine)[..., 0]
    cosine = np.sign(cosine) * np.maximum(np.abs(cosine), FLATTEST * length(ray))
    safe = np.where(cosine == 0, F(1), cosine)
    slope = np.where(cosine == 0, F(0), normal[..., :2] / (intrinsics[:2] * (safe * z)))
    farther = dot(point, views[row, 5, :3]) + views[row, 5, 3]
    contact = (range[2] * np.maximum(F(1), farther * farther))[..., 0]
    middle = np.floor(at + F(0.5))
    across, down = tent(at[..., 0] - middle[..., 0]), tent(at[..., 1] - middle[..., 1])
    share = np.zeros_like(z)
    for y in (0, 1, 2):
        for x in (0, 1, 2):
            pixel = middle + np.array((x - 1, y - 1), F)
            own = np.maximum(F(1) / z[..., 0] + dot(slope, pixel - at)[..., 0], F(0))
            occluder = occluder_at(shadow_map, pixel, tile, range)
            hidden = (range[3] * (occluder - own) < SHARP) & stands_out(occluder, own, away, contact)
            share[..., 0] += np.where(hidden, F(0), across[..., x] * down[..., y])
    widest = np.minimum(range[3] * (F(1) / range[0] - F(1) / z[..., 0]), MOST_BLUR)
    surface = np.concatenate([F(1) / z, slope], -1)
    soft = soft_share(shadow_map, tile, range, at, surface, away, contact, widest)
    share[..., 0] *= np.where(share[..., 0] == 0, F(1), soft)
    return np.where(ahead, share, F(1))


def cube_face(direction: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(direction, -1, 0)
    size = np.abs(direction)
    by_x = (size[..., 0] >= size[..., 1]) & (size[..., 0] >= size[..., 2])
    by_y = size[..., 1] >= size[..., 2]
    return np.where(by_x, np.where(x > 0, 0, 1), np.where(by_y, np.where(y > 0, 2, 3), np.where(z > 0, 4, 5)))


def _turned(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """turn * vector, column by column."""
    x, y, z = (turn[:, k] * vector[..., k : k + 1] for k in (0, 1, 2))
    return x + y + z


def share_beside_splats(
    seen_map: np.ndarray, tile: np.ndarray, side: float, at: np.ndarray, depth: np.ndarray, thickness: np.ndarray
) -> np.ndarray:
    """tile (4,), at (n, 2), depth and thickness (n,); (n,)"""
    low = np.floor(at)
    between, share = at - low, np.zeros(len(at), F)
    for y in (0, 1):
        for x in (0, 1):
            pixel = low + np.array((x, y), F)
            inside = (pixel >= 0).all(-1) & (pixel <= F(side) - F(1)).all(-1)
            place = np.where(inside[:, None], pixel + tile[2:], F(0)).astype(int)
            own = np.where(inside, share_past_splats(texel(seen_map, place), depth, thickness), F(1))
            across, down = (between[:, k] if one else F(1) - between[:, k] for k, one in ((0, x), (1, y)))
            share += own * across * down
    return share
