"""Averages what samples of like colour, near one another, say: on a grid over place and colour."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .light_pairs import Array, Index

CELLS = 0.3, 0.3, 0.02, 0.02  # standard deviations of place, in longer sides of the picture, and of chromaticity
MOST = 1200  # voters
REACH = 2  # cells that a blur looks at, on each side
OTHERS = 1e-3  # weight of all colours together, where none is alike


def ask(
    values: Array, voters: NDArray[np.bool_], red: Array, green: Array, asked: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return, (h, w) each, mean and standard deviation of the values of voters, weighed by distance and colour.

    values      (h, w), read where there are voters, of whom there is at least one
    red, green  (h, w) of their sum with blue
    asked       (h, w) where to find them; elsewhere they are 0

    A bilateral grid (Chen, Paris, Durand 2007): all voters at the cost of a few.
    """
    spots = np.indices(values.shape, np.float32) / max(values.shape)
    places = np.stack([*spots, red, green]).reshape(4, -1) / np.array(CELLS, np.float32)[:, None]
    places -= np.floor(places.min(1, keepdims=True))
    shape = tuple((places.max(1).astype(int) + 2).tolist())
    chosen = np.flatnonzero(voters)
    chosen = chosen[:: -(-len(chosen) // MOST)]
    said = values.reshape(-1)[chosen]
    grid = _gathered(places.take(chosen, 1), np.stack([np.ones_like(said), said, said**2]), shape)
    for axis in range(1, 5):
        grid = _blurred(grid, axis)
    grid = grid.reshape(3, -1)
    grid += OTHERS * grid.mean(1, keepdims=True)
    wanted = np.flatnonzero(asked)
    weight, mean, square = _read(grid, places.take(wanted, 1), shape)
    mean, square = mean / weight, square / weight
    answer = np.zeros((2, values.size), np.float32)
    answer[:, wanted] = mean, np.sqrt(np.maximum(square - mean**2, 0))
    return answer[0].reshape(values.shape), answer[1].reshape(values.shape)


def _gathered(places: Array, values: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, *shape) the sums of values (k, n) in the cells around their places (4, n)."""
    size, corners = int(np.prod(shape)), list(_corners(places, shape))
    index, weight = (np.concatenate(parts) for parts in zip(*corners, strict=True))
    sums = [np.bincount(index, weight * np.tile(row, len(corners)), size) for row in values]
    return np.array(sums, np.float32).reshape(-1, *shape)


def _read(grid: Array, places: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, n) the values (k, cells) of a grid between its cells."""
    found = np.zeros((len(grid), places.shape[1]), np.float32)
    part = np.empty_like(found[0])
    for index, weight in _corners(places, shape):
        for sums, row in zip(found, grid, strict=True):
            row.take(index, out=part, mode="clip")
            part *= weight
            sums += part
    return found


def _corners(places: Array, shape: tuple[int, ...]) -> Iterator[tuple[Index, Array]]:
    """Yield the flat index and the weight of each of the 9 cells around each place: the corners of a triangle of cells,
    once for both coordinates in the picture and once for both of colour."""
    low = places.astype(int)
    shares = places - low.astype(np.float32)
    steps = [int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
    first = np.array(steps) @ low
    near, alike = (_triangle(*shares[k : k + 2], *steps[k : k + 2]) for k in (0, 2))
    for step, weight in near:
        corner = first + step
        for other_step, other_weight in alike:
            yield corner + other_step, weight * other_weight


def _triangle(one: Array, other: Array, step: int, other_step: int) -> list[tuple[Index | int, Array]]:
    """Return the steps from the lowest corner of a square to those of the triangle around a place in it, and their
    weights."""
    least, most = np.minimum(one, other), np.maximum(one, other)
    return [(0, 1 - most), (np.where(one > other, step, other_step), most - least), (step + other_step, least)]


def _blurred(grid: Array, axis: int) -> Array:
    """Blur a grid along an axis by a Gaussian of one cell, less what gathering and reading between cells blur."""
    grid = np.moveaxis(grid, axis, 0)
    blurred = grid.copy()
    for off in range(1, min(len(grid), REACH + 1)):
        weight = np.float32(np.exp(-0.5 * off**2 / (1 - 1 / 3)))
        blurred[off:] += weight * grid[:-off]
        blurred[:-off] += weight * grid[off:]
    return np.moveaxis(blurred, 0, axis)
