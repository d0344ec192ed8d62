"""Mirror of shaders/common/depth_lookup.glsl."""

from __future__ import annotations

import numpy as np

from .camera import pixel_ray, project
from .splat import MARGIN, Footprint, carry_offset_back, invert_footprint, splat_bend, splat_reach
from .vectors import dot

F = np.float32
SAME_SURFACE = F(0.02)
RIM_REACH = F(0.985)
BEFORE, NEARBY = F(1.5), F(1e-4)
HIDDEN_PIXELS = 2


def pixel_of(index: np.ndarray, columns: int) -> np.ndarray:
    return np.stack([index % columns, index // columns], -1)


def source_position(splat: Footprint, pixel: np.ndarray, target_pixel: np.ndarray) -> np.ndarray:
    bend = splat_bend(splat, splat_reach(F(1), False))
    back = carry_offset_back(invert_footprint(splat.to_target), bend, target_pixel - splat.centre)
    return pixel + back[..., :2]


def inverse_depth_at(at: np.ndarray, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray) -> np.ndarray:
    return np.maximum(w + dot(slope, at - pixel)[..., 0], F(0.01) * w)


def carry_back(
    target_pixel: np.ndarray, inverse_depth: np.ndarray, target: np.ndarray, view: np.ndarray, source: np.ndarray
) -> np.ndarray:
    h = (pixel_ray(target_pixel, target) - view[:3, 3] * inverse_depth[..., None]) @ view[:3, :3]
    return np.concatenate([project(h, source), (inverse_depth / h[..., 2])[..., None]], -1)


def hidden_mark(bits: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    return np.where(hidden, bits | np.uint32(1), bits & ~np.uint32(1))


def neighbour_weight(
    z: np.ndarray, corner: np.ndarray, at: np.ndarray, pixel: np.ndarray, w: np.ndarray, slope: np.ndarray
) -> np.ndarray:
    known = z != 0
    expected = w + dot(slope, corner - pixel)[..., 0]
    off = np.abs(F(1) / np.where(known, np.abs(z), F(1)) - expected) > SAME_SURFACE * w
    closeness = np.maximum(F(1) - np.abs(at - corner), F(0))
    return np.where(known & ~off, closeness[..., 0] * closeness[..., 1], F(0))


def look_up_error(z: np.ndarray, corner: np.ndarray, at: np.ndarray, w_at: np.ndarray) -> np.ndarray:
    off = np.abs(at - corner).max(-1)
    known = (z != 0) & (off <= np.where(z < 0, RIM_REACH, F(0.501) + MARGIN))
    return np.where(known, np.abs(F(1) / np.where(known, np.abs(z), F(1)) - w_at), F(1e30))
