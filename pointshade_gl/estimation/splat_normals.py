"""Normals of trained splats: of the surface on which many of them lie, as single ones lie at any angle to it."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..scene.gaussians import Gaussians
from .cloud_estimates import outward

CELL = 2.2  # times the median of the longest deviations is a cell wide
LEAST = 0.05  # opacity: fainter ones are fog
_EDGE = 1 << 20  # cells along a side, at most
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def splat_normals(
    positions: NDArray[np.floating], held: Gaussians, up: NDArray[np.float64], wide: float = CELL
) -> NDArray[np.float32]:
    """Return (n, 3) unit, outward: across which the splats of a cell and those round it are spread least.

    wide  cells in median lengths
    """
    count, side = len(positions), wide * held.median_length
    if not count or side <= 0:
        return np.zeros((count, 3), np.float32)
    low = positions.min(0)
    side = max(side, float(np.ptp(positions, 0).max()) / _EDGE)
    places = ((positions - low) / side).astype(np.int64) + 1
    steps = np.array([1, *np.cumprod(places.max(0)[:2] + 2)], np.int64)
    keys = places @ steps
    cells, cell = np.unique(keys, return_inverse=True)
    sums = _moments((positions - low).astype(np.float64), held, cell, len(cells))
    around = _with_neighbours(cells, sums, steps)
    middle = around[1:4] / around[0]
    spread = np.empty((len(cells), 3, 3))
    for k, (i, j) in enumerate(_PAIRS):
        spread[:, i, j] = spread[:, j, i] = around[4 + k] / around[0] - middle[i] * middle[j]
    flat = np.linalg.eigh(spread)[1][:, :, 0].astype(np.float32)
    own = (sums[1:4] / sums[0]).T.astype(np.float32)
    return outward(own, flat, up)[0][cell]


def _moments(local: NDArray[np.float64], held: Gaussians, cell: NDArray[np.integer], count: int) -> NDArray[np.float64]:
    """Return (10, cells): weight, its products with the places, and with their squares and the splats' own spread."""
    weight = held.opacities * (held.opacities > LEAST) + np.float32(1e-6)
    columns = [weight, *(weight * local[:, k] for k in range(3))]
    columns += [
        weight * (local[:, i] * local[:, j] + own) for (i, j), own in zip(_PAIRS, held.covariances, strict=True)
    ]
    return np.stack([np.bincount(cell, one, count) for one in columns]).astype(np.float64, copy=False)


def _with_neighbours(
    cells: NDArray[np.int64], sums: NDArray[np.float64], steps: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the sums with half of those of the cells beside, a quarter over edges and an eighth over corners."""
    found = np.zeros_like(sums)
    for step in product((-1, 0, 1), repeat=3):
        keys = cells + np.array(step) @ steps
        at = np.searchsorted(cells, keys).clip(0, len(cells) - 1)
        share = np.where(cells[at] == keys, 0.5 ** np.abs(step).sum(), 0.0)
        found += sums[:, at] * share
    return found
