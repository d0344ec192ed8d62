"""The cameras of the pictures that lights take of a scene for their shadows. No GL here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, Eye
from .light import Light, unit

Matrix = NDArray[np.float64]
Span = tuple[int, int]  # number of the first view, and how many there are
FAR_AWAY = 1000.0  # radii of the scene between it and a directional light's camera: rays are parallel to 0.001
CONTACT = 0.003  # of the scene's radius: a nearer occluder touches the surface and casts no shadow on it
SHADOW_SIDE = 1024  # pixels of a shadow view
SHADOW_MAP = 8192  # pixels of all of them, side by side: beyond 64 views each becomes smaller
NEAREST = 0.002  # of the scene's radius: what is nearer to a light casts no shadow
RIM = 2  # pixels round a view that stay empty: shadows are looked up in 3x3
WIDEST_VIEW = 70.0  # degrees from the middle of a view to its rim; beyond, six views are sharper
FACES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)  # of a point light


class ShadowView(NamedTuple):
    """One picture that a light takes of the scene."""

    eye: Eye
    contact: float  # world units by which an occluder must be nearer to the light than what it shades


def shadow_views(
    lights: Sequence[Light], centre: NDArray[np.float64], radius: float
) -> tuple[list[ShadowView], list[Span | None]]:
    """The views that the lights take of what lies within a sphere, all of one size, and which are each light's.

    A light that casts no shadow has no view.
    """
    looks = [_directions(light, centre, radius) if light.shadow else [] for light in lights]
    side = min(SHADOW_SIDE, SHADOW_MAP // max(math.ceil(math.sqrt(sum(map(len, looks)))), 1))
    views: list[ShadowView] = []
    spans: list[Span | None] = []
    for light, directions in zip(lights, looks, strict=True):
        spans.append((len(views), len(directions)) if directions else None)
        for direction, half in directions:
            views.append(ShadowView(_eye(light, direction, half, centre, radius, side), CONTACT * radius))
    return views, spans


def _directions(light: Light, centre: NDArray[np.float64], radius: float) -> list[tuple[NDArray[np.float64], float]]:
    """Where a light looks, unit, and half the angle that it must see, radians: the narrowest view that shows all of the
    sphere, or all that a spot shines on; else six of 90 degrees."""
    if light.position is None:
        return [(unit(light.direction), 0.0)]  # parallel rays
    to_centre = centre - np.array(light.position)
    away = float(np.linalg.norm(to_centre))
    found = [(unit(light.direction), math.radians(light.cone[1]))] if light.direction is not None else []
    if away > radius:
        found.append((to_centre / away, math.asin(radius / away)))
    found = [look for look in found if look[1] <= math.radians(WIDEST_VIEW)]
    return [min(found, key=lambda look: look[1])] if found else [(face, math.pi / 4) for face in FACES]


def _eye(
    light: Light, direction: NDArray[np.float64], half: float, centre: NDArray[np.float64], radius: float, side: int
) -> Eye:
    """Who looks for a light in a direction: a camera of side x side pixels, as near as the sphere comes."""
    if light.position is None:
        distance = FAR_AWAY * radius
        position, focal = centre - distance * direction, (side / 2 - RIM) * (distance - radius) / radius
    else:
        position, focal = np.array(light.position), (side / 2 - RIM) / math.tan(half)
    near = max(float((centre - position) @ direction) - 1.1 * radius, NEAREST * radius)
    camera = Camera(focal, focal, (side - 1) / 2, (side - 1) / 2, side, side)
    return Eye(camera, _looking(position, direction), near)


def _looking(position: NDArray[np.float64], direction: NDArray[np.float64]) -> Matrix:
    """The pose of a camera that looks along a unit direction; similar directions give a similar roll."""
    z = direction
    x = np.cross(z, np.eye(3)[int(abs(z[0]) > 0.7)])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], -1), position
    return pose
