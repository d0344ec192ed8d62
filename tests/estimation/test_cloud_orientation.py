"""The outside of a point cloud is found by looking at it from all sides."""

import numpy as np
import pytest

from pointshade_gl.estimation import cloud_estimates as cloud_orientation
from pointshade_gl.estimation.cloud_estimates import facing, fibonacci_sphere, is_scan, outward

from ..support.clouds import cloud
from ..support.streets import EYES, street

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


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("beams", [16, 32, 64])
def test_a_scan_is_known_by_its_place(beams, seed):
    scan = street(beams, seed)
    assert is_scan(scan, EYES[0])
    for place in ((0, 0, 0), (0, 0, 30), (15, 9, 0)):  # the ground below it, far above, the side of the street
        assert not is_scan(scan, np.array(place))


def test_so_is_one_from_a_tripod_in_any_order():
    scan = street(grid=True)
    assert is_scan(np.random.default_rng(0).permutation(scan), EYES[0])


@pytest.mark.parametrize("shape", ["sphere", "torus", "box", "stairs"])
@pytest.mark.parametrize("uneven", [False, True])
def test_objects_are_no_scans_from_within_or_beside(shape, uneven):
    made = cloud(shape, 20_000, 55, uneven=uneven)
    for place in ((0, 0, 0), (0.5, 0, 0), (1.5, 0, 0), (0, 0, 2.5), (0.8, 0.8, 0.8)):
        assert not is_scan(made.positions, np.array(place))


def test_lattices_that_become_finer_inwards_are_no_scans():
    away, turn = np.meshgrid(np.linspace(0.01, 1, 100), np.linspace(0, 2 * np.pi, 200, endpoint=False))
    for height in (0 * away, -away, np.sin(3 * away)):
        assert not is_scan(np.stack([away * np.cos(turn), away * np.sin(turn), height], -1).reshape(-1, 3), np.zeros(3))
    assert not is_scan(np.random.default_rng(1).normal(size=(20_000, 3)), np.zeros(3))
    assert not is_scan(cloud("box", 5000, 56).positions, np.array([4.8e6, 5.4e6, 200]))
    assert not is_scan(np.zeros((5000, 3)), np.zeros(3)) and not is_scan(np.zeros((0, 3)), np.zeros(3))


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
