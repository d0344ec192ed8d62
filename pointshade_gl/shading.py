"""Light, material and splat options: plain values, checked once. Their formulas are in shaders/common."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import check_point

SHADINGS = ("none", "flat", "gouraud", "phong")
SPLATS = ("footprint", "round")
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A point light at `position`, or a directional one that shines along `direction`; world axes.

    color, intensity   linear RGB and a factor on it
    attenuation        (kc, kl, kq): a point light at distance d is divided by kc + kl*d + kq*d*d

    With neither position nor direction the light sits at the viewing camera's upper left, far away.
    Raises ValueError when both are given, or for numbers that are no light.
    """

    position: Vector | None = None
    direction: Vector | None = None
    color: Vector = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    attenuation: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.position is not None and self.direction is not None:
            raise ValueError("a light has a position or a direction, not both")
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


def _check_number(value: float, name: str, low: float, high: float) -> None:
    if not (low <= value <= high and math.isfinite(value)):  # NaN fails the first test
        raise ValueError(f"{name} must be a number from {low:g} to {high:g}, got {value}")


def check_choice(name: str, value: str, known: tuple[str, ...]) -> None:
    """Raises ValueError, listing the known ones, for a name that is none of them."""
    if value not in known:
        raise ValueError(f"unknown {name} {value!r}: known are {', '.join(known)}")


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
