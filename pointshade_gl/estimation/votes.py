"""Averages what samples of like colour, near one another, say: on a grid over place and colour."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .light_pairs import Array, Index

CELLS = 0.3, 0.3, 0.02, 0.02  # standard deviations of place, in longer sides of the picture, and of chromaticity
MOST = 1200  # voters
REACH = 4  # cells that a blur looks at, on each side
OTHERS = 1e-3  # weight of all colours together, where none is alike


def ask(values: Array, voters: NDArray[np.bool_], red: Array, green: Array) -> tuple[Array, Array]:
    """Return, (h, w) each, mean and standard deviation of the values of voters, weighed by distance and colour.

    values      (h, w), read where there are voters, of whom there is at least one
    red, green  (h, w) of their sum with blue

    A bilateral grid (Chen, Paris, Durand 2007): all voters at the cost of a few.
    """
    spots = np.indices(values.shape, np.float32) / max(values.shape)
    places = np.stack([*spots, red, green]).reshape(4, -1) / np.array(CELLS, np.float32)[:, None]
    places -= np.floor(places.min(1, keepdims=True))
    shape = tuple((places.max(1).astype(int) + 2).tolist())
    chosen = np.flatnonzero(voters)
    chosen = chosen[:: -(-len(chosen) // MOST)]
    said = values.reshape(-1)[chosen]
    grid = _gathered(places[:, chosen], np.stack([np.ones_like(said), said, said**2]), shape)
    for axis in range(1, 5):
        grid = _blurred(grid, axis)
    grid = grid.reshape(3, -1)
    grid += OTHERS * grid.mean(1, keepdims=True)
    weight, mean, square = _read(grid, places, shape)
    mean, square = mean / weight, square / weight
    deviation = np.sqrt(np.maximum(square - mean**2, 0))
    return mean.reshape(values.shape), deviation.reshape(values.shape)


def _gathered(places: Array, values: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, *shape) the sums of values (k, n) in the cells around their places (4, n)."""
    size, corners = int(np.prod(shape)), list(_corners(places, shape))
    index, weight = (np.concatenate(parts) for parts in zip(*corners, strict=True))
    sums = [np.bincount(index, weight * np.tile(row, len(corners)), size) for row in values]
    return np.array(sums, np.float32).reshape(-1, *shape)


def _read(grid: Array, places: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, n) the values (k, cells) of a grid between its cells."""
    found = np.zeros((len(grid), places.shape[1]), np.float32)
    for index, weight in _corners(places, shape):
        for sums, row in zip(found, grid, strict=True):
            sums += weight * row.take(index)
    return found


def _corners(places: Array, shape: tuple[int, ...]) -> Iterator[tuple[Index, Array]]:
    """Yield the flat index and the weight of each of the 16 cells around each place."""
    low = places.astype(int)
    shares = np.stack([1 - (places - low), places - low]).astype(np.float32)
    steps = np.array([int(np.prod(shape[k + 1 :])) for k in range(len(shape))])
    first = steps @ low
    sides = [(0, 0), (0, 1), (1, 0), (1, 1)]
    near, alike = ({(a, b): shares[a, k] * shares[b, k + 1] for a, b in sides} for k in (0, 2))
    for one, other in product(sides, sides):
        yield first + int(steps @ (*one, *other)), near[one] * alike[other]


def _blurred(grid: Array, axis: int) -> Array:
    """Blur a grid along an axis by a Gaussian of one cell, less what gathering and reading between cells blur."""
    grid = np.moveaxis(grid, axis, 0)
    blurred = grid.copy()
    for off in range(1, min(len(grid), REACH + 1)):
        weight = np.float32(np.exp(-0.5 * off**2 / (1 - 1 / 3)))
        blurred[off:] += weight * grid[:-off]
        blurred[:-off] += weight * grid[off:]
    return np.moveaxis(blurred, 0, axis)
