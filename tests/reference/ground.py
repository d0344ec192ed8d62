"""Mirror of shaders/common/ground.glsl."""

from __future__ import annotations

import numpy as np

from .shadowed_lights import sent_light
from .vectors import dot

F = np.float32
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], F)


def ground_depth(ray: np.ndarray, plane: np.ndarray) -> np.ndarray:
    down = -dot(plane[:3], ray)[..., 0]
    meets = (down > 0) & (plane[3] > 0)
    return np.where(meets, plane[3] / np.where(meets, down, F(1)), F(0))


def shadow_alpha(
    point: np.ndarray,
    n: np.ndarray,
    material: np.ndarray,
    around: np.ndarray,
    left: np.ndarray,
    lights: np.ndarray,
    count: int,
    shadow_map: np.ndarray,
    views: np.ndarray,
    to_world: np.ndarray,
) -> np.ndarray:
    whole = np.broadcast_to(around, point.shape)
    lost = np.zeros_like(point)
    for row in lights[:count]:
        light, l, share = sent_light(row, point, n, shadow_map, views, to_world)  # noqa: E741
        light = light * (material[1] * np.maximum(dot(n, l), F(0)))
        whole = whole + light
        lost = lost + light * (F(1) - share)
    taken = np.broadcast_to(around - left, point.shape)
    return np.stack([lost @ LUMINANCE, taken @ LUMINANCE], -1) / np.maximum(whole @ LUMINANCE, F(1e-9))[..., None]
