"""The spacing of a point cloud is that of its surface, however often its points are repeated."""

import numpy as np
import pytest

from pointshade_gl.estimation.cloud_estimates import estimate_spacing

from ..support.clouds import cloud


@pytest.mark.parametrize(("shape", "count"), [("sphere", 300), ("torus", 8000), ("box", 100_000)])
@pytest.mark.parametrize("times", [1, 3])
def test_the_spacing_is_the_root_of_the_area_of_a_point(shape, count, times):
    made = cloud(shape, count, 70)
    found = estimate_spacing(np.repeat(made.positions, times, axis=0))
    assert found.length == pytest.approx(made.spacing, rel=0.12)
    assert found.distinct == pytest.approx(1 / times, rel=0.1)


def test_noise_and_a_far_point_change_little():
    made = cloud("sphere", 30_000, 71, noise=1)
    made.positions[7] = 1e9
    assert estimate_spacing(made.positions).length == pytest.approx(made.spacing, rel=0.15)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((50, 3)), np.eye(3) * 1e-40])
def test_without_any_spacing_it_is_one(points):
    assert estimate_spacing(points.astype(np.float32)).length == 1
