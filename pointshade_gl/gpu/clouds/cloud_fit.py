"""Fits a plane through the neighbours of each point of a cloud: wider where they are few, sharp at edges."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..core.passes import FullscreenPasses
from .cell_grid import CellGrid
from .fit_radius import WIDER, FitRadius
from .neighbourhood import Neighbourhood

PLANES, TRIMMED, EDGES = "clouds/planes.frag", "clouds/trimmed.frag", "clouds/edges.frag"
ENOUGH = 12  # neighbours
LEVELS = 7  # each looks further
LINE, LINE_LEVELS = 1.0, 3  # LINE of common/cloud_planes.glsl; how much further it is worth to look
OWN, NONE = 6.0, 0.09  # OWN, and THICKEST squared, of common/cloud_edges.glsl
FLAT = 1e-4  # cost of a plane, radii squared: what is flatter has no edge near it
TRIM = 0.1  # of the squared thickness: a neighbour's is less where a few points lie off
QUIET = 0.03  # radii of noise: with more, thinner planes are chance
GATE, NOISY_GATE, NOISE = 0.02, 0.2, 2.5  # what a better plane may cost: of the cost so far, of that with noise
ROUNDS = 2


class Shape(NamedTuple):
    """What is known of planes without looking at their neighbours again."""

    known: NDArray[np.bool_]
    thickness2: NDArray[np.float32]  # radii squared; infinite without a plane
    cost: NDArray[np.float32]  # cost_of in common/cloud_edges.glsl


class CloudFit:
    """The planes of all points, in the order of a cell grid.

    points  (n, 4) xyz, 0
    planes  (n, 4), see common/cloud_planes.glsl
    leans   (n, 4) how far aside the mean of the neighbours lies, radii; how many there are
    levels  (n,) how often the radius was made wider
    """

    def __init__(
        self, context: moderngl.Context, passes: FullscreenPasses, grid: CellGrid, points: NDArray[np.float32],
        radius: FitRadius,
    ):  # fmt: skip
        self._context, self._passes, self._grid = context, passes, grid
        self.points, self._radius = points, radius
        self.levels = np.zeros(len(points), np.uint8)
        near = Neighbourhood(context, grid, points)
        try:
            self.planes, self.leans = near.run(passes.fullscreen(PLANES), radius.of_level(0), radius.most)
        finally:
            near.release()
        for level in range(1, LEVELS + 1):
            self._look_further(level)
        if radius.noise < QUIET * radius.length:
            self._trim()
        for _ in range(ROUNDS):
            self._sharpen()

    @property
    def radii(self) -> NDArray[np.float32]:
        """Return (n,) within which radius the neighbours lie."""
        return np.array([self._radius.of_level(level) for level in range(LEVELS + 1)], np.float32)[self.levels]

    def _look_further(self, level: int) -> None:
        """Fit again where neighbours were few, or on a line as those of a scan's row are."""
        again = self.leans[:, 3] < ENOUGH
        if level <= LINE_LEVELS:
            again |= (self.planes[:, 3] == LINE) & ~self.planes[:, :3].any(1)
        asked = np.flatnonzero(again)
        if len(asked):
            self.planes[asked], self.leans[asked] = self._ask(PLANES, level, self.points[asked])
            self.levels[asked] = level

    def _trim(self) -> None:
        """Fit again where a few points lie off: a neighbour's plane is thinner."""
        shape = self._shape()
        is_thicker = self._best_near(shape.thickness2) < TRIM * shape.thickness2
        asked = np.flatnonzero(shape.known & (self.levels == 0) & (shape.cost > FLAT) & is_thicker)
        if len(asked):
            own = self.planes[asked]
            self._take(asked, *self._ask(TRIMMED, 0, self.points[asked], own_map=own))

    def _sharpen(self) -> None:
        """Take neighbours' planes at edges. All are chosen among those from before."""
        shape = self._shape()
        gate = self._gate(shape.cost)
        is_worth = (shape.cost > FLAT) & ((self.levels > 0) | (self._best_near(shape.thickness2) < gate))
        answers = []
        for level in range(self.levels.max(initial=0) + 1):
            asked = np.flatnonzero(is_worth & (self.levels == level))
            if len(asked):
                queries = self.points[asked]
                queries[:, 3] = gate[asked]
                answers.append((asked, *self._ask(EDGES, level, queries)))
        for answer in answers:
            self._take(*answer)

    def _take(self, asked: NDArray[np.integer], planes: NDArray[np.float32], leans: NDArray[np.float32]) -> None:
        found = planes[:, :3].any(1)
        self.planes[asked[found]], self.leans[asked[found]] = planes[found], leans[found]

    def _shape(self) -> Shape:
        size = np.sqrt(np.einsum("nk,nk->n", self.planes[:, :3], self.planes[:, :3]))
        known = size > 0.5
        thickness2 = np.where(known, (size - 1) ** 2, np.float32(np.inf))
        off = np.maximum(self.planes[:, 3] ** 2 - OWN * self._noise2(), 0)
        return Shape(known, thickness2, np.where(known, thickness2 + off, np.float32(NONE)))

    def _noise2(self) -> NDArray[np.float32]:
        """Return the square of the noise, radii, of each point."""
        by_level = [self._radius.noise_share(level) ** 2 for level in range(LEVELS + 1)]
        return np.array(by_level, np.float32)[self.levels]

    def _gate(self, cost: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what a neighbour's plane must cost less than. Curves have neighbours that are a little better."""
        return np.minimum(NOISY_GATE * cost, GATE * cost + NOISE * self._noise2())

    def _best_near(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return for each point the least value in the cells around its own."""
        grid = self._grid
        least = np.append(np.minimum.reduceat(values, grid.starts[:-1]), np.float32(np.inf))
        best = least[:-1].copy()
        for first, end in grid.spans.transpose(1, 2, 0):
            for step in range(3):
                at = np.where(first + step < end, first + step, len(best))
                np.minimum(best, least[at], out=best)
        return np.repeat(best, np.diff(grid.starts))

    def _ask(
        self, shader: str, level: int, queries: NDArray[np.float32], own_map: NDArray[np.float32] | None = None
    ) -> list[NDArray[np.float32]]:
        """Return what a pass answers for some points, with the radius of a level."""
        radius = self._radius.of_level(level)
        grid, order = (self._grid, slice(None)) if level == 0 else self._around(queries, radius)
        near = Neighbourhood(self._context, grid, self.points[order], queries)
        inputs: dict[str, Any] = {} if shader == PLANES else {"noise": self._radius.noise_share(level) ** 2}
        try:
            if own_map is not None:
                inputs["own_map"] = near.texture(own_map)
            if shader == EDGES:
                inputs |= {"plane_map": near.texture(self._in_first_radii(order)), "unit": WIDER**-level}
            return near.run(self._passes.fullscreen(shader), radius, self._radius.most, **inputs)
        finally:
            near.release()

    def _around(self, queries: NDArray[np.float32], radius: float) -> tuple[CellGrid, NDArray[np.integer]]:
        """Return a grid of the points that lie within a radius of some, or a little further, and which these are."""
        fine = self._grid
        first = CellGrid(self.points[fine.starts[:-1]], radius + fine.side)  # of each cell one point
        ranges = first.ranges(np.unique(first.keys_of(queries))).reshape(-1, 2)
        count = len(fine.cells) + 1
        change = np.bincount(ranges[:, 0], minlength=count) - np.bincount(ranges[:, 1], minlength=count)
        is_near = np.empty(len(fine.cells), bool)
        is_near[first.order] = np.cumsum(change[:-1]) > 0
        some = np.flatnonzero(np.repeat(is_near, np.diff(fine.starts)))
        grid = CellGrid(self.points[some], radius)
        return grid, some[grid.order]

    def _in_first_radii(self, order: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Return planes with their lengths in the radius of the first level."""
        planes, levels = self.planes[order], self.levels[order]
        wide = np.flatnonzero((levels > 0) & planes[:, :3].any(1))
        if len(wide):
            planes, factor = planes.copy(), np.float32(WIDER) ** levels[wide]
            size = np.sqrt(np.einsum("nk,nk->n", planes[wide, :3], planes[wide, :3]))
            planes[wide, :3] *= ((1 + (size - 1) * factor) / size)[:, None]
            planes[wide, 3] *= factor
        return planes
