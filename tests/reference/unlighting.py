"""Mirror of shaders/common/unlighting.glsl, and of unlighting.frag."""

from __future__ import annotations

import numpy as np

from .color import linear_to_srgb, srgb_to_linear
from .inverse_depth import pixel_grid
from .picture import rescale_position
from .resolve import Seen, mix_normal, seen_weights
from .splat_corners import corner_pixel, corner_surface, corners_at, four
from .vectors import dot

F = np.float32
LEAST_SHARE, SAMPLE_BEND, MOST_BEND, STEEPEST, SAMPLE_STEP = F(1e-3), F(0.09), F(4.0), F(0.2), F(0.3)
DARKEST_LIGHT, NOISY = F(0.002), (F(0.004), F(0.012))
RAISED = F(2.0), F(6.0)


def gained(linear: np.ndarray, gain: np.ndarray) -> np.ndarray:
    most = np.maximum(linear.max(-1), F(1e-6))
    return linear * np.minimum(gain, np.maximum(F(1) / most, F(1)))[..., None]


def luminance_of(linear: np.ndarray) -> np.ndarray:
    return linear @ np.array((0.2126, 0.7152, 0.0722), F)


def see_nearest(surface_map: np.ndarray, at: np.ndarray) -> Seen:
    corners = corners_at(surface_map, at)
    far = [np.sqrt(dot(off, off))[..., 0] for off in (at - p.astype(F) for p in four(corners.low, corners.high))]
    far = [d + F(10) * (s[..., 3] == 0) for d, s in zip(far, corners[2:], strict=True)]
    right_above, right_below = far[1] < far[0], far[3] < far[2]
    below = np.where(right_below, far[3], far[2]) < np.where(right_above, far[1], far[0])
    side = np.stack([np.where(below, right_below, right_above), below], -1)
    own = corner_surface(corners, side)
    return Seen(at, np.zeros(at.shape[:-1], F), corner_pixel(corners, side), own, corners)


def normal_between(surface_map: np.ndarray, at: np.ndarray, source: np.ndarray) -> np.ndarray:
    seen = see_nearest(surface_map, at)
    known = (seen.own[..., 3] != 0) & seen.own[..., :3].any(-1)
    with np.errstate(divide="ignore", invalid="ignore"):  # in holes
        return np.where(known[..., None], mix_normal(seen, seen_weights(seen, source)), F(0))


def sample_weight(off: np.ndarray, own: np.ndarray, slope: np.ndarray, sampled: np.ndarray) -> np.ndarray:
    turn = sampled[..., :2] - own[..., :2]
    rise = dot(slope, turn)
    bend = np.minimum(dot(turn, turn) + rise * rise, MOST_BEND)[..., 0] / SAMPLE_BEND
    share = np.maximum(F(1) - np.abs(off), LEAST_SHARE)
    return share[..., 0] * share[..., 1] * np.exp(-bend - np.abs(sampled[..., 2] - own[..., 2]) / SAMPLE_STEP)


def unlit(
    gain_map: np.ndarray, hue_map: np.ndarray, at: np.ndarray, normal: np.ndarray, linear: np.ndarray
) -> np.ndarray:
    last, low = np.array(gain_map.shape[1::-1]) - 1, np.floor(at).astype(int)
    luminance = luminance_of(linear)
    own = np.concatenate([normal[..., :2], np.log(np.maximum(luminance, DARKEST_LIGHT))[..., None]], -1)
    slope = normal[..., :2] / np.maximum(-normal[..., 2:], STEEPEST)
    total, summed = np.zeros_like(luminance), np.zeros_like(luminance)
    around = np.zeros_like(linear)
    for k in range(4):
        place = np.clip(low + np.array((k % 2, k // 2)), 0, last)
        sampled = gain_map[place[..., 1], place[..., 0]]
        weight = sample_weight(place.astype(F) - at, own, slope, sampled[..., :3])
        total += weight
        summed += weight * sampled[..., 3]
        around += weight[..., None] * hue_map[place[..., 1], place[..., 0], :3]
    gain = np.where(total > 0, np.exp(summed / np.where(total > 0, total, F(1))), F(1))
    hueless = np.clip((NOISY[1] - luminance) / (NOISY[1] - NOISY[0]), F(0), F(1))
    hueless *= np.clip((gain - RAISED[0]) / (RAISED[1] - RAISED[0]), F(0), F(1))
    bright = luminance_of(around)
    scaled = around * (luminance / np.where(bright > 0, bright, F(1)))[..., None]
    linear = np.where((bright > 0)[..., None], linear + (scaled - linear) * hueless[..., None], linear)
    return gained(linear, gain)


def albedo_of(
    picture: np.ndarray,
    surface_map: np.ndarray,
    source: np.ndarray,
    gain_map: np.ndarray,
    hue_map: np.ndarray,
    samples: np.ndarray,
) -> np.ndarray:
    """The picture (h, w, 3|4) float32, sRGB 0..1, freed from its light; alpha stays."""
    size, surface_size = (np.array(image.shape[1::-1], F) for image in (picture, surface_map))
    pixel = np.stack(pixel_grid(picture[..., 0]), -1).reshape(-1, 2)
    normal = normal_between(surface_map, rescale_position(pixel, size, surface_size), source)
    linear = srgb_to_linear(picture[..., :3].reshape(-1, 3))
    freed = linear_to_srgb(unlit(gain_map, hue_map, rescale_position(pixel, size, samples), normal, linear))
    color = np.where(normal.any(-1, keepdims=True), freed, picture[..., :3].reshape(-1, 3))
    return np.concatenate([color.reshape(*picture.shape[:2], 3), picture[..., 3:]], -1)
