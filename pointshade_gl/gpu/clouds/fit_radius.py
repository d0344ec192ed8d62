"""Chooses within which radius the planes of a point cloud are fitted: by the spacing, and wider by the noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...estimation.cloud_estimates import surface_residuals
from .cell_grid import CellGrid

LEAST, WIDEST = 2.7, 14.0  # spacings: about 20 neighbours, about 600
CALM = 180.0  # radius² = 180 x noise x spacing: the mean error of a normal is 140 degrees x noise x spacing / radius²
SURE, UNSURE = 0.15, 0.2  # radii of noise: more, and a wider radius may tell it better; where none does, there is none
WIDER = 1.6
CALM_PLACE, BENT_PLACE = 0.35, 0.5  # share of the places with less: others have edges; or bend
BENT, NARROWER = 1.25, 1.2  # of what points lie off within the first radius: more, and a smaller one is taken
ASKED = 384  # places where the noise is measured
SEEN = 80  # neighbours of each
LOOKED_AT = 512  # points of a row of cells at most: of crowds each k-th
MOST = 64  # points of three cells in a row that are looked at; with a wider radius so many more


class FitRadius(NamedTuple):
    """Within which radius planes are fitted.

    length   of the first level; each further one is 1.6 times as wide
    spacing  of the points
    noise    its standard deviation
    """

    length: float
    spacing: float
    noise: float

    @property
    def most(self) -> int:
        """Return how many points of three cells in a row are looked at."""
        return int(MOST * (self.length / (LEAST * self.spacing)) ** 2)

    def of_level(self, level: int) -> float:
        return self.length * WIDER**level

    def noise_share(self, level: int) -> float:
        """Return the noise in radii of a level."""
        return self.noise / self.of_level(level)


def fit_radius(grid: CellGrid, points: NDArray[np.float32], spacing: float, noise: float | None) -> FitRadius:
    """Choose a radius by the noise that is given, or else measured.

    Where no radius tells the noise from a surface, as in foliage, there is no noise: a wide radius would not help.

    grid  of the points, its cells as large as the least radius
    """
    if noise is not None:
        return _by_noise(noise, spacing)
    asked = np.random.default_rng(0).choice(len(points), min(ASKED, len(points)), replace=False)

    def residuals(radius: float) -> tuple[float, float]:
        return tuple(radius * surface_residuals(*neighbours(grid, points, asked, radius), (CALM_PLACE, BENT_PLACE)))

    radius, found = LEAST * spacing, (UNSURE, 0.0, 0.0, 0.0)
    while radius <= WIDEST * spacing and found[0] > SURE:
        noise, bent = residuals(radius)
        found = min(found, (noise / radius, noise, bent, radius))
        radius *= WIDER
    _, noise, bent, radius = found
    wanted = _by_noise(noise, spacing)
    length = wanted.length
    while radius and length > NARROWER * radius and residuals(length)[1] > BENT * bent:
        length /= NARROWER
    return wanted._replace(length=length)


def _by_noise(noise: float, spacing: float) -> FitRadius:
    return FitRadius(spacing * float(np.clip(np.sqrt(CALM * noise / spacing), LEAST, WIDEST)), spacing, noise)


def neighbours(
    grid: CellGrid, points: NDArray[np.float32], asked: NDArray[np.integer], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return (m, SEEN, 3) offsets to neighbours of points within a radius, radii, and which of these there are."""
    here = points[asked, :3].astype(np.float64)
    keys = grid.keys_of(points[asked])
    ranges = grid.ranges(keys, int(np.ceil(radius / grid.side))).reshape(-1, 2)
    owner = np.repeat(np.arange(len(asked)), len(ranges) // len(asked))
    stride = 1 + np.maximum(ranges[:, 1] - ranges[:, 0] - 1, 0) // LOOKED_AT
    length = -(-(ranges[:, 1] - ranges[:, 0]) // stride)
    steps = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    places = np.repeat(ranges[:, 0], length) + steps * np.repeat(stride, length)
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
