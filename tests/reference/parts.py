"""Mirror of shaders/common/parts.glsl."""

from __future__ import annotations

import numpy as np

from .camera import mean_focal_length, pixel_ray
from .depth_lookup import carry_back, hidden_mark
from .resolve import Seen, look_up
from .splat import MIN_COSINE
from .splat_corners import surface_at
from .vectors import dot, normalize

F = np.float32
STRETCHED = F(6)
SEEN_ALIKE, LEAST_ALIKE = F(0.2), F(0.0005)
FALLBACK, FLATTEST, MOST_DETAIL, UNLIKE = F(1e-11), F(0.25), F(4), F(0.7)
MOST_SHARP, SPARE, DEEP_RIM = F(1.5), F(0.6), F(3)
INVERSE_DEPTH = np.uint32(0x3FFFFFFF)


def splat_key(inverse_depth: np.ndarray, level: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    bits = np.ascontiguousarray(inverse_depth, F).view(np.uint32)
    return hidden_mark(bits >> np.uint32(1), hidden) | (np.asarray(level).astype(np.uint32) << np.uint32(30))


def key_inverse_depth(key: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray((key & INVERSE_DEPTH) << np.uint32(1)).view(F)


def merged_inverse_depth(key: np.ndarray, weighted_off: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return key_inverse_depth(key) * (F(1) + weighted_off / weight)


def target_normal(found: np.ndarray, mixed: np.ndarray) -> np.ndarray:
    likely = (found[..., 3:] != 0) & (dot(found[..., :3], mixed) > UNLIKE)
    return np.where(likely, found[..., :3], mixed)


def is_stretched(extent: np.ndarray, side: np.ndarray) -> np.ndarray:
    return extent.max(-1) > STRETCHED * side


def is_among(pixel: np.ndarray, share: float) -> np.ndarray:
    along = pixel[..., 0].astype(F) * F(0.618034) + pixel[..., 1].astype(F) * F(0.414214)
    return along - np.floor(along) < F(share)


def primary_share(primary: float, trust: np.ndarray) -> np.ndarray:
    return np.clip(F(2) * F(primary) - (trust < 1), F(0), F(1))


def lies_deep(
    target_pixel: np.ndarray,
    inverse_depth: np.ndarray,
    z: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> np.ndarray:
    w = carry_back(target_pixel, inverse_depth, target, view, source)[..., 2]
    return mean_focal_length(source) * np.abs(F(1) - z * w) > DEEP_RIM


def is_spare(trust: np.ndarray) -> np.ndarray:
    return np.abs(trust - SPARE) < F(0.05)


def splat_level(trust: np.ndarray, stretched: np.ndarray, primary: np.ndarray) -> np.ndarray:
    return np.where((trust > 0.5) & ~stretched, 2, 0) + primary


def plane_inverse_depth(
    own: np.ndarray,
    pixel: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
) -> np.ndarray:
    ray = pixel_ray(target_pixel, target) @ view[:3, :3]
    point = pixel_ray(pixel, source) * own[..., 3:] + view[:3, 3] @ view[:3, :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return (dot(own[..., :3], ray) / dot(own[..., :3], point))[..., 0]


def share_across(normal: np.ndarray, target_pixel: np.ndarray, view: np.ndarray, target: np.ndarray) -> np.ndarray:
    ray = pixel_ray(target_pixel, target) @ view[:3, :3]
    return np.maximum(np.abs(dot(normal, normalize(ray))[..., 0]), FLATTEST)


def look_twice(
    surface_map: np.ndarray,
    inverse_depth: np.ndarray,
    hidden: np.ndarray,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
    band: float,
) -> Seen:
    last = np.array(surface_map.shape[1::-1], F) - F(1)
    at = carry_back(target_pixel, inverse_depth, target, view, source)[..., :2]
    first = np.clip(np.floor(at + F(0.5)), F(0), last)
    hit = surface_at(surface_map, first.astype(int))
    met = plane_inverse_depth(hit, first, target_pixel, source, view, target)
    with np.errstate(invalid="ignore"):
        off = (met / inverse_depth - F(1)) * share_across(hit[..., :3], target_pixel, view, target)
        start = np.where(np.abs(off) < F(band), met, inverse_depth)
    seen = look_up(surface_map, start, hidden, target_pixel, source, view, target)
    final = plane_inverse_depth(seen.own, seen.pixel.astype(F), target_pixel, source, view, target)
    return seen._replace(inverse_depth=final)


def part_is_known(seen: Seen, size: np.ndarray) -> np.ndarray:
    inside = (seen.at > F(-0.61)).all(-1) & (seen.at < size - F(0.39)).all(-1)
    return inside & (seen.own[..., 3] > 0)


def agreement(off: np.ndarray, band: float) -> np.ndarray:
    share = off / F(band)
    rest = np.maximum(F(1) - share * share, F(0))
    return rest * rest


def view_weight(
    seen: Seen,
    target_pixel: np.ndarray,
    source: np.ndarray,
    view: np.ndarray,
    target: np.ndarray,
    is_exact: bool = False,
) -> np.ndarray:
    normal, z = seen.own[..., :3], seen.own[..., 3]
    from_source = normalize(pixel_ray(seen.at, source))
    from_target = normalize(pixel_ray(target_pixel, target) @ view[:3, :3])
    ours = np.maximum(-dot(normal, from_source)[..., 0], F(0))
    theirs = np.maximum(-dot(normal, from_target)[..., 0], MIN_COSINE)
    closer = F(1) / np.maximum(np.abs(seen.inverse_depth) * z, F(0.01))
    detail = np.abs(source[0] * source[1] / (target[0] * target[1])) * closer * closer * ours / theirs
    if is_exact:
        return (np.minimum(detail, MOST_SHARP) * ours) ** 2
    turned = F(2) * (F(1) - dot(from_source, from_target)[..., 0])
    alike = np.maximum(np.exp(-turned / (SEEN_ALIKE * SEEN_ALIKE)), LEAST_ALIKE)
    return np.minimum(detail, MOST_DETAIL) * ours * alike


def fallback_weight(off: np.ndarray, band: float) -> np.ndarray:
    share = np.minimum(np.abs(off) / F(band), F(1e4))
    return FALLBACK / (F(1) + share * share * share * share)
