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
LEAST_GAIN, MOST_GAIN = F(0.5), F(6.0)


def shading_at(normal: np.ndarray, light: np.ndarray) -> np.ndarray:
    return light[3] + np.maximum(dot(normal, light[:3])[..., 0], F(0))


def shading_gain(shading: np.ndarray, white: float) -> np.ndarray:
    return np.clip(F(white) / np.maximum(shading, F(1e-6)), LEAST_GAIN, MOST_GAIN)


def gained(linear: np.ndarray, gain: np.ndarray) -> np.ndarray:
    most = np.maximum(linear.max(-1), F(1e-6))
    return linear * np.minimum(gain, np.maximum(F(1) / most, F(1)))[..., None]


def see_nearest(surface_map: np.ndarray, at: np.ndarray) -> Seen:
    corners = corners_at(surface_map, at)
    far = [np.sqrt(dot(off, off))[..., 0] for off in (at - p.astype(F) for p in four(corners.low, corners.high))]
    far = [d + F(10) * (s[..., 3] == 0) for d, s in zip(far, corners[2:], strict=True)]
    right_above, right_below = far[1] < far[0], far[3] < far[2]
    below = np.where(right_below, far[3], far[2]) < np.where(right_above, far[1], far[0])
    side = np.stack([np.where(below, right_below, right_above), below], -1)
    own = corner_surface(corners, side)
    return Seen(at, np.zeros(at.shape[:-1], F), corner_pixel(corners, side), own, corners)


def gain_at(surface_map: np.ndarray, at: np.ndarray, source: np.ndarray, light: np.ndarray, white: float) -> np.ndarray:
    seen = see_nearest(surface_map, at)
    known = (seen.own[..., 3] != 0) & seen.own[..., :3].any(-1)
    with np.errstate(divide="ignore", invalid="ignore"):  # in holes
        normal = mix_normal(seen, seen_weights(seen, source))
        return np.where(known, shading_gain(shading_at(normal, light), white), F(1))


def albedo_of(
    picture: np.ndarray, surface_map: np.ndarray, source: np.ndarray, light: np.ndarray, white: float
) -> np.ndarray:
    """The picture (h, w, 3|4) float32, sRGB 0..1, freed from a light (4,): direction and ambient; alpha stays."""
    sizes = (np.array(image.shape[1::-1], F) for image in (picture, surface_map))
    at = rescale_position(np.stack(pixel_grid(picture[..., 0]), -1).reshape(-1, 2), *sizes)
    linear = srgb_to_linear(picture[..., :3].reshape(-1, 3))
    linear = gained(linear, gain_at(surface_map, at, source, light, white))
    encoded = linear_to_srgb(linear).reshape(*picture.shape[:2], 3)
    return np.concatenate([encoded, picture[..., 3:]], -1)
