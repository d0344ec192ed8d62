"""Mirror of shaders/common/lights.glsl."""

from __future__ import annotations

import numpy as np

from .phong import attenuation, phong
from .vectors import dot, length, normalize

F = np.float32
BRIGHTEST = F(65504)


def spot_cone(direction: np.ndarray, l: np.ndarray, cosines: np.ndarray) -> np.ndarray:  # noqa: E741 (the field's name)
    inside = (dot(direction, -l) - cosines[1]) / np.maximum(cosines[0] - cosines[1], F(1e-4))
    inside = np.clip(inside, F(0), F(1))
    return inside * inside * (F(3) - F(2) * inside)


def light_of_row(
    row: np.ndarray, point: np.ndarray, v: np.ndarray, n: np.ndarray, albedo: np.ndarray, material: np.ndarray
) -> np.ndarray:
    place, light, k = row[0], row[1, :3], row[2, :3]
    to_light = place[:3] * (F(1) if place[3] > 0 else F(-1)) - point * place[3]
    distance = length(to_light)
    lit = distance > 0
    safe = np.where(lit, distance, F(1))
    arriving = light * attenuation(safe, k) if place[3] > 0 else light
    return np.where(lit, phong(n, v, to_light / safe, albedo, material, arriving), F(0))


def light_surface(
    point: np.ndarray,
    eye: np.ndarray,
    n: np.ndarray,
    albedo: np.ndarray,
    material: np.ndarray,
    ambient: np.ndarray,
    lights: np.ndarray,
    count: int,
) -> np.ndarray:
    v = normalize(eye - point)
    result = material[..., :1] * ambient * albedo
    for row in lights[:count]:
        result = result + light_of_row(row, point, v, n, albedo, material)
    return np.clip(result, F(0), BRIGHTEST)


def light_surface_alone(
    point: np.ndarray,
    eye: np.ndarray,
    n: np.ndarray,
    albedo: np.ndarray,
    material: np.ndarray,
    ambient: np.ndarray,
    row: np.ndarray,
) -> np.ndarray:
    return light_surface(point, eye, n, albedo, material, ambient, row[None], 1)
