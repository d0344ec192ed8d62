"""Converts colours from CSS notation (a name such as tomato, or #rrggbb) to linear RGB."""

from __future__ import annotations

from ..notes.words import did_you_mean, shown
from .srgb import srgb_to_linear


def linear_color(name: str) -> tuple[float, float, float]:
    """Convert a colour as Pillow and CSS write it (#fc9, #ffcc99, tomato), which is sRGB (IEC 61966-2-1), to linear
    RGB.

    Raises ValueError with what is wrong, for a sentence about what has the colour.
    """
    from PIL import ImageColor

    try:
        levels = ImageColor.getrgb(name)
        if len(levels) > 3:
            raise ValueError("a colour has no alpha here")
    except ValueError:
        near = did_you_mean(name, ImageColor.colormap)
        known = "known are three numbers, #rrggbb and the names of CSS"
        raise ValueError(f"color {shown(name)} is unknown{near}: {known}") from None
    red, green, blue = (float(srgb_to_linear(level / 255)) for level in levels)
    return red, green, blue
