"""How a picture is finished: how many samples are averaged, and what lies behind. Plain frozen values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .checks import check_color
from .color_names import linear_color
from .samples import check_samples
from .wording import option

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Finish:
    """What is made of the light that a picture shows.

    samples     how many pictures are averaged
    background  linear RGB, a name or "#rrggbb"; None or "transparent" is transparent

    Raises ValueError or TypeError for anything else.
    """

    samples: int = 1
    background: Color | None = None

    def __init__(self, samples: int = 1, background: str | Sequence[float] | None = None):
        object.__setattr__(self, "samples", check_samples(samples))
        object.__setattr__(self, "background", _check_background(background))


def _check_background(background: str | Sequence[float] | None) -> Color | None:
    if background is None or background == "transparent":
        return None
    if not isinstance(background, str):
        return check_color(background, option("background"))
    try:
        return linear_color(background)
    except ValueError as error:
        raise ValueError(f"{option('background')}: {error}") from None


SIMPLE = Finish()
