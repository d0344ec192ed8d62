"""Mirror of shaders/common/surface.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray
from .splat import Footprint, invert_footprint
from .vectors import dot

F = np.float32
SAME_SURFACE = F(0.02)


def source_position(splat: Footprint, pixel: np.ndarray, target_pixel: np.ndarray) -> np.ndarray:
    to_source = invert_footprint(splat.to_target)
    offset = target_pixel - splat.centre
    return pixel + to_source[..., :2] * offset[..., :1] + to_source[..., 2:] * offset[..., 1:]


def point_on_plane(
    at: np.ndarray, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray, source: np.ndarray
) -> np.ndarray:
    w = w[..., None]
    w_at = np.maximum(w + dot(slope, at - pixel), F(0.01) * w)
    return pixel_ray(at, source) / w_at


def neighbour_weight(
    z: np.ndarray, corner: np.ndarray, at: np.ndarray, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray
) -> np.ndarray:
    known = z > 0
    expected = w + dot(slope, corner - pixel)[..., 0]
    off = np.abs(F(1) / np.where(known, z, F(1)) - expected) > SAME_SURFACE * w
    closeness = np.maximum(F(1) - np.abs(at - corner), F(0))
    return np.where(known & ~off, closeness[..., 0] * closeness[..., 1], F(0))
