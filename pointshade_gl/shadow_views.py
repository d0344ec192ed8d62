"""The cameras of the pictures that lights take of a scene for their shadows. No GL here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, Eye
from .light import Light, count_views

Matrix = NDArray[np.float64]
FAR_AWAY = 1000.0  # radii of the scene between it and a directional light's camera: rays are parallel to 0.001
CONTACT = 0.003  # of the scene's radius: a nearer occluder touches the surface and casts no shadow on it
SHADOW_SIDE = 1024  # pixels of a shadow view
SHADOW_MAP = 8192  # pixels of all of them, side by side: beyond 64 views each becomes smaller
FACES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)  # of a point light


class ShadowView(NamedTuple):
    """One picture that a light takes of the scene."""

    eye: Eye
    contact: float  # world units by which an occluder must be nearer to the light than what it shades


def all_shadow_views(
    lights: Sequence[Light], centre: NDArray[np.float64], radius: float
) -> tuple[list[ShadowView], list[int | None]]:
    """The views that lights take of a sphere, all of one size, and the number of each light's first view.

    A light that casts no shadow has no view.
    """
    count = sum(count_views(light) for light in lights if light.shadow)
    side = min(SHADOW_SIDE, SHADOW_MAP // max(math.ceil(math.sqrt(count)), 1))
    views = [shadow_views(light, centre, radius, side) if light.shadow else [] for light in lights]
    firsts = np.cumsum([0, *map(len, views)]).tolist()
    firsts = [first if group else None for first, group in zip(firsts, views, strict=False)]
    return [view for group in views for view in group], firsts


def shadow_views(light: Light, centre: NDArray[np.float64], radius: float, side: int) -> list[ShadowView]:
    """The views that a light takes of a sphere: one, or six for a point light. side: of a view, in pixels."""
    if light.position is None:
        direction = np.array(light.direction, np.float64) / np.linalg.norm(np.array(light.direction))
        distance = FAR_AWAY * radius
        focal = (side / 2 - 2) * (distance - radius) / radius
        position, directions, near = centre - distance * direction, [direction], distance - 1.1 * radius
    else:
        position = np.array(light.position)
        away = float(np.linalg.norm(position - centre))
        near = max(away - 1.1 * radius, 0.002 * radius)
        if count_views(light) == 1:
            assert light.direction is not None
            directions, focal = [np.array(light.direction)], (side / 2 - 2) / math.tan(math.radians(light.cone[1]))
        else:
            directions, focal = list(FACES), side / 2 - 2.0
    camera = Camera(focal, focal, (side - 1) / 2, (side - 1) / 2, side, side)
    eyes = [Eye(camera, _looking(position, direction), near) for direction in directions]
    return [ShadowView(eye, CONTACT * radius) for eye in eyes]


def _looking(position: NDArray[np.float64], direction: NDArray[np.float64]) -> Matrix:
    """The pose of a camera at a position, looking along a direction. Similar directions get similar poses."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, np.eye(3)[int(abs(z[0]) > 0.7)])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], -1), position
    return pose
