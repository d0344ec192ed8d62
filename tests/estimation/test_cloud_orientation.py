"""The outside of a point cloud is found by looking at it from all sides."""

import numpy as np
import pytest

from pointshade_gl.estimation import cloud_estimates as cloud_orientation
from pointshade_gl.estimation.cloud_estimates import facing, fibonacci_sphere, outward

from ..support.clouds import cloud

UP = np.array([0.0, 0.0, 1.0])


def unsure(normals, seed=1):
    """Half of them turned round."""
    sign = np.random.default_rng(seed).choice([-1, 1], (len(normals), 1))
    return (normals * sign).astype(np.float32)


def right(found, true):
    return ((found * true).sum(-1) > 0).mean()


@pytest.mark.parametrize("noise", [0, 0.25])
@pytest.mark.parametrize("shape", ["sphere", "torus", "box"])
def test_normals_of_closed_surfaces_point_outwards(shape, noise):
    made = cloud(shape, 20_000, 50, noise)
    found, is_sheet = outward(made.positions, unsure(made.normals), UP)
    assert right(found, made.normals) == 1 and not is_sheet
    assert (np.abs(found) == np.abs(made.normals.astype(np.float32))).all()


def test_a_sheet_is_looked_at_from_above():
    made = cloud("stairs", 20_000, 51)
    found, is_sheet = outward(made.positions, unsure(made.normals), UP)
    assert is_sheet and right(found, made.normals) > 0.95
    found, _ = outward(made.positions, unsure(made.normals), -UP)
    treads = made.normals[:, 2] > 0
    assert right(found[treads], -made.normals[treads]) > 0.95


def test_what_was_not_looked_at_follows_its_neighbours(monkeypatch):
    monkeypatch.setattr(cloud_orientation, "ORIENTED_SAMPLE", 3000)
    made = cloud("torus", 30_000, 52)
    found, _ = outward(made.positions + np.array([1e6, 0, 0]), unsure(made.normals), UP)
    assert right(found, made.normals) > 0.999


def test_unknown_normals_stay_unknown():
    made = cloud("sphere", 2000, 53)
    normals = unsure(made.normals)
    normals[::5] = 0
    found, _ = outward(made.positions, normals, UP)
    assert not found[::5].any() and right(found[1::5], made.normals[1::5]) == 1
    nothing, is_sheet = outward(made.positions, 0 * normals, UP)
    assert not nothing.any() and not is_sheet
    assert outward(np.zeros((0, 3)), np.zeros((0, 3), np.float32), UP)[0].shape == (0, 3)


@pytest.mark.parametrize("each", [False, True])
def test_normals_face_the_scanner(each):
    made = cloud("box", 1000, 54)
    scanner = np.array([0.1, 0.2, -0.1])
    found = facing(made.positions, unsure(made.normals), np.tile(scanner, (1000, 1)) if each else scanner)
    assert right(found, -made.normals) == 1


def test_directions_are_spread_evenly():
    directions = fibonacci_sphere(42)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    assert np.abs(directions.mean(0)).max() < 0.01
    assert np.sort(directions @ directions.T)[:, -2].max() < np.cos(np.radians(20))
