"""Rotations: quaternions both ways, and the checks of 4x4 matrices."""

import numpy as np
import pytest

from pointshade_gl.scene.camera import check_matrix, is_orthogonal, is_rotation, moved, quaternion_of, rotation_of

HALF = 0.5**0.5


@pytest.mark.parametrize(
    ("quaternion", "rows"),
    [
        ((0, 0, 0, 1), ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
        ((1, 0, 0, 0), ((1, 0, 0), (0, -1, 0), (0, 0, -1))),
        ((0, 0, HALF, HALF), ((0, -1, 0), (1, 0, 0), (0, 0, 1))),  # x becomes y
        ((HALF, 0, 0, HALF), ((1, 0, 0), (0, 0, -1), (0, 1, 0))),  # y becomes z
    ],
)
def test_a_quaternion_is_a_rotation(quaternion, rows):
    np.testing.assert_allclose(rotation_of(np.array(quaternion, float)), rows, atol=1e-15)


def test_a_rotation_is_its_quaternion():
    halves = np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)], float)  # half turns: w is 0
    some = np.random.default_rng(5).normal(size=(50, 4))
    some /= np.linalg.norm(some, axis=1, keepdims=True)
    for quaternion, rotation in zip([*halves, *some], [*rotation_of(halves), *rotation_of(some)], strict=True):
        found = quaternion_of(rotation)
        assert found[3] >= 0 and abs(found @ quaternion) == pytest.approx(1, abs=1e-14)
        np.testing.assert_allclose(rotation_of(found), rotation, atol=1e-14)


def test_what_is_a_rotation():
    turn = rotation_of(np.array([0.5, 0.5, 0.5, 0.5]))
    assert is_rotation(turn, 1e-12) and is_orthogonal(turn, 1e-12)
    assert not is_rotation(-turn, 1e-12) and is_orthogonal(-turn, 1e-12)  # mirrors
    assert not is_rotation(1.01 * turn, 0.01) and is_rotation(1.001 * turn, 0.01)
    assert not is_rotation(turn + 0.1 * np.eye(3, k=1), 0.01)


def test_points_are_turned_and_then_shifted():
    matrix = np.array([[0.0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]])
    np.testing.assert_array_equal(moved(np.array([[[1.0, 2, 3]]]), matrix), [[[8, 21, 33]]])


def test_a_checked_matrix_is_a_copy():
    given = np.eye(4)
    checked = check_matrix(given, "m")
    checked[0, 0] = 5
    assert given[0, 0] == 1


@pytest.mark.parametrize(
    ("value", "error", "complaint"),
    [
        ("pose", TypeError, r"m must be numbers of shape \(4, 4\), got 'pose'"),
        (np.eye(3), ValueError, r"m must have shape \(4, 4\), got \(3, 3\)"),
        (np.diag([1, np.nan, np.inf, 1]), ValueError, "m must be finite, got 2 NaN or infinite entries"),
        (np.diag([1, 1e20, 1, 1]), ValueError, r"below 1e\+18, got 1e\+20"),
    ],
)
def test_impossible_matrices_are_named(value, error, complaint):
    with pytest.raises(error, match=complaint):
        check_matrix(value, "m")
