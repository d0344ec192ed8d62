"""Converts colour-mapped pictures of depth back to values: which colour map, and each pixel's place on it.

The demos of Depth Anything and MiDaS write nothing else. The tables are Matplotlib's (its colour maps are CC0 or BSD;
turbo by A. Mikhailov 2019), one row a map in assets/colormaps.png.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..access.builtin import asset
from ..pictures.picture_files import read_image
from .missing_depth import blocks

MAPS = {  # in the order of the rows, each with the colour of its upper end
    "Spectral_r": "red",
    "inferno": "pale yellow",
    "magma": "pale yellow",
    "viridis": "yellow",
    "plasma": "yellow",
    "turbo": "red",
    "jet": "red",
}
_SAMPLE = 4096  # pixels that decide which map it is
_NEAR = 24.0  # steps of 8 bits, red, green and blue together: so far JPEG moves a colour off its map
_COLOURFUL = 40  # between the largest and the smallest of red, green and blue: greys fit several maps
_FITS, _LONG = 0.9, 64  # the share of colourful pixels on the map, and how many of its 256 steps they use
_CALM = 12  # steps between neighbours, in the middle: a photograph whose colours fit jumps on the map


class Levels(NamedTuple):
    """What a colour-mapped picture says: (h, w) float32, 0 to 255 along the map, NaN where the colour is not on it."""

    name: str
    values: NDArray[np.float32]


def read_levels(image: NDArray[np.uint8]) -> Levels | None:
    """The levels of a picture (h, w, 3|4), None if its colours lie on no known map. Transparent pixels are holes."""
    index = _find_map(image)
    if index is None:
        return None
    entries = _tables()[index]
    place = np.zeros(256**3, np.float32)  # of each colour met so far, and 1 more; pages are real once written
    values = np.empty(image.shape[:2], np.float32)
    for rows in blocks(values):
        codes = image[rows][..., :3].astype(np.uint32) @ np.array((65536, 256, 1), np.uint32)  # one number a colour
        met = np.unique(codes)
        new = met[place[met] == 0]
        place[new] = _places(np.stack([new >> 16, new >> 8 & 255, new & 255], axis=1), entries) + 1
        values[rows] = place[codes] - 1
        if image.shape[2] == 4:
            values[rows][image[rows][..., 3] == 0] = np.nan
    return Levels(list(MAPS)[index], values)


def ramp(name: str) -> NDArray[np.uint8]:
    """(256, 3) red, green and blue of a map of MAPS, from its lower end to its upper one."""
    return _tables()[list(MAPS).index(name)].astype(np.uint8)


def _find_map(image: NDArray[np.uint8]) -> int | None:
    """The map on which nearly all colours of a sample lie."""
    step = max(1, int(np.sqrt(image.shape[0] * image.shape[1] / _SAMPLE)))
    sample = image[step // 2 :: step, step // 2 :: step]
    if image.shape[2] == 4:
        sample = sample[sample[..., 3] > 0]
    colors = sample[..., :3].reshape(-1, 3)
    colors = colors[np.ptp(colors, axis=1) > _COLOURFUL]
    if 5 * len(colors) < sample[..., 0].size or not len(colors):
        return None
    off = [np.sqrt(_squared(colors, entries).min(axis=1)) for entries in _tables()]
    best = int(np.argmin([np.minimum(one, 2 * _NEAR).mean() for one in off]))
    near = off[best] < _NEAR
    if near.mean() < _FITS:
        return None
    low, high = np.quantile(_places(colors[near], _tables()[best]), (0.02, 0.98))
    return best if high - low >= _LONG and _is_calm(image, _tables()[best]) else None


def _is_calm(image: NDArray[np.uint8], entries: NDArray[np.float32]) -> bool:
    """Whether neighbours lie near each other on the map, along some rows."""
    rows = image[:: max(1, image.shape[0] // 8), :1024, :3]
    steps = np.abs(np.diff(_places(rows.reshape(-1, 3), entries).reshape(rows.shape[:2]), axis=1))
    return bool(np.isfinite(steps).any() and np.nanquantile(steps, 0.75) < _CALM)


def _places(colors: NDArray[Any], entries: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n,) 0 to 255: the nearest entry of the map to each colour (n, 3), NaN where none is near."""
    result = np.empty(len(colors), np.float32)
    for start in range(0, len(colors), _SAMPLE):
        squared = _squared(colors[start : start + _SAMPLE], entries)
        nearest = squared.argmin(axis=1)
        near = np.take_along_axis(squared, nearest[:, None], axis=1)[:, 0] < _NEAR**2
        result[start : start + _SAMPLE] = np.where(near, nearest, np.nan)
    return result


def _squared(colors: NDArray[Any], entries: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 256) squared distances; whole numbers below 2^24, so float32 holds them exactly."""
    colors = colors.astype(np.float32)
    return np.square(colors).sum(axis=1)[:, None] + np.square(entries).sum(axis=1) - 2 * colors @ entries.T


@cache
def _tables() -> NDArray[np.float32]:
    """(maps, 256, 3) red, green and blue from 0 to 255."""
    return read_image(asset("colormaps.png")).astype(np.float32)
