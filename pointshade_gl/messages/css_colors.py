"""Converts colours from CSS notation (a name such as tomato, or #rrggbb) to linear RGB."""

from __future__ import annotations

from .formatting import shown
from .suggestions import did_you_mean


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
    red, green, blue = (e / 12.92 if e <= 0.04045 else ((e + 0.055) / 1.055) ** 2.4 for e in (n / 255 for n in levels))
    return red, green, blue
