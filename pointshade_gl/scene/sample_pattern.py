"""Sample positions for antialiasing and soft shadows: within a pixel, and on the surface of area lights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, check_count
from ..notes.words import option
from .light import Light, unit
from .visible import VisibleScene

# Steps of the sequences, in turns. Powers of the plastic number (Roberts, "The unreasonable effectiveness of
# quasirandom sequences", 2018) within the pixel; for lights square roots of primes (Richtmyer 1951), so that the two
# have nothing to do with each other.
_IN_PIXEL = 0.7548776662466927, 0.5698402909980532
_ON_LIGHT = math.sqrt(2) % 1, math.sqrt(3) % 1, math.sqrt(5) % 1
UPRIGHT = 1e-6  # of a unit vector: what lies farther from the y axis is not along it
MOST = 4096  # samples of a picture: more cannot be seen


def check_samples(samples: int) -> int:
    """How many pictures are averaged. Raises ValueError or TypeError unless it is a whole number from 1 to MOST."""
    number = check_count(samples, option("samples"), 1)
    if number > MOST:
        raise ValueError(f"{option('samples')} must be at most {MOST}, got {number}")
    return number


def pixel_offset(k: int) -> tuple[float, float]:
    """Return where sample k lies in its pixel, from -0.5 to 0.5 across and down: see `_in_square`."""
    return _in_square(k, _IN_PIXEL)


def _in_square(k: int, steps: tuple[float, float]) -> tuple[float, float]:
    """Return where sample k lies in a square with sides of 1: the middle first, then pairs that face each other across
    it (antithetic: Hammersley and Morton 1956), so that the mean of the samples stays in the middle."""
    side, j = (1 if k % 2 else -1), (k + 1) // 2
    x, y = (side * ((0.5 + j * step) % 1 - 0.5) for step in steps)
    return x, y


def ball_point(k: int) -> NDArray[np.float64]:
    """Return (3,) where sample k lies in a light of radius 1, seen along z: its middle first.

    From any side the samples fill a disc evenly, as a glowing ball looks: they are three of the four components of
    evenly spread rotations (Shoemake, "Uniform random rotations", 1992). The first two fill their disc best.
    """
    area, around, along = (k * step % 1 for step in _ON_LIGHT)
    across, around = math.sqrt(area), 2 * math.pi * around
    depth = math.sqrt(1 - area) * math.sin(2 * math.pi * along)
    return np.array([across * math.cos(around), across * math.sin(around), depth])


def moved_light(light: Light, k: int, centre: NDArray[np.float64]) -> Light:
    """Return the light of sample k: at the middle of a part of a light with a radius, an angle or a size, see
    `light_part`. centre: (3,) of what it lights.
    """
    if k == 0 or not light.is_soft:
        return light
    within = math.sqrt(1 - light_part(k) ** 2)  # with the part that lies round it, it is as wide as the light
    if light.size is not None:
        offset = within * np.array(_in_square(k, _ON_LIGHT[:2])) * light.size
        return _placed(light, offset @ _level(unit(light.direction)))
    offset = within * ball_point(k)
    if light.position is None:
        towards = unit(light.direction)
        x, y = _across(towards)
        offset *= math.tan(math.radians(light.angle) / 2)
        return replace(light, direction=tuple((towards + offset[0] * x + offset[1] * y).tolist()))
    to_centre = centre - np.array(light.position)
    away = np.linalg.norm(to_centre)
    towards = to_centre / away if away > 0 else np.array([0.0, 0.0, 1.0])
    return _placed(light, light.radius * offset @ np.stack([*_across(towards), towards]))


def light_part(k: int) -> float:
    """Return for how much of the radius of a soft light sample k stands.

    The first stands for all of it, each pair after it for less, whatever their number will be, so that a picture can be
    refined. n equal parts of a disc have 1/sqrt(n) of its radius; here they have less, as the first ones overlap.
    """
    return 1 / math.sqrt(4 * ((k + 1) // 2) + 1)


def at_sample(visible: VisibleScene, k: int) -> VisibleScene:
    """Return what sample k of a picture shows; sample 0 shows `visible` unchanged."""
    if k == 0:
        return visible
    (dx, dy), camera = pixel_offset(k), visible.eye.camera
    camera = replace(camera, cx=camera.cx - dx, cy=camera.cy - dy)
    lights = visible.lights
    if any(light.is_soft for light in lights):
        lights = [moved_light(light, k, visible.scene.bounds[0]) for light in lights]
    eye = visible.eye._replace(camera=camera)
    return visible._replace(eye=eye, lights=lights, sample=k, steady=visible.eye)


def _placed(light: Light, offset: NDArray[np.float64]) -> Light:
    """Return the light, moved by (3,)."""
    place = np.array(light.position) + offset
    return replace(light, position=tuple(np.clip(place, -LARGEST, LARGEST).tolist()))


def _level(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, 3) unit: which way the width and the height of a rectangle lie that faces a unit direction."""
    x, _, z = direction
    across = unit(np.array([z, 0.0, -x]) if math.hypot(x, z) > UPRIGHT else np.array([1.0, 0.0, 0.0]))
    return np.stack([across, np.cross(direction, across)])


def _across(direction: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two unit vectors (3,) at right angles to a unit direction and to each other."""
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = unit(np.asarray(np.cross(direction, other), np.float64))
    return x, unit(np.asarray(np.cross(direction, x), np.float64))
