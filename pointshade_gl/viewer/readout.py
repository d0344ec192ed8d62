"""What the lower edge of the window tells of the surface: what its colours stand for, and values under the mouse."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ..files.depth.depth_files import ramp
from ..scene.frame import Frame
from ..scene.values import BLUE, ColorScale
from .messages import BACKDROP, BRIGHT, POINTS
from .picture import Picture

NOTHING = "no surface here"
BETWEEN = "   "
RAMP = 120.0  # width of the colours, pixels at scale 1


def values_of(picture: Picture, column: int, row: int, surface: NDArray[np.float32] | None) -> tuple[str, ...]:
    """Return where a pixel's surface lies in the world, how far away, which way it faces; of a frame also its pixel.

    surface  as of `Renderer.read_surface`
    """
    if surface is None:
        return (NOTHING,)
    camera, pose, shown = picture.camera, picture.pose, picture.shown
    normal, depth = pose[:3, :3] @ surface[:3], float(surface[3])
    x, y, z = point = camera.unproject(np.float64(depth), np.array([column, row], float), pose=pose)
    parts = [f"x {x:.3f}  y {y:.3f}  z {z:.3f} m", f"depth {depth:.3f} m"]
    if normal.any():
        parts.append("normal {:.2f} {:.2f} {:.2f}".format(*(normal + 0.0)))
    if isinstance(shown, Frame):
        u, v = np.rint(shown.camera.project(point, pose=shown.pose)).astype(int).tolist()
        parts.append(f"pixel {u}, {v}")
    return tuple(parts)


def legend(scale: ColorScale | None) -> tuple[str, str, str] | None:
    """Return what stands before, on and after the colours of a scale; None where they have no range."""
    if scale is None or scale.show == "normals":
        return None
    if scale.show == "depth":
        return f"depth {scale.low:.3f} m", f"{scale.middle:.2f}", f"{scale.high:.3f} m"
    return f"normals off by {scale.low:.0f}°", f"{scale.middle:.0f}°", f"{scale.high:.0f}°+"


def draw_readout(
    ends: tuple[str, str, str] | None, values: tuple[str, ...], scale: float, width: int
) -> NDArray[np.uint8]:
    """Draw the colours of a scale between its ends, and values below, in lines of this width: (h, w, 4) uint8."""
    font, pad, line = ImageFont.load_default(0.95 * POINTS * scale), round(7 * scale), round(1.3 * POINTS * scale)
    lines = _in_lines(values, font, width - 2 * pad)
    wide = max([font.getlength(one) for one in lines], default=0.0)
    first = font.getlength(ends[0]) + pad if ends else 0.0
    if ends:
        wide = max(wide, first + RAMP * scale + pad + font.getlength(ends[2]))
    rows = len(lines) + (ends is not None)
    image = Image.new("RGBA", (max(min(round(wide) + 2 * pad, width), 1), rows * line + pad), BACKDROP)
    draw = ImageDraw.Draw(image)
    if ends:
        left, middle = round(pad + first), (pad + line) / 2
        box = round(RAMP * scale), round(0.7 * POINTS * scale)
        image.paste(
            Image.fromarray(ramp("turbo")[None, round(255 * BLUE) :]).resize(box), (left, round(middle - box[1] / 2))
        )
        draw.text((pad, middle), ends[0], BRIGHT, font, anchor="lm")
        small = ImageFont.load_default(0.75 * POINTS * scale)
        draw.text((left + box[0] / 2, middle), ends[1], BACKDROP[:3], small, anchor="mm")
        draw.text((left + box[0] + pad, middle), ends[2], BRIGHT, font, anchor="lm")
    for k, one in enumerate(lines, start=rows - len(lines)):
        draw.text((pad, (pad + line) / 2 + k * line), one, BRIGHT, font, anchor="lm")
    return np.asarray(image)


def _in_lines(values: tuple[str, ...], font: Any, width: float) -> list[str]:
    """The values side by side, as many in a line as it has room for."""
    lines: list[str] = []
    for value in values:
        longer = f"{lines[-1]}{BETWEEN}{value}" if lines else value
        if lines and font.getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(value)
    return lines
