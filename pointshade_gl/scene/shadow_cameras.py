"""Computes the cameras of shadow maps: for each light, the views that show all that casts shadows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, Eye
from .light import WIDEST, Light, unit

Matrix = NDArray[np.float64]
Span = tuple[int, int]  # number of the first view, and how many there are
FAR_AWAY = 1000.0  # radii of the scene between it and a directional light's camera: rays are parallel to 0.001
# A lamp farther away casts shadows as a directional light does: float32 tells no depths apart at 1e6 radii.
CONTACT = 1.2  # source pixels: what stands out of a surface by less touches it and casts no shadow on it
ROUGH_CONTACT = 3.0  # times the noise of depth, likewise
LEAST_CONTACT = 0.0005  # of the scene's radius: shadow maps are no finer
SHADOW_SIDE = 1024  # pixels of a shadow view
SHADOW_MAP = 8192  # pixels of all of them, side by side: beyond 64 views each becomes smaller
NEAREST = 0.002  # of the scene's radius: what is nearer to a light casts no shadow
RIM = 2  # pixels round a view that stay empty: shadows are looked up in 3x3
NARROWEST = 1e-4  # of the scene's radius or distance: half of a view at least
WIDEST_VIEW = 70.0  # degrees from the middle of a view to its rim; beyond, six views are sharper
TURNS = 3  # towards the middle of what is seen: each moves it a little
FACES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)  # of a point light


class Roughness(NamedTuple):
    """The noise of depth: of a point its `noise` times the square of `plane` @ (x, y, z, 1), at least `noise`."""

    noise: float = 0.0  # world units
    plane: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # depth over the one where the noise is that, world


SMOOTH = Roughness()


class ShadowView(NamedTuple):
    """One shadow camera of a light."""

    eye: Eye
    contact: float  # world units by which an occluder must stand out of the surface that it shades
    farther: tuple[float, float, float, float]  # by more where depth has more noise: `Roughness.plane`
    spread: float  # radius of the part of the light that this view stands for, world units; 0: a point


class Extent(NamedTuple):
    """Where objects lie, to fit shadow cameras to them."""

    corners: Matrix  # (n, 3) of boxes round them, world
    centre: NDArray[np.float64]  # (3,) of a sphere round these, and its radius
    radius: float
    grain: float  # how wide a pixel of a frame is among them, world units; 0 without frames


def shadow_views(
    lights: Sequence[Light], extent: Extent, part: float = 1.0, roughness: Roughness = SMOOTH, coarse: int = 1
) -> tuple[list[ShadowView], list[Span | None]]:
    """Return the shadow cameras of all lights, of one picture size, and for each light the span of those that are its
    own.

    A light that casts no shadow has none. part: share of the radius of soft lights for which this sample stands.
    coarse: how many times larger their pixels are.
    """
    lights = [_sun_if_far(light, extent) for light in lights]
    looks = [_directions(light, extent) if light.shadow else [] for light in lights]
    contact = contact_of(extent, roughness.noise)
    side = min(SHADOW_SIDE // coarse, SHADOW_MAP // max(math.ceil(math.sqrt(sum(map(len, looks)))), 1))
    views: list[ShadowView] = []
    spans: list[Span | None] = []
    for light, directions in zip(lights, looks, strict=True):
        spans.append((len(views), len(directions)) if directions else None)
        for direction, half in directions:
            eye = _eye(light, direction, half, extent, side)
            views.append(ShadowView(eye, contact, roughness.plane, part * _radius(light, extent)))
    return views, spans


def contact_of(extent: Extent, noise: float) -> float:
    """Return by how much an occluder must stand out of the surface that it shades, world units."""
    return max(CONTACT * extent.grain, LEAST_CONTACT * extent.radius, ROUGH_CONTACT * noise)


def _radius(light: Light, extent: Extent) -> float:
    """Return the radius of a light for its shadow cameras, world units; of a rectangle that of a disc as large."""
    if light.size is not None:
        return math.sqrt(light.size[0] * light.size[1] / math.pi)
    return light.radius or FAR_AWAY * extent.radius * math.tan(math.radians(light.angle) / 2)


def _sun_if_far(light: Light, extent: Extent) -> Light:
    if light.position is None or not light.shadow:
        return light
    to_centre = extent.centre - light.position
    away = float(np.linalg.norm(to_centre))
    if away <= FAR_AWAY * extent.radius:
        return light
    angle = min(2 * math.degrees(math.atan(_radius(light, extent) / away)), WIDEST)
    return replace(light, position=None, direction=tuple(to_centre.tolist()), radius=0.0, size=None, angle=angle)


def _directions(light: Light, extent: Extent) -> list[tuple[NDArray[np.float64], float]]:
    """Return the unit directions in which a light looks, and for each half the angle that it must see, radians.

    One direction, if a view shows all objects, or all that a spot shines on: the narrowest. Else six of 90 degrees.
    """
    if light.position is None:
        return [(unit(light.direction), 0.0)]  # parallel rays
    position = np.array(light.position)
    to_centre = extent.centre - position
    away = float(np.linalg.norm(to_centre))
    found = [(unit(light.direction), math.radians(light.cone[1]))] if light.is_spot else []
    if away > extent.radius:
        found.append(_narrowest(position, to_centre / away, extent.corners))
    found = [look for look in found if look[1] <= math.radians(WIDEST_VIEW)]
    return [min(found, key=lambda look: look[1])] if found else [(face, math.pi / 4) for face in FACES]


def _narrowest(
    position: NDArray[np.float64], direction: NDArray[np.float64], corners: Matrix
) -> tuple[NDArray[np.float64], float]:
    """Return the unit direction, near a given one, to the middle of all corners (n, 3), and half their angle."""
    for _ in range(TURNS):
        turn, places = _places(position, direction, corners)
        ends = np.arctan([places.min(0), places.max(0)])
        direction = unit(turn @ np.append(np.tan(ends.mean(0)), 1.0))
    _, places = _places(position, direction, corners)
    return direction, math.atan(max(float(np.abs(places).max()), NARROWEST))


def _places(position: NDArray[np.float64], direction: NDArray[np.float64], corners: Matrix) -> tuple[Matrix, Matrix]:
    """Return the rotation (3, 3) of a camera that looks so, and where it sees corners: (n, 2) at depth 1."""
    turn = _looking(position, direction)[:3, :3]
    seen = (corners - position) @ turn
    return turn, seen[:, :2] / seen[:, 2:]


def _eye(light: Light, direction: NDArray[np.float64], half: float, extent: Extent, side: int) -> Eye:
    """Return a light's shadow camera: side x side pixels, its near plane close to the nearest object."""
    corners, centre, radius, _ = extent
    if light.position is None:
        across = _looking(centre, direction)[:3, :2]
        places = (corners - centre) @ across
        low, high = places.min(0), places.max(0)
        distance, reach = FAR_AWAY * radius, max(float((high - low).max()) / 2, NARROWEST * radius)
        position = centre + across @ ((low + high) / 2) - distance * direction
        focal = (side / 2 - RIM) * (distance - radius) / reach
    else:
        position, focal = np.array(light.position), (side / 2 - RIM) / math.tan(half)
    # a little before the sphere around all, so that its nearest point is not cut away
    near = max(float((centre - position) @ direction) - 1.1 * radius, NEAREST * radius)
    camera = Camera(focal, focal, (side - 1) / 2, (side - 1) / 2, side, side)
    return Eye(camera, _looking(position, direction), near)


def _looking(position: NDArray[np.float64], direction: NDArray[np.float64]) -> Matrix:
    """Return the pose of a camera that looks along a unit direction; similar directions give a similar roll."""
    z = direction
    # across from an axis that is not nearly the direction itself: their product would vanish
    x = np.cross(z, np.eye(3)[int(abs(z[0]) > 0.7)])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], -1), position
    return pose
