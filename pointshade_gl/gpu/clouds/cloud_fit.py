"""Fits a plane through the neighbours of each point of a cloud."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..core.passes import FullscreenPasses
from .cell_grid import CellGrid
from .neighbourhood import Neighbourhood

MOST = 64  # points of three cells in a row that are looked at
ENOUGH = 12  # neighbours
ROUNDS = 2
MOST_GATE = 0.2
WIDER = 1.6  # from level to level
LEVELS = 7
LINE, LINE_LEVELS = 1.0, 3  # LINE of common/cloud_planes.glsl
GATE, NONE, OVER = 0.02, 0.09, 2.5  # GATE and THICKEST squared of common/cloud_edges.glsl
OWN = 6.0
BENT = 1e-4  # cost from which on a plane may be wrong: flatter ones are right whatever is near


class CloudFit:
    """The planes of all points, in the order of a cell grid.

    points  (n, 4) xyz, 0
    planes  (n, 4), see common/cloud_planes.glsl
    leans   (n, 4) how far aside the mean of the neighbours lies, radii; how many there are
    radii   (n,) within which they lie
    """

    def __init__(self, passes: FullscreenPasses, context: moderngl.Context, grid: CellGrid, points: NDArray[np.float32], radius: float, most: int = MOST, noise: float = 0.0):
        self._noise = noise
        self._passes, self._context = passes, context
        self._grid, self.points, self._radius, self._most = grid, points, radius, most
        near = Neighbourhood(context, grid, points)
        try:
            self.planes, self.leans = near.run(passes.fullscreen("clouds/planes.frag"), radius, self._most)
        finally:
            near.release()
        self.levels = np.zeros(len(points), np.uint8)
        for level in range(1, LEVELS + 1):
            if not self._widen(level):
                break
        for _ in range(ROUNDS):
            self._sharpen()

    @property
    def radii(self):
        return (self._radius * WIDER ** np.arange(LEVELS + 1)).astype(np.float32)[self.levels]

    def _widen(self, level: int) -> bool:
        """Fit again, within a larger radius, where there were few neighbours. Returns whether there were such points."""
        few = self.leans[:, 3] < ENOUGH
        if level <= LINE_LEVELS:
            few |= (self.planes[:, 3] == LINE) & ~self.planes[:, :3].any(1)
        asked = np.flatnonzero(few)
        if not len(asked):
            return False
        radius = self._radius * WIDER**level
        queries = self.points[asked]
        sources = self.points[self._around(queries, radius)]
        grid = CellGrid(sources[:, :3], radius)
        near = Neighbourhood(self._context, grid, np.take(sources, grid.order, 0), queries)
        try:
            planes, leans = near.run(self._passes.fullscreen("clouds/planes.frag"), radius, self._most)
        finally:
            near.release()
        self.planes[asked], self.leans[asked] = planes, leans
        self.levels[asked] = level
        return True

    def _around(self, queries, radius):
        """Return which points lie in cells of the grid near these."""
        grid = self._grid
        corners = CellGrid(self.points[grid.starts[:-1], :3], radius + grid.side)
        ranges = corners.ranges(np.unique(corners.keys_of(queries)))
        change = np.zeros(len(grid.cells) + 1, np.int32)
        np.add.at(change, ranges[..., 0].ravel(), 1)
        np.add.at(change, ranges[..., 1].ravel(), -1)
        is_near = np.empty(len(grid.cells), bool)
        is_near[corners.order] = np.cumsum(change[:-1]) > 0
        return np.flatnonzero(np.repeat(is_near, np.diff(grid.starts)))

    def _sharpen(self) -> None:
        size = np.sqrt(np.einsum("nk,nk->n", self.planes[:, :3], self.planes[:, :3]))
        known = size > 0.5
        thickness2 = np.where(known, (size - 1) ** 2, np.inf).astype(np.float32)
        noise2 = np.float32((self._noise / self._radius) ** 2)
        costs = np.where(known, thickness2 + np.maximum(self.planes[:, 3] ** 2 - OWN * noise2, 0), np.float32(NONE))
        done = []
        for level in range(self.levels.max(initial=0) + 1):
            at = np.flatnonzero((self.levels == level) & (costs > BENT))
            if level == 0:
                at = at[self._is_promising(costs, thickness2)[at]]
            if len(at):
                done.append((at, *self._elect(level, at, costs[at], size, known)))
        for at, planes, leans in done:
            found = planes[:, :3].any(1)
            self.planes[at[found]], self.leans[at[found]] = planes[found], leans[found]

    def _is_promising(self, costs, thickness2):
        grid = self._grid
        least = np.append(np.minimum.reduceat(thickness2, grid.starts[:-1]), np.inf)
        spans = grid.spans(grid.cells)
        best = np.full(len(grid.cells), np.inf, np.float32)
        for k in range(9):
            low, high = spans[:, k, 0], spans[:, k, 1]
            for step in range(3):
                at = low + step
                np.minimum(best, np.where(at < high, least[np.minimum(at, len(grid.cells))], np.inf), out=best)
        return np.repeat(best, np.diff(grid.starts)) < self._gate(costs, 0)

    def _gate(self, costs, level):
        """What a neighbour's plane may cost to take the place of one that costs so much."""
        noise2 = (self._noise / (self._radius * WIDER**level)) ** 2
        return np.minimum(MOST_GATE * costs, GATE * costs + np.float32(OVER * noise2))

    def _elect(self, level, at, costs, size, known):
        radius = self._radius * WIDER**level
        queries = self.points[at].copy()
        queries[:, 3] = self._gate(costs, level)
        if level == 0:
            grid, order = self._grid, slice(None)
        else:
            order = self._around(queries, radius)
            grid = CellGrid(self.points[order, :3], radius)
            order = order[grid.order]
        planes = self.planes[order].copy()
        if self.levels.any():
            factor = np.float32(WIDER) ** self.levels[order]
            ok = known[order]
            s = size[order]
            planes[ok, :3] *= ((1 + (s - 1) * factor) / s)[ok, None]
            planes[ok, 3] *= factor[ok]
        near = Neighbourhood(self._context, grid, self.points[order], queries)
        try:
            return near.run(self._passes.fullscreen("clouds/edges.frag"), radius, self._most, plane_map=near.texture(planes), unit=WIDER**-level, noise=(self._noise / radius) ** 2)
        finally:
            near.release()
