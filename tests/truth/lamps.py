"""Lights of a truth picture, in the source camera's axes, as numbers that both Blender and pointshade_gl read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Lamp:
    """`level` is the irradiance over pi at `distance` from the lamp: linear white there is 1. Sun: everywhere.

    position, direction  (3,) in the source camera's axes; a sun has no position, a point no direction
    cone                 (inner, outer) half angles of a spot, degrees
    """

    name: str
    level: float
    position: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    distance: float = 1.0
    cone: tuple[float, float] | None = None

    @property
    def kind(self) -> str:
        return "SUN" if self.position is None else "POINT" if self.direction is None else "SPOT"

    @property
    def intensity(self) -> float:
        """As `ps.Light` takes it, with attenuation (0, 0, 1) where there is a position."""
        return self.level if self.position is None else self.level * self.distance**2

    @property
    def energy(self) -> float:
        """As Blender takes it: the strength of a sun, otherwise watts."""
        return self.intensity * (np.pi if self.position is None else 4 * np.pi**2)

    @property
    def spot_blend(self) -> float:
        """As Blender takes it: the share of the cone's cosines between its edges."""
        inner, outer = np.cos(np.radians(self.cone))
        return float((inner - outer) / (1 - outer))


def lamps(rng: np.random.Generator, up: np.ndarray, target: np.ndarray, reach: float) -> list[Lamp]:
    """Sun, spot, point and a sun from the side, of a camera that sees `up` (3,) as the vertical and looks at `target`.

    reach  the distance of the target from the camera
    """
    side = rng.choice([-1, 1])
    sun = towards(up, side * rng.uniform(25, 60), rng.uniform(35, 60))
    spot = towards(up, -side * rng.uniform(15, 50), rng.uniform(45, 65))
    point = towards(up, side * rng.uniform(10, 60), rng.uniform(40, 65))
    grazing = towards(up, -side * rng.uniform(82, 95), rng.uniform(18, 30))
    outer = rng.uniform(26, 34)
    cone = (outer * rng.uniform(0.5, 0.9), outer)
    far, near = rng.uniform(0.8, 1.0) * reach, rng.uniform(0.55, 0.75) * reach
    return [
        Lamp("sun", 0.95, None, tuple(-sun)),
        Lamp("spot", 1.0, tuple(target + far * spot), tuple(-spot), far, cone),
        Lamp("point", 0.8, tuple(target + near * point), None, near),
        Lamp("side", 0.95, None, tuple(-grazing)),
    ]


def towards(up: np.ndarray, around: float, above: float) -> np.ndarray:
    """The unit vector to a place `around` degrees to the camera's right of straight behind it, `above` the horizon."""
    back = np.array([0, 0, -1.0])
    back -= (back @ up) * up
    back /= np.linalg.norm(back)
    right = np.array([1.0, 0, 0])
    a, b = np.radians([around, above])
    return np.cos(b) * (np.cos(a) * back + np.sin(a) * right) + np.sin(b) * up


def lambert(lamp: Lamp, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(h, w) light on white without any shadow, by the formula of both programs; everything in the source's axes."""
    if lamp.position is None:
        to_light, strength = -np.array(lamp.direction), lamp.intensity
    else:
        to_light = np.array(lamp.position) - points
        distance = np.maximum(np.linalg.norm(to_light, axis=-1, keepdims=True), 1e-9)
        to_light, strength = to_light / distance, lamp.intensity / distance[..., 0] ** 2
    if lamp.cone is not None:
        inner, outer = np.cos(np.radians(lamp.cone))
        inside = np.clip((-(to_light * lamp.direction).sum(-1) - outer) / (inner - outer), 0, 1)
        strength = strength * inside**2 * (3 - 2 * inside)
    return strength * np.maximum((normals * to_light).sum(-1), 0)
