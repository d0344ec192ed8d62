"""Lights: plain values, checked once, and the rows that the shaders read. The formulas are in shaders/common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .checks import check_color, check_flag, check_number, check_numbers, check_point, items_of, shown

WIDEST_SPOT = 70.0  # degrees; a wider spot casts its shadows as a point light does
SHORTEST = 1e-18  # of a direction: shaders square its length
UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A point light at `position`, a directional light along `direction`, or a spot with both; world axes.

    color, intensity   linear RGB and a factor on it
    attenuation        (kc, kl, kq): a light with a position, at distance d, is divided by kc + kl*d + kq*d*d
    cone               (inner, outer) half angles of a spot in degrees: full light inside, none outside
    shadow             whether objects in its way cast a shadow

    With neither position nor direction the light sits at the viewing camera's upper left, far away.
    Raises ValueError for impossible values, TypeError for values of another kind.
    """

    position: Vector | None = None
    direction: Vector | None = None
    color: Vector = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    attenuation: Vector = (1.0, 0.0, 0.0)
    cone: tuple[float, float] = (0.0, 45.0)
    shadow: bool = False

    def __post_init__(self) -> None:
        for name in ("position", "direction"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_point(getattr(self, name), f"light {name}"))
        if self.direction is not None and not any(self.direction):
            raise ValueError("light direction must not be (0, 0, 0)")
        if self.direction is not None and max(map(abs, self.direction)) < SHORTEST:
            raise ValueError(f"light direction must be longer than {SHORTEST:g}, got {self.direction}")
        object.__setattr__(self, "color", check_color(self.color, "light color"))
        complaint = "light attenuation must be three numbers, 0 or above and not all 0"
        attenuation = check_numbers(self.attenuation, 3, complaint, low=0)
        if not any(attenuation):
            raise ValueError(f"{complaint}, got {attenuation}")
        object.__setattr__(self, "attenuation", attenuation)
        object.__setattr__(self, "intensity", check_number(self.intensity, "light intensity", 0))
        complaint = "light cone must be two half angles, 0 <= inner <= outer <= 90 degrees"
        inner, outer = check_numbers(self.cone, 2, complaint)
        if not 0 <= inner <= outer <= 90 or outer == 0:
            raise ValueError(f"{complaint}, got {self.cone}")
        object.__setattr__(self, "cone", (inner, outer))
        object.__setattr__(self, "shadow", check_flag(self.shadow, "light shadow"))

    @property
    def is_spot(self) -> bool:
        return self.position is not None and self.direction is not None


def check_lights(light: Light | Sequence[Light] | None) -> list[Light]:
    """One light, several, or the default one for None, as a list. Raises TypeError if one is not a Light."""
    given: Any = Light() if light is None else light
    lights = items_of(given)
    lights = [given] if lights is None else lights
    for one in lights:
        if not isinstance(one, Light):
            got = shown(one)
            raise TypeError(f"light must be a Light or several of them, got {got}: try Light(position=(x, y, z))")
    return lights


def at_upper_left(light: Light, target_pose: NDArray[Any]) -> Light:
    """The light. One without place and direction gets a direction: from the viewing camera's upper left, world axes."""
    if light.position is not None or light.direction is not None:
        return light
    x, y, z = target_pose[:3, :3] @ UPPER_LEFT
    return replace(light, direction=(float(x), float(y), float(z)))


def light_rows(
    lights: Sequence[Light], axes: NDArray[Any], first_views: Sequence[int | None] | None = None
) -> NDArray[np.float32]:
    """Lights as the shaders read them: (n, 5, 4) float32, in the axes of a camera with this pose (4, 4).

    lights       each with a position or a direction (see `at_upper_left`)
    first_views  the number of each light's first shadow view, None without one

    Texel by texel: position, or direction of travel, and whether it is a position; colour times intensity;
    attenuation; direction of a spot and its first shadow view; cosines of the cone and the number of views.
    """
    rows = np.zeros((len(lights), 5, 4))
    for row, light, first in zip(rows, lights, first_views or [None] * len(lights), strict=True):
        if light.position is not None:
            row[0] = [*(axes[:3, :3].T @ (np.array(light.position) - axes[:3, 3])), 1]
        else:
            row[0, :3] = axes[:3, :3].T @ np.array(light.direction)
        row[1, :3] = np.array(light.color) * light.intensity
        row[2, :3] = light.attenuation
        if light.is_spot:
            direction = np.array(light.direction) / np.linalg.norm(np.array(light.direction))
            row[3, :3] = axes[:3, :3].T @ direction
            row[4, :2] = np.cos(np.radians(light.cone))
        row[3, 3] = -1 if first is None else first
        row[4, 2] = count_views(light)
    return rows.astype(np.float32)


def count_views(light: Light) -> int:
    """How many shadow views a light needs: six if it shines in all directions, else one."""
    narrow = light.is_spot and light.cone[1] <= WIDEST_SPOT
    return 1 if light.position is None or narrow else 6
