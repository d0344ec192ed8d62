"""Finds pairs of pixels that show how an image is lit: of one colour, with different normals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Index = NDArray[np.int64]
LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)
PAIRS = 6000
TRIES = 12  # candidates for each pair
ALIKE = 0.97  # cosine between normals that light hardly tells apart
STEPS = 6  # places between two pixels that are looked at
BEND, MOST_BEND = 12.0, 32.0  # degrees by which a surface turns in a pixel, and from place to place: creases turn more
JUMP = 0.08  # share of the depth by which these places differ, of one surface
DARK = 0.004  # linear light that is mostly noise


class Pairs(NamedTuple):
    """n pairs of pixels: unit normals of both (n, 3); log ratio of their brightness and weight, (n,) each."""

    one: Array
    two: Array
    brighter: Array
    weight: Array


class Reach(NamedTuple):
    """Which pixels may be a pair.

    way        standard deviations of the way between them, from and to, shares of the picture's longer side
    hue        difference of chromaticity between two materials
    connected  whether they lie on one surface, all the way
    """

    way: tuple[float, float]
    hue: float
    connected: bool


# The straight line between the pixels of a pair stays on one surface: no texture follows the normals of a rounded
# surface all around, but differently painted walls look the same as lit ones.
CONNECTED = Reach((0.025, 0.15), 0.03, True)
WIDE = Reach((0.025, 0.3), 0.015, False)


def find_pairs(colors: Array, surfaces: Array, reach: Reach, seed: int = 0) -> Pairs:
    """Choose the pairs of pixels for `light_fit`, from the same arrays."""
    chance = np.random.default_rng(seed)
    height, width = colors.shape[:2]
    flat_surfaces, flat_colors = surfaces.reshape(-1, 4), colors.reshape(-1, 4)
    brightness = flat_colors[:, :3] @ LUMINANCE
    known = (flat_colors[:, 3] > 0) & (brightness > DARK)
    places = np.flatnonzero(known)
    if not len(places):
        empty = np.zeros(0, np.float32)
        return Pairs(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), empty, empty)
    first = places[chance.integers(0, len(places), TRIES * PAIRS)]
    far = np.exp(chance.uniform(np.log(reach.way[0]), np.log(reach.way[1]), len(first))) * max(width, height)
    way = np.rint(chance.normal(size=(2, len(first))) * far).astype(int)
    v, u = first // width, first % width
    inside = (v + way[0] >= 0) & (v + way[0] < height) & (u + way[1] >= 0) & (u + way[1] < width)
    first, second = first[inside], (first + way[0] * width + way[1])[inside]
    chosen = known[second]
    chosen &= (flat_surfaces[first, :3] * flat_surfaces[second, :3]).sum(-1) < ALIKE
    first, second = first[chosen], second[chosen]
    hue = flat_colors[:, :3] / np.maximum(flat_colors[:, :3].sum(-1, keepdims=True), 1e-6)
    weight = np.exp(-np.square(hue[first] - hue[second]).sum(-1) / reach.hue**2)
    chosen = np.flatnonzero(weight > 0.1)
    if reach.connected:
        chosen = chosen[_is_one_surface(flat_surfaces, first[chosen], second[chosen], width)]
    chosen = chosen[:PAIRS]
    first, second = first[chosen], second[chosen]
    brighter = np.log(brightness[first] / brightness[second])
    return Pairs(flat_surfaces[first, :3], flat_surfaces[second, :3], brighter, weight[chosen])


def _is_one_surface(surfaces: Array, first: Index, second: Index, width: int) -> NDArray[np.bool_]:
    """Return whether neither normal nor depth jumps on the straight line between two pixels."""
    v, u = first // width, first % width
    down, right = second // width - v, second % width - u
    before, same = surfaces[first], np.ones(len(first), bool)
    bend = np.cos(np.radians(np.minimum(BEND * np.maximum(np.hypot(down, right) / STEPS, 1), MOST_BEND)))
    for k in range(1, STEPS + 1):
        row, column = (np.rint(at + way * (k / STEPS)).astype(int) for at, way in ((v, down), (u, right)))
        here = surfaces[row * width + column]
        same &= (before[:, :3] * here[:, :3]).sum(-1) > bend
        same &= np.abs(here[:, 3] - before[:, 3]) < JUMP * before[:, 3]
        before = here
    return same
