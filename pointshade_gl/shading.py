"""Light, material and splat options: plain values, checked once. Their formulas are in shaders/common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import check_point

SHADINGS = ("none", "flat", "gouraud", "phong")
SPLATS = ("footprint", "round")
MERGE = 1e-5  # of 1/z: nothing to see (`bench --speed` charts it), and all the speed on planes
WIDEST_SPOT = 70.0  # degrees; a wider spot casts its shadows as a point light does
UPPER_LEFT = (1.0, 1.0, 2.0)  # the default light's direction of travel, target axes
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A point light at `position`, a directional one that shines along `direction`, or with both a spot; world axes.

    color, intensity   linear RGB and a factor on it
    attenuation        (kc, kl, kq): a light with a position, at distance d, is divided by kc + kl*d + kq*d*d
    cone               (inner, outer) half angles of a spot in degrees: full light inside, none outside
    shadow             whether what stands in its way casts a shadow

    With neither position nor direction the light sits at the viewing camera's upper left, far away.
    Raises ValueError for numbers that are no light.
    """

    position: Vector | None = None
    direction: Vector | None = None
    color: Vector = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    attenuation: Vector = (1.0, 0.0, 0.0)
    cone: tuple[float, float] = (0.0, 45.0)
    shadow: bool = False

    def __post_init__(self) -> None:
        for name in ("position", "direction", "color", "attenuation"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, check_point(getattr(self, name), f"light {name}"))
        if self.direction is not None and not any(self.direction):
            raise ValueError("light direction must not be (0, 0, 0)")
        if min(self.color) < 0:
            raise ValueError(f"light color must not be negative, got {self.color}")
        if min(self.attenuation) < 0 or not any(self.attenuation):
            raise ValueError(f"light attenuation must be >= 0 and not all 0, got {self.attenuation}")
        _check_number(self.intensity, "light intensity", 0, math.inf)
        cone = np.asarray(self.cone, dtype=np.float64)
        if cone.shape != (2,) or not 0 <= cone[0] <= cone[1] <= 90 or cone[1] == 0:
            raise ValueError(f"light cone must be two half angles, 0 <= inner <= outer <= 90 degrees, got {self.cone}")
        object.__setattr__(self, "cone", (float(cone[0]), float(cone[1])))

    @property
    def is_spot(self) -> bool:
        return self.position is not None and self.direction is not None


@dataclass(frozen=True)
class Material:
    """How the surface answers light (Phong 1975): strengths of the three terms and the highlight's exponent."""

    ambient: float = 0.1
    diffuse: float = 0.9
    specular: float = 0.3
    shininess: float = 32.0

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            _check_number(getattr(self, name), f"material {name}", 0, math.inf)
        _check_number(self.shininess, "material shininess", 0.001, 10_000)

    @property
    def strengths(self) -> tuple[float, float, float, float]:
        """As the shaders take them."""
        return self.ambient, self.diffuse, self.specular, self.shininess


def _check_number(value: float, name: str, low: float, high: float) -> None:
    if not (low <= value <= high and math.isfinite(value)):  # NaN fails the first test
        raise ValueError(f"{name} must be a number from {low:g} to {high:g}, got {value}")


def check_choice(name: str, value: str, known: tuple[str, ...]) -> None:
    """Raises ValueError, listing the known ones, for a name that is none of them."""
    if value not in known:
        raise ValueError(f"unknown {name} {value!r}: known are {', '.join(known)}")


def check_merge(merge: float) -> float:
    """The tolerance of merged splats, a share of 1/z. Raises ValueError for what is none."""
    if not 0 <= merge <= 0.01:
        raise ValueError(f"merge must be a share of the inverse depth from 0 to 0.01, got {merge}")
    return float(merge)


def check_lights(light: Light | Sequence[Light] | None) -> list[Light]:
    """One light, several, or the default one for None, as a list. Raises TypeError for what is no light."""
    lights: list[Any] = [Light()] if light is None else [light] if isinstance(light, Light) else list(light)
    for one in lights:
        if not isinstance(one, Light):
            raise TypeError(f"light must be a Light or several of them, got {one!r}: try Light(position=(x, y, z))")
    return lights


def check_sizes(size: float | ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Splat sizes in source pixels as (1,) or (h*w,) float32; None is 1. Raises ValueError for what is no size."""
    sizes = np.atleast_1d(np.asarray(1.0 if size is None else size, dtype=np.float32))
    if sizes.shape not in ((1,), shape):
        raise ValueError(
            f"size is the splats' size in source pixels, one number or an array of {shape}, got {sizes.shape}"
        )
    if not (np.isfinite(sizes).all() and (sizes >= 0).all()):
        raise ValueError("size must be finite and not negative everywhere")
    return sizes.ravel()


def at_upper_left(light: Light, target_pose: NDArray[Any]) -> Light:
    """The light itself, but with a direction if it has no place: from the upper left of who looks, world axes."""
    if light.position is not None or light.direction is not None:
        return light
    x, y, z = target_pose[:3, :3] @ UPPER_LEFT
    return replace(light, direction=(float(x), float(y), float(z)))


def light_rows(lights: Sequence[Light], target_pose: NDArray[Any], axes: NDArray[Any]) -> NDArray[np.float32]:
    """Lights as shaders/common/lights.glsl reads them: (n, 3, 4) float32, in the axes of a camera with this pose.

    target_pose is who looks: the default light stands at her upper left.
    """
    rows = np.zeros((len(lights), 3, 4))
    for row, light in zip(rows, lights, strict=True):
        if light.position is not None:
            row[0] = [*(axes[:3, :3].T @ (np.array(light.position) - axes[:3, 3])), 1]
        else:
            row[0, :3] = axes[:3, :3].T @ np.array(at_upper_left(light, target_pose).direction)
        row[1, :3] = np.array(light.color) * light.intensity
        row[2, :3] = light.attenuation
    return rows.astype(np.float32)


def scene_light_rows(
    lights: Sequence[Light], target_pose: NDArray[Any], axes: NDArray[Any], first_views: Sequence[int | None]
) -> NDArray[np.float32]:
    """The same for shaders/common/scene_light.glsl: (n, 5, 4), with spots and the number of the first shadow view."""
    rows = np.zeros((len(lights), 5, 4), np.float32)
    rows[:, :3] = light_rows(lights, target_pose, axes)
    for row, light, first in zip(rows, lights, first_views, strict=True):
        if light.is_spot:
            direction = np.array(light.direction) / np.linalg.norm(np.array(light.direction))
            row[3, :3] = axes[:3, :3].T @ direction
            row[4, :2] = np.cos(np.radians(light.cone))
        row[3, 3] = -1 if first is None else first
        row[4, 2] = count_views(light)
    return rows


def count_views(light: Light) -> int:
    """How many pictures a light takes of a scene for its shadows: six in all directions, else one."""
    narrow = light.is_spot and light.cone[1] <= WIDEST_SPOT
    return 1 if light.position is None or narrow else 6
