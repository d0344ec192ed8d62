"""Mirror of shaders/common/calm_normals.glsl, for many pixels or cells (n, 2) integers at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import mean_focal_length, pixel_ray
from .splat_corners import surface_at
from .toksvig import WANDERING, certainty_at, normal_certainty
from .vectors import dot, length, normalize, texel

F = np.float32
SIDE = 4
PHOTO, SLACK, STEEPEST_TILT, LEAST_TILT, COMPLETED_TILT = F(0.08), F(0.6), F(0.5), F(0.004), F(0.35)
CHROMA, OWN_STRIDE, BEHIND, STEP, BEHIND_TILT = F(0.9), 2, 3, F(0.06), F(0.22)
OUTLIER, FAR_OUTLIER, FLAT_OUTLIER, RIDGE, DARK = F(3), F(7), F(1.2), F(0.05), F(0.08)
BELIEF, UNSURE, LEAST_SCATTER, SCATTER = F(3.5), F(0.05), F(0.08), F(0.2)
LIKE, LEAST_LIKE, WRONG_TILT, LOST = F(0.3), F(11), F(0.7), F(0.3)
UNSUREST, LEAST_WRONG, WRONG_PHOTO, SOME_TILT = F(0.6), F(0.65), F(0.3), F(0.4)
SURER, BLACK, BURNT = F(0.12), F(-5.1), F(0.165)
MIXED, EVEN, NEAR = F(20), F(0.01), F(0.05)
LOOK = [0, 2, 3]  # of a witness: luminance, chroma


class Facet(NamedTuple):
    """point, normal, color (n, 3); tilt (n, 1) float32; is_blind (n, 1) bool"""

    point: np.ndarray
    normal: np.ndarray
    color: np.ndarray
    tilt: np.ndarray
    is_blind: np.ndarray


def facet_at(
    surface_map: np.ndarray, witness_map: np.ndarray, place: np.ndarray, side: float, intrinsics: np.ndarray
) -> Facet:
    last = np.array(surface_map.shape[1::-1]) - 1
    inside = np.clip(place, 0, last)
    is_inside = (inside == place).all(-1, keepdims=True)
    surface = np.where(is_inside, surface_at(surface_map, inside), F(0))
    seen = texel(witness_map, inside)
    pixel = F(side) * place.astype(F) + F(0.5) * F(side - 1)
    point = pixel_ray(pixel, intrinsics) * surface[:, 3:]
    return Facet(point, surface[:, :3], seen[:, LOOK], np.abs(seen[:, 1:2]), seen[:, 1:2] < 0)


def is_facet(facet: Facet) -> np.ndarray:
    return (facet.point[:, 2:] > 0) & (facet.normal != 0).any(-1, keepdims=True)


def is_wrong(facet: Facet) -> np.ndarray:
    return facet.tilt > LEAST_WRONG


def strangeness(own: Facet, other: Facet, noise: float, intrinsics: np.ndarray) -> np.ndarray:
    way, depth = other.point - own.point, own.point[:, 2:]
    off = np.minimum(np.abs(dot(way, own.normal)), np.abs(dot(way, other.normal)))
    tilt = np.minimum(own.tilt + other.tilt, STEEPEST_TILT)
    slack = (SLACK * F(noise) + F(0.5) / mean_focal_length(intrinsics)) * depth + tilt * length(way)
    off = off / np.where(is_facet(own), slack, F(1))
    is_any = is_wrong(own) | is_wrong(other)
    off = np.where((np.minimum(own.tilt, other.tilt) > LOST) | is_any, F(0), off)
    return F(0.5) * off * off + length(other.color - own.color) / np.where(is_any, WRONG_PHOTO, PHOTO)


def witness_of(color: np.ndarray, certainty: np.ndarray, is_measured: np.ndarray) -> np.ndarray:
    """(n, 4), of colours (n, 3), and (n, 1) of each of the others"""
    brightness = np.sqrt(dot(color * color, np.array((0.2126, 0.7152, 0.0722), F)))
    tilt = np.sqrt((F(1) / np.maximum(certainty, F(0.05)) - F(1)) / WANDERING)
    tilt = np.clip(tilt, np.where(is_measured, LEAST_TILT, COMPLETED_TILT), UNSUREST)
    chroma = CHROMA / (brightness + DARK) * (color[:, ::2] - color[:, 1:2])
    return np.concatenate([F(2.5) * np.log(brightness + DARK), tilt, chroma], -1).astype(F)


def join_facets(
    surface_map: np.ndarray, witness_map: np.ndarray, cell: np.ndarray, noise: float, intrinsics: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) and (n, 4)"""
    count = len(cell)
    zero, none = np.zeros((count, 1), F), np.zeros((count, 3), F)
    own = Facet(none, none, none, np.full((count, 1), F(1e30)), np.ones((count, 1), bool))
    offsets = [np.array((k % SIDE, k // SIDE)) for k in range(SIDE * SIDE)]
    facets = [facet_at(surface_map, witness_map, SIDE * cell + k, 1, intrinsics) for k in offsets]
    for k in (10, 9, 6, 5):  # the four in the middle
        is_better = is_facet(facets[k]) & (facets[k].tilt < own.tilt)
        own = Facet(*(np.where(is_better, new, old) for new, old in zip(facets[k], own, strict=True)))
    for facet in facets:
        is_first = ~is_facet(own)
        own = Facet(*(np.where(is_first, new, old) for new, old in zip(facet, own, strict=True)))
    luminances = np.stack([facet.color[:, :1] for facet in facets])
    darkest, brightest = luminances.min(0), luminances.max(0)
    s, color, normal, point = zero, none, none, none
    for facet in facets:
        weight = np.exp(-strangeness(own, facet, noise, intrinsics)) / np.square(facet.tilt)
        m = np.where(is_facet(facet), weight, F(0))
        s, normal, point = s + m, normal + m * facet.normal, point + m * facet.point
        color = color + m * facet.color
    is_known = is_facet(own)
    s, normal, point = (np.where(is_known, x, F(1)) for x in (s, normal, point))
    ray = pixel_ray(F(SIDE) * cell.astype(F) + F(0.5) * F(SIDE - 1), intrinsics)
    depth = dot(normal, point / s) / dot(normal, ray)
    mean = point[:, 2:] / s
    depth = np.where(np.abs(depth / mean - F(1)) < F(0.1), depth, mean)
    is_plain = (darkest == brightest) & (darkest > BLACK) & (brightest < BURNT)
    color = color / s
    joined = np.concatenate([color[:, :1], np.where(is_plain, -own.tilt, own.tilt), color[:, 1:]], -1)
    return np.where(is_known, np.concatenate([normalize(normal), depth], -1), F(0)), joined


class Bend(NamedTuple):
    """total (n, 1); at (n, 2); squares, normal, x_normal, y_normal (n, 3)"""

    total: np.ndarray
    at: np.ndarray
    squares: np.ndarray
    normal: np.ndarray
    x_normal: np.ndarray
    y_normal: np.ndarray


def no_bend(count: int) -> Bend:
    return Bend(*(np.zeros((count, width), F) for width in (1, 2, 3, 3, 3, 3)))


def add_normal(bend: Bend, at: np.ndarray, weight: np.ndarray, normal: np.ndarray) -> Bend:
    x, y = at.astype(F)
    squares = np.array((x * x, x * y, y * y))
    more = weight, weight * at.astype(F), weight * squares, weight * normal, weight * x * normal, weight * y * normal
    return Bend(*(one + other for one, other in zip(bend, more, strict=True)))


def variance_left(bend: Bend) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n, 1), and the mean and what is expected (n, 3)"""
    total = np.where(bend.total > 0, bend.total, F(1))
    at, mean, squares = bend.at / total, bend.normal / total, bend.squares / total
    u, v = at[:, :1], at[:, 1:]
    x, y = bend.x_normal / total - u * mean, bend.y_normal / total - v * mean
    xx, yy, xy = squares[:, :1] - u * u + RIDGE, squares[:, 2:] - v * v + RIDGE, squares[:, 1:2] - u * v
    determinant = xx * yy - xy * xy
    slope_x, slope_y = (yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant
    here = mean - u * slope_x - v * slope_y
    rest = F(0.5) * np.maximum(F(1) - dot(mean, mean) - dot(slope_x, x) - dot(slope_y, y), F(0))
    return rest, mean, here


def scatter_at(surface_map: np.ndarray, witness_map: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """(n, 1)"""
    last = np.array(surface_map.shape[1::-1]) - 1
    color, noise, bend = texel(witness_map, cell)[:, LOOK], np.zeros((len(cell), 1), F), no_bend(len(cell))
    for off in (np.array((k % 3, k // 3)) - 1 for k in range(9)):
        place = np.clip(cell + 2 * off, 0, last)
        surface, seen = texel(surface_map, place), texel(witness_map, place)
        m = np.exp(F(-1.4) * F(off @ off) - length(seen[:, LOOK] - color) / LIKE)
        m = np.where(surface[:, 3:] == 0, F(0), m)
        bend = add_normal(bend, off, m, surface[:, :3])
        noise = noise + m * np.minimum(np.square(seen[:, 1:2]), UNSURE * UNSURE)
    is_known = texel(surface_map, cell)[:, 3:] != 0
    believed = BELIEF * BELIEF * noise / np.where(is_known, bend.total, F(1))
    scatter = np.sqrt(np.minimum(variance_left(bend)[0], believed))
    return np.where(is_known, np.clip((scatter - LEAST_SCATTER) / (SCATTER - LEAST_SCATTER), F(0), F(1)), F(0))


def behind_at(surface_map: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """(n, 1)"""
    last, own = np.array(surface_map.shape[1::-1]) - 1, texel(surface_map, cell)[:, 3:]
    step = np.zeros_like(own)
    for off in (BEHIND * (np.array((k % 3, k // 3)) - 1) for k in range(4)):
        both = (texel(surface_map, np.clip(cell + side * off, 0, last))[:, 3:] for side in (1, -1))
        step = np.maximum(step, sum(np.where(z > 0, own / np.where(z > 0, z, F(1)) - F(1), F(0)) for z in both))
    share = np.clip((step - F(0.5) * STEP) / (F(0.5) * STEP), F(0), F(1))
    return share * share * (F(3) - F(2) * share)


def doubted_witness(witness_map: np.ndarray, scatter_map: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """(n, 4)"""
    own, last = texel(witness_map, cell), np.array(scatter_map.shape[1::-1]) - 1
    added, total = np.zeros((len(cell), 1), F), np.zeros((len(cell), 1), F)
    for k in range(25):
        place = np.clip(cell + 4 * (np.array((k % 5, k // 5)) - 2), 0, last)
        m = np.exp(-length(texel(witness_map, place)[:, LOOK] - own[:, LOOK]) / LIKE)
        added, total = added + m * texel(scatter_map, place)[:, :1], total + m
    share = added / np.maximum(total, LEAST_LIKE)
    some, doubt = (np.clip((share - F(low)) / F(0.2), F(0), F(1)) for low in (0.1, 0.3))
    some, doubt = (x * x * (F(3) - F(2) * x) for x in (some, doubt))
    tilt = np.maximum(np.abs(own[:, 1:2]), WRONG_TILT * doubt)
    some = np.maximum(SOME_TILT * some, BEHIND_TILT * texel(scatter_map, cell)[:, 1:])
    return np.concatenate([own[:, :1], np.where(own[:, 1:2] < 0, -tilt, np.maximum(tilt, some)), own[:, 2:]], -1)


def doubted_certainty(
    surface_map: np.ndarray, witness_map: np.ndarray, doubt_map: np.ndarray, cell: np.ndarray
) -> np.ndarray:
    """(n, 1)"""
    last, own = np.array(surface_map.shape[1::-1]) - 1, texel(surface_map, cell)
    depth, own_doubt = own[:, 3:], texel(doubt_map, cell)[:, 1:2]
    is_known = depth != 0
    bend, tilt = no_bend(len(cell)), np.zeros((len(cell), 1), F)
    for off in (np.array((k % 3, k // 3)) - 1 for k in range(9)):
        place = np.clip(cell + off, 0, last)
        surface, doubt = texel(surface_map, place), texel(doubt_map, place)[:, 1:2]
        miss = surface[:, :3] - own[:, :3]
        both = np.maximum(own_doubt * own_doubt + doubt * doubt, LEAST_TILT * LEAST_TILT)
        away = np.abs(surface[:, 3:] - depth) / np.where(is_known, NEAR * depth, F(1))
        away = away + F(0.5) * dot(miss, miss) / (FAR_OUTLIER**2 * both)
        m = np.where(surface[:, 3:] == 0, F(0), np.exp(F(-0.69) * F(off @ off) - away))
        bend = add_normal(bend, off, m, surface[:, :3])
        tilt = tilt + np.abs(doubt) / F(9)
    left = np.where(is_known, texel(witness_map, cell)[:, 1:2], F(0))
    variance = WANDERING * left * left + MIXED * np.maximum(variance_left(bend)[0] - EVEN, F(0))
    doubt = np.clip((tilt - COMPLETED_TILT) / (WRONG_TILT - COMPLETED_TILT), F(0), F(1))
    doubted = normal_certainty(variance) * (F(1) - F(0.99) * doubt * doubt * (F(3) - F(2) * doubt))
    return np.where(is_known, doubted, F(1))


def calm_facet(
    surface_map: np.ndarray, witness_map: np.ndarray, cell: np.ndarray, stride: int, noise: float,
    intrinsics: np.ndarray, is_shared: bool,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(n, 4) and (n, 4)"""
    own = facet_at(surface_map, witness_map, cell, SIDE, intrinsics)
    is_known = is_facet(own)
    offsets = [np.array((k % 3, k // 3)) - 1 for k in range(9)]
    others = [facet_at(surface_map, witness_map, cell + stride * off, SIDE, intrinsics) for off in offsets]
    weights = []
    for off, other in zip(offsets, others, strict=True):
        m = np.exp(F(-0.69) * F(off @ off) - strangeness(own, other, noise, intrinsics))
        surest = np.where(own.tilt > LOST, other.tilt, np.maximum(other.tilt, SURER * own.tilt))
        weights.append(np.where(is_facet(other), m / np.square(np.where(is_facet(other), surest, F(1))), F(0)))
    total = sum(weights)
    mean = sum(m * other.normal for m, other in zip(weights, others, strict=True))
    total, mean = np.where(is_known, total, F(1)), np.where(is_known, mean, F(1))
    outlier = np.where(own.is_blind, FLAT_OUTLIER, OUTLIER) ** 2
    is_own = own.is_blind | ((stride >= OWN_STRIDE) & (own.tilt < LOST))
    spread = np.where(is_own, F(0), F(0.5) * np.maximum(F(1) - dot(mean, mean) / (total * total), F(0)))
    expected = np.where(is_own, own.normal, normalize(mean))
    squares, wrong, bend = np.zeros((len(cell), 1), F), np.zeros((len(cell), 1), F), no_bend(len(cell))
    for off, other, weight in zip(offsets, others, weights, strict=True):
        miss, tilt = other.normal - expected, np.square(other.tilt)
        allowed = outlier * (np.square(own.tilt) + tilt) + spread
        m = weight * np.exp(F(-0.5) * dot(miss, miss) / np.where(is_known, allowed, F(1)))
        bend = add_normal(bend, off, m, other.normal)
        squares = squares + np.where(is_wrong(other), F(0), m * m * tilt)
        wrong = wrong + np.where(is_wrong(other), m * other.tilt, F(0))
    squares = squares + wrong * wrong
    rest, mean, here = (np.where(is_known, x, F(1)) for x in variance_left(bend))
    s = np.where(is_known, bend.total, F(1))
    variance = np.maximum(squares, rest * s * s / F(9)) / (s * s)
    left = texel(witness_map, cell)
    factor = np.minimum(np.sqrt(variance) / np.where(is_known, own.tilt, F(1)), F(1))
    tilt = np.where(own.is_blind | (not is_shared), left[:, 1:2] * factor, left[:, 1:2])
    tilt = np.where(np.abs(tilt) < LEAST_TILT, np.sign(tilt) * LEAST_TILT, tilt)
    left = np.concatenate([left[:, :1], np.where(is_known, tilt, left[:, 1:2]), left[:, 2:]], -1)
    normal = normalize(np.where(length(here) > F(0.1), here, mean))
    surface = np.concatenate([normal, texel(surface_map, cell)[:, 3:]], -1)
    return np.where(is_known, surface, F(0)).astype(F), left.astype(F)


def calm_normal(
    surface_map: np.ndarray, witness_map: np.ndarray, other_map: np.ndarray, joined_map: np.ndarray, pixel: np.ndarray,
    noise: float, own_share: float, least_tilt: np.ndarray | float, intrinsics: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """(n, 3); least_tilt: (n, 1), or of all"""
    own = facet_at(surface_map, witness_map, pixel, 1, intrinsics)
    own = own._replace(tilt=np.maximum(own.tilt, np.where(F(least_tilt) > LOST, F(least_tilt), F(0))))
    at = (pixel.astype(F) - F(0.5) * F(SIDE - 1)) / F(SIDE)
    low = np.floor(at).astype(int)
    share = at - low.astype(F)
    is_blind, doubt = texel(joined_map, pixel // SIDE)[:, 1:2] < 0, np.square(own.tilt)
    outlier = np.where(is_blind, FLAT_OUTLIER, FAR_OUTLIER) ** 2
    total = np.zeros_like(own.normal)
    for k in range(4):
        off = np.array((k % 2, k // 2))
        cell = facet_at(other_map, joined_map, low + off, SIDE, intrinsics)
        near = np.where(off == 1, share, F(1) - share)
        miss, variance = cell.normal - own.normal, np.square(cell.tilt)
        strange = strangeness(own, cell, noise, intrinsics) + F(0.5) * dot(miss, miss) / (outlier * (doubt + variance))
        m = near[:, :1] * near[:, 1:] * np.exp(-strange) / np.where(is_facet(cell), variance, F(1))
        total = total + np.where(is_facet(cell), m * cell.normal, F(0))
    total = (
        np.maximum(doubt - LEAST_TILT * LEAST_TILT, F(0)) * total + np.where(is_blind, F(1), F(own_share)) * own.normal
    )
    return np.where(is_facet(own), normalize(np.where(is_facet(own), total, F(1))), own.normal)


LEVELS, OWN_SHARE = (3, 5), (1.0, 0.1)  # as in gpu/surface/refinement.py


def calm_normals(
    surface: np.ndarray, color: np.ndarray, certainty: np.ndarray, noise: float, is_shared: bool, intrinsics: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(h, w, 3), and their certainty, one of each cell.

    surface (h, w, 4) without completed pixels; color (h, w, 3); certainty before (any size)
    """
    height, width = surface.shape[:2]
    pixels, cells = (
        np.stack(np.meshgrid(np.arange(x), np.arange(y)), -1).reshape(-1, 2)
        for x, y in ((width, height), (-(-width // SIDE), -(-height // SIDE)))
    )
    sure = certainty_at(certainty, pixels.astype(F), np.array((width, height), F))
    witness = witness_of(color.reshape(-1, 3), sure, np.ones_like(sure, bool)).reshape(height, width, 4)
    shape = -(-height // SIDE), -(-width // SIDE), -1
    facets, seen = (one.reshape(shape) for one in join_facets(surface, witness, cells, noise, intrinsics))
    doubts = np.zeros_like(seen)
    if is_shared:
        scatter = np.concatenate([scatter_at(facets, seen, cells), behind_at(facets, cells)], -1).reshape(shape)
        doubts = seen = doubted_witness(seen, scatter, cells).reshape(shape)
    for level in range(LEVELS[is_shared]):
        found = calm_facet(facets, seen, cells, 1 << level, noise, intrinsics, is_shared and level == 0)
        facets, seen = (one.reshape(shape) for one in found)
    least_tilt = np.abs(texel(doubts, pixels // SIDE)[:, 1:2])
    found = calm_normal(surface, witness, facets, seen, pixels, noise, OWN_SHARE[is_shared], least_tilt, intrinsics)
    certain = doubted_certainty(facets, seen, doubts if is_shared else seen, cells)
    return found.reshape(height, width, 3), certain.reshape(shape[:2])
