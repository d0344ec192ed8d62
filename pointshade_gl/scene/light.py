"""Point, directional, spot and area lights, checked when they are made, and packed into the rows that shaders read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import (
    ABOVE_0,
    check_choice,
    check_color,
    check_direction,
    check_flag,
    check_number,
    check_numbers,
    check_point,
    items_of,
)
from ..checks.foreign_arrays import Numbers
from ..notes.words import shown

Falloff = Literal["none", "inverse-square"]
FALLOFFS = dict(zip(get_args(Falloff), ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), strict=True))  # as attenuation
LUX = 1 / math.pi  # intensity of a lux or a candela: a white matt surface under pi lux is white


def intensity_of(strengths: dict[str, float | None], has_position: bool, is_area: bool) -> float:
    """Return the intensity of a light of which one of several strengths was said, or none."""
    stated = {name: value for name, value in strengths.items() if value is not None}
    if len(stated) > 1:
        got = " and ".join(stated)
        raise ValueError(f"light takes one of {', '.join(strengths)}, got {got}: pass None for the others")
    ((name, value),) = stated.items() or [("intensity", 1.0)]
    number = check_number(value, f"light {name}", 0)
    if name in ("watts", "candela") and not has_position:
        raise ValueError(f"light {name} is of a light with a position: a directional light has lux")
    if name == "lux" and has_position:
        raise ValueError("light lux is of a directional light: a light with a position has watts or candela")
    watt = LUX / math.pi if is_area else LUX / (4 * math.pi)
    return number * {"intensity": 1.0, "watts": watt}.get(name, LUX)


def attenuation_of(
    attenuation: Numbers | None, falloff: Falloff | None, otherwise: Falloff
) -> tuple[float, float, float]:
    """Return the attenuation of a light that has one of two words for it, unless it is said."""
    if falloff is not None:
        check_choice("light falloff", falloff, tuple(FALLOFFS))
    if attenuation is None:
        return FALLOFFS[falloff or otherwise]
    if falloff is not None:
        raise ValueError("light falloff is a word for attenuation: leave out one of them")
    complaint = "light attenuation must be three numbers, 0 or above and not all 0"
    constant, linear, quadratic = check_numbers(attenuation, 3, complaint, low=0)
    if not any((constant, linear, quadratic)):
        raise ValueError(f"{complaint}, got {shown(attenuation)}")
    return constant, linear, quadratic


UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes
WIDEST = 120.0  # degrees of a directional light
Vector = tuple[float, float, float]


@dataclass(frozen=True, init=False)
class Light:
    """A point light at `position`, a directional light along `direction`, or a spot light with both; world axes.

    With neither position nor direction, the light is far away at the viewing camera's upper left. With both and a size,
    it is an area light.

    Parameters
    ----------
    position : (3,) float, optional
        Where the light is.
    direction : (3,) float, optional
        Which way the light travels, of any length.
    color : (3,) float
        Linear RGB.
    intensity : float, optional
        Factor on the colour: 1 makes a white matt surface white that faces a light without falloff, or one with
        inverse-square falloff at a distance of 1. 1 unless one of watts, candela and lux says it.
    attenuation : (3,) float, optional
        (kc, kl, kq): at distance d, a light with a position is divided by kc + kl*d + kq*d*d. (1, 0, 0) unless falloff,
        watts or candela says it.
    cone : (2,) float
        Inner and outer half angle of a spot light in degrees: full light inside, none outside.
    shadow : bool
        Whether objects in its way cast a shadow.
    radius : float
        Only with a position: radius of a glowing ball, world units (metres).
    angle : float
        Only of a directional light: size of its disc in the sky, full angle in degrees up to 120; the sun has 0.53.
    size : (2,) float, optional
        Only with a position and a direction: width and height of an area light, a matt glowing rectangle, world units.
        It shines from its front only. Its width is level: at right angles to the world's y axis, and along x if the
        light shines along y.
    watts : float, optional
        Power of a light with a position as Blender counts it, with inverse-square falloff: an intensity of
        watts / (4 pi^2), of an area light watts / pi^2.
    candela : float, optional
        Luminous intensity of a light with a position, as in glTF, with inverse-square falloff: an intensity of
        candela / pi.
    lux : float, optional
        Illuminance by a directional light, as in glTF, or W/m2, as the strength of Blender's sun: an intensity of
        lux / pi.
    falloff : {"none", "inverse-square"}, optional
        A word for attenuation (1, 0, 0) or (0, 0, 1).

    Raises
    ------
    ValueError
        For impossible values, and for several of intensity, watts, candela and lux, or of attenuation and falloff.
    TypeError
        For values of another kind.

    Notes
    -----
    The shadows of a light with a radius, an angle or a size are soft. A single sample estimates them from the light's
    middle (percentage closer soft shadows: Fernando 2005); more samples shine from other places of the light, and the
    shadows become exact.

    Watts, candela, lux and falloff are ways to say intensity and attenuation, which are what a light keeps.
    """

    position: Vector | None
    direction: Vector | None
    color: Vector
    intensity: float
    attenuation: Vector
    cone: tuple[float, float]
    shadow: bool
    radius: float
    angle: float
    size: tuple[float, float] | None

    def __init__(
        self, position: Numbers | None = None, direction: Numbers | None = None, color: Numbers = (1.0, 1.0, 1.0),
        intensity: float | None = None, attenuation: Numbers | None = None, cone: Numbers = (0.0, 45.0),
        shadow: bool = False, radius: float = 0.0, angle: float = 0.0, size: Numbers | None = None, *,
        watts: float | None = None, candela: float | None = None, lux: float | None = None,
        falloff: Falloff | None = None
    ) -> None:  # fmt: skip
        strengths = {"intensity": intensity, "watts": watts, "candela": candela, "lux": lux}
        is_real = watts is not None or candela is not None
        vars(self).update(
            position=None if position is None else check_point(position, "light position"),
            direction=None if direction is None else check_direction(direction, "light direction"),
            color=check_color(color, "light color"),
            attenuation=attenuation_of(attenuation, falloff, "inverse-square" if is_real else "none"),
            cone=_cone(cone),
            shadow=check_flag(shadow, "light shadow"),
            radius=check_number(radius, "light radius", 0),
            angle=check_number(angle, "light angle", 0, WIDEST),
            size=None if size is None else _size(size),
        )
        if self.radius and self.position is None:
            raise ValueError("light radius is of a light with a position: a directional light has an angle")
        if self.angle and self.position is not None:
            raise ValueError("light angle is of a directional light: a light with a position has a radius")
        if self.size and (self.position is None or self.direction is None):
            raise ValueError("light size is of a light with a position and a direction in which it shines")
        if self.size and self.radius:
            raise ValueError("light size is of a rectangle, radius of a ball: leave out one of them")
        vars(self).update(intensity=intensity_of(strengths, self.position is not None, self.size is not None))

    @property
    def is_spot(self) -> bool:
        """Return whether it is a spot light; it has a position and a direction, and no size."""
        return self.position is not None and self.direction is not None and self.size is None

    @property
    def is_area(self) -> bool:
        """Return whether it is an area light; it has a size."""
        return self.size is not None

    @property
    def is_soft(self) -> bool:
        """Return whether it is larger than a point."""
        return self.radius > 0 or self.angle > 0 or self.is_area


def _cone(cone: Numbers) -> tuple[float, float]:
    complaint = "light cone must be two half angles, 0 <= inner <= outer <= 90 degrees"
    inner, outer = check_numbers(cone, 2, complaint)
    if not 0 <= inner <= outer <= 90 or outer == 0:
        raise ValueError(f"{complaint}, got {shown(cone)}")
    return inner, outer


def _size(size: Numbers) -> tuple[float, float]:
    width, height = check_numbers(size, 2, "light size must be a width and a height above 0", ABOVE_0)
    return width, height


def check_lights(light: Light | Sequence[Light] | None) -> tuple[Light, ...]:
    """One light, several, or the default one for None, as a tuple. Raises TypeError if one is not a Light."""
    if type(light) is Light:
        return (light,)
    given: Any = Light() if light is None else light
    items = given if given.__class__ is tuple else items_of(given)
    lights: tuple[Any, ...] = (given,) if items is None else tuple(items)
    for one in lights:
        if type(one) is not Light and not isinstance(one, Light):
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
    direction of a spot or an area light and its first shadow view; cosines of the cone, the number of views, and 1 of
    an area light.
    """
    count = len(lights)
    rows = np.zeros((count, 5, 4))
    for row, light, span in zip(rows, lights, spans or [None] * count, strict=True):
        if light.position is not None:
            row[0] = [*(axes[:3, :3].T @ (np.array(light.position) - axes[:3, 3])), 1]
        else:
            row[0, :3] = axes[:3, :3].T @ _shortened(light.direction)
        row[1, :3] = np.array(light.color) * light.intensity
        row[2, :3] = light.attenuation
        is_area = light.size is not None
        if is_area or (light.position is not None and light.direction is not None):
            row[3, :3] = axes[:3, :3].T @ unit(light.direction)
            row[4, :2] = np.cos(np.radians(light.cone))
        row[3, 3], row[4, 2] = span or (-1, 0)
        row[4, 3] = is_area
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
