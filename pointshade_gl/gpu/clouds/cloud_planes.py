"""Planes through the points of a cloud: their normals, their spacing, and where the surface ends."""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.cloud_estimates import Spacing, estimate_spacing
from ..core.memory import Owner
from ..core.passes import FullscreenPasses
from .cell_grid import CellGrid
from .cloud_fit import CloudFit
from .fit_radius import LEAST, FitRadius, fit_radius
from .neighbourhood import read_values, value_texture

LARGEST = 2.5  # median spacings: those of stray points are no plates
BORDER = 0.35  # radii by which the neighbours lie aside where a surface ends
LEANING = 1.2  # of a disc within the surface: .42 radii aside is one half, .6 a quarter
CORNER = 0.25  # and not less
ALONE = 3.0  # spacings: more where all points are stray ones
DOUBTFUL = 0.1  # radians: the expected error of a normal whose confidence is one half


class PlaneArrays(NamedTuple):
    """What the textures of CloudPlanes hold.

    order    (n,) which point of the input each one is
    points   (n, 4), planes (n, 4), details (n, 4)
    fit      within which radius the planes were fitted; None without points
    """

    order: NDArray[np.integer]
    points: NDArray[np.float32]
    planes: NDArray[np.float32]
    details: NDArray[np.float32]
    fit: FitRadius | None = None


class CloudPlanes(Owner):
    """The planes of a point cloud as textures for drawing it, sorted by cells, WIDTH points in a row.

    order    (n,) which point of the input each one is
    points   RGBA32F: xyz, 0
    planes   RGBA32F: unit normal, or 0 0 0 without a plane; spacing of the surface here
    details  RGBA32F: unit direction in which the surface goes on at its border, or 0 0 0; confidence of the normal,
             0 to 1

    Normals that are given are kept, those of length 0 are estimated; `noise` is measured unless it is given.
    """

    def __init__(
        self,
        context: moderngl.Context,
        positions: NDArray[np.float32],
        normals: NDArray[np.float32] | None = None,
        noise: float | None = None,
    ):
        super().__init__(context)
        found = find_planes(context, positions, normals, noise)
        self.count, self.order = len(positions), found.order
        with self._all_or_nothing():
            self.points = value_texture(self, found.points)
            self.planes = value_texture(self, found.planes)
            self.details = value_texture(self, found.details)

    def read_normals(self) -> NDArray[np.float32]:
        """Return (n, 3) in the order of the input: unit normals, 0 without a plane."""
        return self._unsorted(self.planes)[:, :3]

    def read_spacing(self) -> NDArray[np.float32]:
        """Return (n,) in the order of the input."""
        return self._unsorted(self.planes)[:, 3]

    def read_confidence(self) -> NDArray[np.float32]:
        """Return (n,) in the order of the input."""
        return self._unsorted(self.details)[:, 3]

    def _unsorted(self, texture: moderngl.Texture) -> NDArray[np.float32]:
        values = np.empty((self.count, 4), np.float32)
        values[self.order] = read_values(texture, self.count)
        return values


def find_planes(
    context: moderngl.Context,
    positions: NDArray[np.float32],
    normals: NDArray[np.float32] | None = None,
    noise: float | None = None,
) -> PlaneArrays:
    """Return what the textures of CloudPlanes hold, with nothing left on the GPU."""
    if not len(positions):
        none = np.zeros((0, 4), np.float32)
        return PlaneArrays(np.zeros(0, np.int64), none, none, none)
    spacing = estimate_spacing(positions)
    grid = CellGrid(positions, LEAST * spacing.length)
    points = _sorted(positions, grid)
    radius = fit_radius(grid, points, spacing.length, noise)
    if radius.length > grid.side:
        grid = CellGrid(positions, radius.length)
        points = _sorted(positions, grid)
    passes = FullscreenPasses(context)
    try:
        fit = CloudFit(context, passes, grid, points, radius)
    finally:
        passes.release()
    planes, details = finished(fit.planes, fit.leans, fit.radii, spacing)
    if normals is not None:
        keep_given(np.take(normals, grid.order, 0), planes, details)
    return PlaneArrays(grid.order, points, planes, details, radius)


def _sorted(positions: NDArray[np.float32], grid: CellGrid) -> NDArray[np.float32]:
    points = np.zeros((len(positions), 4), np.float32)
    points[:, :3] = np.take(positions, grid.order, 0)
    return points


def finished(
    plane: NDArray[np.float32], lean: NDArray[np.float32], radii: NDArray[np.float32], spacing: Spacing
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return what the textures `planes` and `details` hold.

    plane, lean  as the passes of CloudFit write them, radii: (n,) within which they fitted
    """
    count = np.maximum(lean[:, 3], 1)
    size = np.sqrt(np.einsum("nk,nk->n", plane[:, :3], plane[:, :3]))
    known = size > 0.5
    planes, details = np.zeros_like(plane), np.zeros_like(plane)
    np.divide(plane[:, :3], size[:, None], out=planes[:, :3], where=known[:, None])
    aside = np.sqrt(np.einsum("nk,nk->n", lean[:, :3], lean[:, :3]))
    border = known & (aside > BORDER)
    np.divide(lean[:, :3], aside[:, None], out=details[:, :3], where=border[:, None])
    share = np.where(border, np.maximum(1 - LEANING * aside, CORNER), 1)
    here = radii * np.sqrt(np.pi * share / np.maximum(spacing.distinct * count, 1))
    planes[:, 3] = np.minimum(here, LARGEST * min(float(np.median(here)), ALONE * spacing.length))
    error = 2 * np.maximum(size - 1, 0) / np.sqrt(count)  # of the slope of a plane through a disc
    details[:, 3] = np.where(known, 1 / (1 + (error / DOUBTFUL) ** 2), 0)
    return planes, details


def keep_given(normals: NDArray[np.float32], planes: NDArray[np.float32], details: NDArray[np.float32]) -> None:
    """Put the normals that are given, (n, 3), in the place of those that were found, and trust them."""
    size = np.sqrt(np.einsum("nk,nk->n", normals, normals))
    given = size > 0
    np.divide(normals, size[:, None], out=planes[:, :3], where=given[:, None])
    details[given, 3] = 1
