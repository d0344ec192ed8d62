"""How strong a light is, in the units of Blender, glTF and photographs, and how its light falls off with distance."""

from __future__ import annotations

import math
from typing import Literal, get_args

from ..checks.arguments import check_choice, check_number, check_numbers
from ..checks.foreign_arrays import Numbers
from ..notes.words import shown

Falloff = Literal["none", "inverse-square"]
FALLOFFS = dict(zip(get_args(Falloff), ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), strict=True))  # as attenuation
LUX = 1 / math.pi  # intensity of a lux or a candela: a white matt surface under pi lux is white


def intensity_of(strengths: dict[str, float | None], has_position: bool, is_area: bool) -> float:
    """Return the intensity of a light of which one of several strengths was said, or none."""
    said = {name: value for name, value in strengths.items() if value is not None}
    if len(said) > 1:
        raise ValueError(
            f"light takes one of {', '.join(strengths)}, got {' and '.join(said)}: pass None for the others"
        )
    ((name, value),) = said.items() or [("intensity", 1.0)]
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
