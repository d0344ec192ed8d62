"""Cells of point clouds: nine ranges hold every neighbour of a point."""

import numpy as np
import pytest

from pointshade_gl.gpu.clouds.cloud_planes import CellGrid, sorted_order

F = np.float32


@pytest.mark.parametrize("outlier", [None, 1e12])
def test_the_ranges_of_a_cell_hold_all_neighbours(outlier):
    points = np.random.default_rng(0).normal(size=(700, 3)).astype(F)
    if outlier:
        points[3] = outlier
    grid = CellGrid(points, 0.4)
    ranges = grid.ranges()[grid.cell_of]
    inside = points[grid.order]
    for k in range(0, 700, 7):
        near = np.flatnonzero(((inside - inside[k]) ** 2).sum(1) < 0.4**2)
        held = np.concatenate([np.arange(*one) for one in ranges[k]])
        assert len(set(held)) == len(held) < 700 and set(near) <= set(held)


def test_wider_ranges_and_those_of_other_points():
    rng = np.random.default_rng(1)
    points, others = rng.random((500, 3)).astype(F), rng.random((40, 3)).astype(F)
    grid = CellGrid(points, 0.1)
    ranges = grid.ranges(grid.keys_of(others), reach=3)
    assert ranges.shape == (40, 49, 2)
    for other, rows in zip(others, ranges, strict=True):
        near = np.flatnonzero(((points[grid.order] - other) ** 2).sum(1) < 0.3**2)
        assert set(near) <= set(np.concatenate([np.arange(*one) for one in rows]))


def test_cells_lie_one_after_the_other():
    points = np.random.default_rng(2).random((300, 3)).astype(F)
    grid = CellGrid(points, 0.2)
    assert (np.diff(grid.cells) > 0).all() and grid.starts[-1] == 300 and len(grid.starts) == len(grid.cells) + 1
    assert (grid.keys_of(points[grid.order]) == np.repeat(grid.cells, np.diff(grid.starts))).all()


@pytest.mark.parametrize("largest", [50, 1 << 60])
def test_equal_keys_stay_in_their_order(largest):
    keys = np.random.default_rng(3).integers(0, largest, 1000)
    keys[::3] = 7
    assert (sorted_order(keys) == np.argsort(keys, kind="stable")).all()


def test_no_points_are_no_cells():
    grid = CellGrid(np.zeros((0, 3), F), 1.0)
    assert not len(grid.cells) and not len(grid.order) and grid.starts.tolist() == [0]
