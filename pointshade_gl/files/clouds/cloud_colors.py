"""The colours (n, 3) uint8 of a cloud: its own, or grey by intensity, or by class or height."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.words import option
from ...scene.cloud import Up
from ...scene.values import linear_to_bytes
from ..depth.colormaps import ramp
from .found_points import COLOR_BY, ColorBy, FoundPoints
from .placing import main_box

_ENDS = 0.02, 0.98  # quantiles of the intensity that become the darkest grey and white
DARKEST = 0.05  # linear: what is black answers no light
_SAMPLE = 1 << 16
_OTHER = (150, 150, 150)
_CLASSES = {  # of ASPRS, LAS 1.4
    2: (160, 120, 80), 3: (150, 190, 90), 4: (100, 165, 70), 5: (45, 120, 50), 6: (205, 85, 65), 7: (230, 60, 200),
    8: (230, 170, 60), 9: (60, 120, 215), 10: (120, 80, 160), 11: (95, 95, 105), 13: (240, 220, 90),
    14: (240, 200, 40), 15: (200, 140, 220), 16: (250, 230, 130), 17: (190, 190, 215), 18: (250, 30, 60),
}  # fmt: skip


def colors_of(found: FoundPoints, color_by: ColorBy | None, up: Up, name: str) -> NDArray[np.uint8] | None:
    """The colours, None for a cloud without any. Raises ValueError for a choice that the file does not have."""
    if color_by and color_by not in choices(found):
        raise ValueError(f"{name} has no {color_by} for {option('color_by')}, only {', '.join(choices(found))}")
    if color_by == "height":
        return _by_height(found.positions, up)
    if color_by == "class":
        return _table()[np.asarray(found.classes).astype(np.int64).clip(0, 255)]
    if color_by == "intensity":
        return _grey(np.asarray(found.intensity))
    if found.colors is None:
        return None if found.intensity is None or _is_uniform(found.intensity) else _grey(found.intensity)
    return _bytes(found.colors)


def choices(found: FoundPoints) -> list[ColorBy]:
    """What a file's points can be coloured by."""
    columns = {"rgb": found.colors, "intensity": found.intensity, "class": found.classes, "height": found.positions}
    return [one for one in COLOR_BY if columns[one] is not None]


def _is_uniform(intensity: NDArray[Any]) -> bool:
    """Whether most points have the least or the largest intensity, which tells nothing about the surface."""
    low, middle, high = np.nan_to_num(np.quantile(_some(intensity), (_ENDS[0], 0.5, _ENDS[1])))
    return bool(middle in (low, high))


def _some(values: NDArray[Any]) -> NDArray[Any]:
    return values[:: -(-len(values) // _SAMPLE)] if len(values) else np.zeros(1)


def _bytes(colors: NDArray[Any]) -> NDArray[np.uint8]:
    """Colours of 8 bits, of 16 bits, of 0 to 1 or of 0 to 255: the largest value says which."""
    if colors.dtype == np.uint8 or not colors.size:
        return colors.astype(np.uint8, copy=False)
    largest = np.nanmax(colors)
    if colors.dtype.kind == "f":
        scale = 255.0 if largest <= 1 else 1.0 if largest <= 255 else 1 / 257
    else:
        scale = 1.0 if largest <= 255 else 1 / 257
    return np.rint(np.nan_to_num(colors.astype(np.float32) * np.float32(scale)).clip(0, 255)).astype(np.uint8)


def _grey(intensity: NDArray[Any]) -> NDArray[np.uint8]:
    values = np.nan_to_num(intensity.astype(np.float32), posinf=0, neginf=0)
    if not values.size:
        return np.empty((0, 3), np.uint8)
    low, high = np.quantile(_some(values), _ENDS)
    share = ((values - np.float32(low)) / np.float32(high - low if high > low else 1.0)).clip(0, 1)
    table = linear_to_bytes(DARKEST + (1 - DARKEST) * np.arange(256) / 255)  # reflected light is linear
    return np.repeat(table[np.rint(255 * share).astype(np.uint8)][:, None], 3, 1)


def _by_height(positions: NDArray[Any], up: Up) -> NDArray[np.uint8]:
    """From the lowest point, dark blue, to the highest, yellow; stray points have the colours of the ends."""
    axis = "xyz".index(up[-1])
    if not len(positions):
        return np.empty((0, 3), np.uint8)
    low, high = (corner[axis] for corner in main_box(positions))
    share = (positions[:, axis] - low) / ((high - low) or 1.0)
    share = 1 - share if up[0] == "-" else share
    return ramp("viridis")[(share * 255).clip(0, 255).astype(np.uint8)]


def _table() -> NDArray[np.uint8]:
    table = np.full((256, 3), _OTHER, np.uint8)
    table[[*_CLASSES]] = [*_CLASSES.values()]
    return table
