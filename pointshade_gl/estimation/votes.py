"""Averages what samples of like colour, near one another, say: on a grid over place and colour."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from .light_pairs import Array

NEAR = 0.3  # of the picture's longer side: standard deviation
ALIKE = 0.02  # of chromaticity
CELLS = 0.15, 0.02  # of the grid: these are at most the standard deviations
OTHERS = 1e-3  # weight of all colours together, where none is alike


def ask(values: Array, voters: NDArray[np.bool_], chromaticity: Array) -> tuple[Array, Array]:
    """Return, (h, w) each, mean and standard deviation of the values of voters, weighed by distance and colour.

    values        (h, w), read where there are voters
    chromaticity  (h, w, 2) red and green of their sum with blue

    A bilateral grid (Chen, Paris, Durand 2007): all voters at the cost of a few.
    """
    height, width = values.shape
    spots = np.indices((height, width)).transpose(1, 2, 0) / (CELLS[0] * max(height, width))
    places = np.concatenate([spots, chromaticity / CELLS[1]], -1).reshape(-1, 4)
    places -= np.floor(places.min(0))
    shape = tuple(places.max(0).astype(int) + 2)
    says, votes = values.reshape(-1), voters.reshape(-1)
    grid = _gathered(places[votes], np.stack([np.ones(votes.sum()), says[votes], says[votes] ** 2], -1), shape)
    for axis, (deviation, cell) in enumerate(zip((NEAR, NEAR, ALIKE, ALIKE), np.repeat(CELLS, 2), strict=True)):
        grid = np.moveaxis(np.tensordot(_gaussian(shape[axis], deviation / cell), grid, (1, axis)), 0, axis)
    grid += OTHERS * grid.reshape(-1, 3).sum(0) / max(grid[..., 0].size, 1)
    weight, mean, square = _spread(grid, places).T
    mean, square = mean / np.maximum(weight, 1e-30), square / np.maximum(weight, 1e-30)
    deviation = np.sqrt(np.maximum(square - mean**2, 0))
    return mean.reshape(height, width), deviation.reshape(height, width)


def _gaussian(count: int, deviation: float) -> NDArray[np.float64]:
    """Return the weights between the cells of an axis; the grid itself blurs by a variance of 1/3 cells."""
    off = np.subtract.outer(np.arange(count), np.arange(count))
    return np.exp(-0.5 * off**2 / (deviation**2 - 1 / 3))


def _corners(places: Array, shape: tuple[int, ...]):
    """Yield the flat index and the weight of the 16 cells around each place."""
    low = places.astype(int)
    part = places - low
    steps = np.array([int(np.prod(shape[k + 1 :])) for k in range(len(shape))])
    first = low @ steps
    for corner in product((0, 1), repeat=len(shape)):
        weight = np.prod([part[:, k] if up else 1 - part[:, k] for k, up in enumerate(corner)], axis=0)
        yield first + int(steps @ corner), weight


def _gathered(places: Array, values: Array, shape: tuple[int, ...]) -> Array:
    size = int(np.prod(shape))
    grid = np.zeros((size, values.shape[1]))
    for index, weight in _corners(places, shape):
        for k in range(values.shape[1]):
            grid[:, k] += np.bincount(index, weight * values[:, k], size)
    return grid.reshape(*shape, values.shape[1])


def _spread(grid: Array, places: Array) -> Array:
    flat = grid.reshape(-1, grid.shape[-1])
    return sum(weight[:, None] * flat[index] for index, weight in _corners(places, grid.shape[:-1]))
