"""Mirror of shaders/common/shadowed_lights.glsl."""

from __future__ import annotations

import numpy as np

from .lights import spot_cone
from .phong import attenuation, phong
from .shadow import cube_face, light_share
from .vectors import length, normalize

F = np.float32


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
    result = material[0] * ambient * albedo
    for row in lights[:count]:
        place, light, fading, spot, kind = row[0], row[1, :3], row[2, :3], row[3], row[4, :3]
        to_light = place[:3] * (F(1) if place[3] > 0 else F(-1)) - point * place[3]
        distance = length(to_light)
        lit = distance > 0
        safe = np.where(lit, distance, F(1))
        l = to_light / safe  # noqa: E741
        arriving = light * attenuation(safe, fading) if place[3] > 0 else light
        if spot[:3].any():
            arriving = arriving * spot_cone(spot[:3], l, kind[:2])
        if spot[3] >= 0:
            face = cube_face(-l @ to_world.T) if kind[2] > 1 else np.zeros(l.shape[:-1])
            for k in range(int(kind[2])):
                share = light_share(shadow_map, views, int(spot[3]) + k, point, n)
                arriving = np.where((face == k)[..., None], arriving * share, arriving)
        result = result + np.where(lit, phong(n, v, l, albedo, material, arriving), F(0))
    return np.clip(result, F(0), F(1))
