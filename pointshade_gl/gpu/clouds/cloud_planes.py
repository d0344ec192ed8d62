"""Planes through the points of a cloud: their normals, their spacing, and where the surface ends."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.cloud_spacing import estimate_spacing
from ..core.memory import Owner
from ..core.passes import FullscreenPasses
from .cell_grid import CellGrid
from .cloud_fit import MOST, CloudFit
from .fit_radius import LEAST, fit_radius
from .neighbourhood import value_texture

LARGEST = 2.5  # median spacings: those of stray points are no plates
BORDER = 0.35  # radii by which the neighbours lie aside where a surface ends
DOUBTFUL = 0.1  # radians: the expected error of a normal whose confidence is one half


class CloudPlanes(Owner):
    """The planes of a point cloud as textures for drawing it, sorted by cells, WIDTH points in a row.

    order    (n,) which point of the input each one is
    points   RGBA32F: xyz, 0
    planes   RGBA32F: unit normal, or 0 0 0 without a plane; spacing of the surface here
    details  RGBA32F: unit direction in which the surface goes on at its border, or 0 0 0; confidence of the normal,
             0 to 1
    """

    def __init__(
        self,
        context: moderngl.Context,
        positions: NDArray[np.float32],
        normals: NDArray[np.float32] | None = None,
        noise: float | None = None,
    ):
        super().__init__(context)
        self.count = len(positions)
        spacing = estimate_spacing(positions) or 1.0
        grid = CellGrid(positions, LEAST * spacing)
        points = sorted_points(positions, grid)
        radius, noise = fit_radius(grid, points, spacing, noise)
        self.info = "R %.2f s, noise %.3f s" % (radius / spacing, noise / spacing)
        if radius > grid.side:
            grid = CellGrid(positions, radius)
            points = sorted_points(positions, grid)
        most = max(MOST, int(6 * (radius / spacing) ** 2))
        self.order = grid.order
        with self._all_or_nothing():
            passes = FullscreenPasses(context)
            try:
                fit = CloudFit(passes, context, grid, points, radius, most, noise)
            finally:
                passes.release()
            planes, details = finished(fit.planes, fit.leans, fit.radii)
            self.points, self.planes, self.details = (value_texture(self, one) for one in (points, planes, details))


def sorted_points(positions: NDArray[np.float32], grid: CellGrid) -> NDArray[np.float32]:
    points = np.zeros((len(positions), 4), np.float32)
    points[:, :3] = np.take(positions, grid.order, 0)
    return points


def finished(
    plane: NDArray[np.float32], lean: NDArray[np.float32], radius: NDArray[np.float32] | np.float32
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return what the textures hold, from planes, leans (see common/cloud_planes.glsl) and the radius of each."""
    count = np.maximum(lean[:, 3], 1)
    length = np.sqrt(np.einsum("nk,nk->n", plane[:, :3], plane[:, :3]))
    known = length > 0
    planes, details = np.zeros_like(plane), np.zeros_like(plane)
    np.divide(plane[:, :3], length[:, None], out=planes[:, :3], where=known[:, None])
    spacing = radius * np.sqrt(np.pi / count)
    planes[:, 3] = np.minimum(spacing, LARGEST * np.median(spacing)) if len(plane) else spacing
    aside = np.sqrt(np.einsum("nk,nk->n", lean[:, :3], lean[:, :3]))
    np.divide(lean[:, :3], aside[:, None], out=details[:, :3], where=(known & (aside > BORDER))[:, None])
    error = 2 * np.maximum(length - 1, 0) / np.sqrt(count)
    details[:, 3] = np.where(known, 1 / (1 + (error / DOUBTFUL) ** 2), 0)
    return planes, details
