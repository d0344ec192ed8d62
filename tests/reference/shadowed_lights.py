"""Mirror of shaders/common/shadowed_lights.glsl."""

from __future__ import annotations

import numpy as np

from .lights import BRIGHTEST, spot_cone
from .phong import attenuation, phong
from .shadow import cube_face, light_share
from .vectors import dot, length, normalize

F = np.float32


def sent_light(
    row: np.ndarray,
    point: np.ndarray,
    n: np.ndarray,
    shadow_map: np.ndarray,
    views: np.ndarray,
    to_world: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The light (..., 3), the unit vector to it, and (..., 1) the share that shadows leave. row (5, 4) of `lights`."""
    place, light, fading, spot, kind = row[0], row[1, :3], row[2, :3], row[3], row[4]
    to_light = place[:3] * (F(1) if place[3] > 0 else F(-1)) - point * place[3]
    distance = length(to_light)
    lit = distance > 0
    safe = np.where(lit, distance, F(1))
    l = np.where(lit, to_light / safe, n)  # noqa: E741
    arriving = light * attenuation(safe, fading) if place[3] > 0 else light
    if kind[3] > 0:
        arriving = arriving * np.maximum(dot(spot[:3], -l), F(0))
    elif spot[:3].any():
        arriving = arriving * spot_cone(spot[:3], l, kind[:2])
    share = np.ones_like(distance)
    if spot[3] >= 0:
        face = cube_face(-l @ to_world.T) if kind[2] > 1 else np.zeros(l.shape[:-1])
        for k in range(int(kind[2])):
            found = light_share(shadow_map, views, int(spot[3]) + k, point, n)
            share = np.where((face == k)[..., None] & (dot(n, l) > 0), found, share)
    return np.where(lit, arriving, F(0)), l, share


def light_surface_shadowed(
    point: np.ndarray,
    eye: np.ndarray,
    n: np.ndarray,
    albedo: np.ndarray,
    material: np.ndarray,
    ambient: np.ndarray,
    lights: np.ndarray,
    count: int,
    shadow_map: np.ndarray,
    views: np.ndarray,
    to_world: np.ndarray,
) -> np.ndarray:
    v = normalize(eye - point)
    result = material[..., :1] * ambient * albedo
    for row in lights[:count]:
        light, l, share = sent_light(row, point, n, shadow_map, views, to_world)  # noqa: E741
        result = result + phong(n, v, l, albedo, material, light * share)
    return np.clip(result, F(0), BRIGHTEST)
