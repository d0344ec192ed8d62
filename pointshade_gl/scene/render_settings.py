"""How a picture is finished: how many samples are averaged, and what lies behind and below. Plain frozen values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from ..messages.css_colors import linear_color
from ..messages.formatting import option
from ..messages.validation import LARGEST, check_color, check_direction, check_number
from .sample_pattern import check_samples

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Finish:
    """What is made of the light that a picture shows.

    samples     how many pictures are averaged
    background  linear RGB, a name or "#rrggbb"; None or "transparent" is transparent
    ground      whether a ground below the object shows shadows; or which way is up, (3,) world axes
    ground_height  of the ground along up, metres, from the world's origin; None finds it

    Raises ValueError or TypeError for anything else.
    """

    samples: int = 1
    background: Vector | None = None
    ground: bool | Vector = False
    ground_height: float | None = None

    def __init__(
        self,
        samples: int = 1,
        background: str | Sequence[float] | None = None,
        ground: bool | Sequence[float] = False,
        ground_height: float | None = None,
    ):
        object.__setattr__(self, "samples", check_samples(samples))
        object.__setattr__(self, "background", _check_background(background))
        object.__setattr__(self, "ground", _check_ground(ground))
        object.__setattr__(self, "ground_height", _check_height(ground_height, self.ground))

    @property
    def options(self) -> dict[str, Any]:
        """Those that are not the default, by name, as arguments of `Renderer.render`."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default}


def _check_background(background: str | Sequence[float] | None) -> Vector | None:
    if background is None:
        return None
    if not isinstance(background, str):
        return check_color(background, option("background"))
    if background == "transparent":
        return None
    try:
        return linear_color(background)
    except ValueError as error:
        raise ValueError(f"{option('background')}: {error}") from None


def _check_ground(ground: Any) -> bool | Vector:
    return ground if isinstance(ground, bool) else check_direction(ground, "ground")


def _check_height(height: Any, ground: bool | Vector) -> float | None:
    if height is None:
        return None
    if ground is False:
        raise ValueError(f"{option('ground_height')} is that of a ground: pass {option('ground', True)}, too")
    return check_number(height, option("ground_height"), -LARGEST, LARGEST)


SIMPLE = Finish()
