"""Mirror of shaders/common/highlights.glsl, and of highlight_removal.frag."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .color import linear_to_srgb, srgb_to_linear
from .inverse_depth import pixel_grid
from .picture import rescale_position
from .resolve import FEW
from .splat_corners import corners_at, surface_at
from .texels import texel_at
from .vectors import dot, normalize

F = np.float32
MOST_HIGHLIGHT, FAINT, SAME_DEPTH = F(0.9), F(0.001), F(0.03)
SMOOTH_NEAR, SMOOTH_STEP = F(0.9), 2


def strength_at(strength_map: np.ndarray, at: np.ndarray, size: np.ndarray, depth: np.ndarray) -> np.ndarray:
    place = rescale_position(at, size, np.array(strength_map.shape[1::-1], F))
    corners = corners_at(strength_map, place)
    share = np.clip(place - corners.low.astype(F), F(0), F(1)).astype(F)
    x, y = share[..., 0], share[..., 1]
    total = sum_ = np.zeros(depth.shape, F)
    for weight, corner in zip(((1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y), corners[2:], strict=True):
        weight = weight * (np.abs(corner[..., 1] - depth) < SAME_DEPTH * depth)
        total, sum_ = total + weight, sum_ + weight * corner[..., 0]
    return np.where(total > FEW, sum_ / np.maximum(total, FEW), F(0))


def highlight_of(normal: np.ndarray, point: np.ndarray, light: np.ndarray, exponent: float) -> np.ndarray:
    eye = -normalize(point)
    to_light = normalize(light[:3] - light[3] * point)
    r = F(2) * dot(normal, eye) * normal - eye
    glint = np.maximum(dot(r, to_light)[..., 0], F(1e-6)) ** F(exponent)
    return np.where(dot(normal, to_light)[..., 0] > 0, glint, F(0))


def smooth_normal(surface_map: np.ndarray, at: np.ndarray, own: np.ndarray) -> np.ndarray:
    last = np.array(surface_map.shape[1::-1]) - 1
    middle = np.floor(at + F(0.5)).astype(int)
    total = np.zeros_like(own)
    for k in range(25):
        pixel = np.clip(middle + SMOOTH_STEP * (np.array([k % 5, k // 5]) - 2), 0, last)
        off = pixel.astype(F) - at
        normal = texel_at(surface_map, pixel)[..., :3]
        total = total + (dot(normal, own) > SMOOTH_NEAR) * np.exp(F(-0.125) * dot(off, off)) * normal
    return normalize(total)


def highlight_at(
    surface_map: np.ndarray,
    strength_map: np.ndarray,
    at: np.ndarray,
    source: np.ndarray,
    light: np.ndarray,
    exponent: float,
) -> np.ndarray:
    last = np.array(surface_map.shape[1::-1]) - 1
    own = surface_at(surface_map, np.clip(np.floor(at + F(0.5)).astype(int), 0, last))
    known = (own[..., 3] != 0) & own[..., :3].any(-1)
    found = np.zeros(len(at), F)
    at, own = at[known], own[known]
    point = pixel_ray(at, source) * own[..., 3:]
    lit = highlight_of(own[..., :3], point, light, 0.7 * exponent) > FAINT
    normal = smooth_normal(surface_map, at[lit], own[lit, :3])
    strength = strength_at(strength_map, at[lit], np.array(surface_map.shape[1::-1], F), own[lit, 3])
    found[np.flatnonzero(known)[lit]] = strength * highlight_of(normal, point[lit], light, exponent)
    return found


def without_highlight(linear: np.ndarray, highlight: np.ndarray) -> np.ndarray:
    return linear - np.minimum(highlight[..., None], MOST_HIGHLIGHT * linear)


def matte_of(
    picture: np.ndarray,
    surface_map: np.ndarray,
    strength_map: np.ndarray,
    source: np.ndarray,
    light: np.ndarray,
    exponent: float,
) -> np.ndarray:
    """The picture (h, w, 3|4) float32, sRGB 0..1, without its highlights; alpha stays.

    strength_map  (h, w, 2|4) small: strength and depth
    light         (4,) l and q, see FoundHighlights
    """
    sizes = (np.array(image.shape[1::-1], F) for image in (picture, surface_map))
    at = rescale_position(np.stack(pixel_grid(picture[..., 0]), -1).reshape(-1, 2), *sizes)
    highlight = highlight_at(surface_map, strength_map, at, source, light, exponent)
    linear = without_highlight(srgb_to_linear(picture[..., :3].reshape(-1, 3)), highlight)
    encoded = np.where((highlight > 0)[:, None], linear_to_srgb(linear), picture[..., :3].reshape(-1, 3))
    return np.concatenate([encoded.reshape(*picture.shape[:2], 3), picture[..., 3:]], -1)
