"""Point, directional and spot lights, checked when they are made, and packed into the rows that shaders read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..messages.formatting import shown
from ..messages.validation import (
    Numbers,
    check_color,
    check_direction,
    check_flag,
    check_number,
    check_numbers,
    check_point,
    items_of,
)

UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes
WIDEST = 120.0  # degrees of a directional light
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A point light at `position`, a directional light along `direction`, or a spot light with both; world axes.

    With neither position nor direction, the light is far away at the viewing camera's upper left.

    Parameters
    ----------
    position : (3,) float, optional
        Where the light is.
    direction : (3,) float, optional
        Which way the light travels, of any length.
    color : (3,) float
        Linear RGB.
    intensity : float
        Factor on the colour.
    attenuation : (3,) float
        (kc, kl, kq): at distance d, a light with a position is divided by kc + kl*d + kq*d*d.
    cone : (2,) float
        Inner and outer half angle of a spot light in degrees: full light inside, none outside.
    shadow : bool
        Whether objects in its way cast a shadow.
    radius : float
        Only with a position: radius of a glowing ball, world units (metres).
    angle : float
        Only of a directional light: size of its disc in the sky, full angle in degrees up to 120; the sun has 0.53.

    Raises
    ------
    ValueError
        For impossible values.
    TypeError
        For values of another kind.

    Notes
    -----
    A light with a radius or an angle casts soft shadows in pictures of several samples; with one sample it shines from
    its middle.
    """

    position: Vector | None = None
    direction: Vector | None = None
    color: Vector = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    attenuation: Vector = (1.0, 0.0, 0.0)
    cone: tuple[float, float] = (0.0, 45.0)
    shadow: bool = False
    radius: float = 0.0
    angle: float = 0.0

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self,
            position: Numbers | None = None,
            direction: Numbers | None = None,
            color: Numbers = ...,
            intensity: float = ...,
            attenuation: Numbers = ...,
            cone: Numbers = ...,
            shadow: bool = ...,
            radius: float = ...,
            angle: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.position is not None:
            object.__setattr__(self, "position", check_point(self.position, "light position"))
        if self.direction is not None:
            object.__setattr__(self, "direction", check_direction(self.direction, "light direction"))
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
        object.__setattr__(self, "radius", check_number(self.radius, "light radius", 0))
        object.__setattr__(self, "angle", check_number(self.angle, "light angle", 0, WIDEST))
        if self.radius and self.position is None:
            raise ValueError("light radius is of a light with a position: a directional light has an angle")
        if self.angle and self.position is not None:
            raise ValueError("light angle is of a directional light: a light with a position has a radius")

    @property
    def is_spot(self) -> bool:
        """Return whether it is a spot light: it has a position and a direction."""
        return self.position is not None and self.direction is not None

    @property
    def is_soft(self) -> bool:
        """Return whether it is larger than a point."""
        return self.radius > 0 or self.angle > 0


def check_lights(light: Light | Sequence[Light] | None) -> tuple[Light, ...]:
    """One light, several, or the default one for None, as a tuple. Raises TypeError if one is not a Light."""
    given: Any = Light() if light is None else light
    items = items_of(given)
    lights = (given,) if items is None else tuple(items)
    for one in lights:
        if not isinstance(one, Light):
            got = shown(one)
            raise TypeError(f"light must be a Light or several of them, got {got}: try Light(position=(x, y, z))")
    return lights


def at_upper_left(light: Light, target_pose: NDArray[Any]) -> Light:
    """Return the light, in world axes: without place and direction, from the viewing camera's upper left."""
    if light.position is not None or light.direction is not None:
        return light
    x, y, z = target_pose[:3, :3] @ UPPER_LEFT
    return replace(light, direction=(float(x), float(y), float(z)))


def transformed(light: Light, matrix: NDArray[Any]) -> Light:
    """Return the light after its place and its direction have moved by a (4, 4) matrix."""
    changes: dict[str, Any] = {}
    if light.position is not None:
        changes["position"] = tuple(matrix[:3, :3] @ light.position + matrix[:3, 3])
    if light.direction is not None:
        changes["direction"] = tuple(matrix[:3, :3] @ light.direction)
    return replace(light, **changes)


def light_rows(
    lights: Sequence[Light], axes: NDArray[Any], spans: Sequence[tuple[int, int] | None] | None = None
) -> NDArray[np.float32]:
    """Return lights as the shaders read them: (n, 5, 4) float32, in the axes of a camera with this pose (4, 4).

    lights       each with a position or a direction (see `at_upper_left`)
    spans        the number of each light's first shadow view and how many it has, None where it has none

    Texel by texel: position, or direction of travel, and whether it is a position; colour times intensity; attenuation;
    direction of a spot and its first shadow view; cosines of the cone and the number of views.
    """
    rows = np.zeros((len(lights), 5, 4))
    for row, light, span in zip(rows, lights, spans or [None] * len(lights), strict=True):
        if light.position is not None:
            row[0] = [*(axes[:3, :3].T @ (np.array(light.position) - axes[:3, 3])), 1]
        else:
            row[0, :3] = axes[:3, :3].T @ _shortened(light.direction)
        row[1, :3] = np.array(light.color) * light.intensity
        row[2, :3] = light.attenuation
        if light.is_spot:
            row[3, :3] = axes[:3, :3].T @ unit(light.direction)
            row[4, :2] = np.cos(np.radians(light.cone))
        row[3, 3], row[4, 2] = span or (-1, 0)
    return rows.astype(np.float32)


def unit(direction: Vector | NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return a direction (3,) with length 1. It may be as long or as short as numbers are."""
    array = np.array(direction, np.float64)
    array /= np.abs(array).max()
    return array / np.linalg.norm(array)


def _shortened(direction: Any) -> NDArray[np.float64]:
    """Return the direction, (3,), scaled by a power of two so that float32 holds it. Its digits stay the same."""
    array = np.array(direction, np.float64)
    return np.ldexp(array, -int(np.frexp(np.abs(array).max())[1]))
