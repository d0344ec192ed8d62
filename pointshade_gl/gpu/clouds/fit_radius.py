"""Chooses within which radius the planes of a point cloud are fitted: by the spacing, and wider by the noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...estimation.cloud_noise import surface_residual
from .cell_grid import CellGrid

LEAST = 2.7  # spacings: about 20 neighbours
WIDEST = 14.0
CALM = 180  # R² = 80 x noise x spacing: the mean error of a normal is 140 degrees x noise x spacing / R²
BLOB = 0.15  # radii: where the noise is more, this is no surface but foliage, and a larger radius does not help
ASKED = 384  # places where the noise is measured
SEEN = 80  # neighbours of each
STEP = 1.6


def fit_radius(grid: CellGrid, points: NDArray[np.float32], spacing: float, noise: float | None) -> tuple[float, float]:
    """Return the radius, and the noise: as given, or as measured within that radius.

    grid  of cells about as large as the least radius
    """
    if noise is not None:
        return radius_for(noise, spacing), noise
    asked = np.random.default_rng(0).choice(len(points), min(ASKED, len(points)), replace=False)
    radius = LEAST * spacing
    while radius <= WIDEST * spacing:
        noise = radius * surface_residual(*neighbours(grid, points, asked, radius))
        if noise <= BLOB * radius:
            return radius_for(noise, spacing), noise
        radius *= STEP
    return LEAST * spacing, 0.0


def radius_for(noise: float, spacing: float) -> float:
    return spacing * float(np.clip(np.sqrt(CALM * noise / spacing), LEAST, WIDEST))


def neighbours(
    grid: CellGrid, points: NDArray[np.float32], asked: NDArray[np.integer], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return (m, SEEN, 3) offsets to neighbours of points within a radius, radii, and which of these there are."""
    here = points[asked, :3].astype(np.float64)
    keys = grid.keys_of(points[asked])
    ranges = grid.ranges(keys, int(np.ceil(radius / grid.side))).reshape(-1, 2)
    owner = np.repeat(np.arange(len(asked)), len(ranges) // len(asked))
    length = ranges[:, 1] - ranges[:, 0]
    first = np.cumsum(length) - length
    places = np.arange(length.sum()) + np.repeat(ranges[:, 0] - first, length)
    owner = np.repeat(owner, length)
    offsets = (points[places, :3] - here[owner]) / radius
    inside = np.einsum("ni,ni->n", offsets, offsets) < 1
    owner, offsets = owner[inside], offsets[inside]
    count = np.bincount(owner, minlength=len(asked))
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = np.minimum(SEEN / np.maximum(count, 1), 1)[owner]
    slot = (rank * share).astype(int)
    taken = slot > ((rank - 1) * share).astype(int)
    taken |= rank == 0
    found, known = np.zeros((len(asked), SEEN, 3)), np.zeros((len(asked), SEEN), bool)
    found[owner[taken], slot[taken]] = offsets[taken]
    known[owner[taken], slot[taken]] = True
    return found, known
