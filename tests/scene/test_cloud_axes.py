"""Clouds in other programs' axes: numbers by hand, and the words that a header says."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.cloud import CLOUD_AXES, UPS, axes_in_words, front_in_words, turned
from pointshade_gl.scene.graph import scene_of

# right, below and farther than the camera of a frame: x right, y down, z away from the viewer
SEEN = np.array([[1, 2, 3]], np.float32)
TURNED = {"opencv": (1, 2, 3), "opengl": (1, -2, -3), "blender": (1, 3, -2)}
WORDS = {
    "opencv": "x right, y down, z away from the viewer",
    "opengl": "x right, y up, z towards the viewer",
    "blender": "x right, y away from the viewer, z up",
}


@pytest.mark.parametrize("given", TURNED)
@pytest.mark.parametrize("axes", TURNED)
def test_all_that_lies_or_points_somewhere_is_turned(given, axes):
    up, front = CLOUD_AXES[given]
    at, there = np.array([TURNED[given]]), np.array([TURNED[axes]])
    cloud = ps.PointCloud(at.astype(np.float32), at / 5, seen_from=at[0] * 7, origin=at[0] * 9, up=up, front=front)
    made = turned(cloud, axes)
    assert (made.up, made.front) == CLOUD_AXES[axes]
    assert made.positions.dtype == np.float32 and made.positions.tolist() == there.tolist()
    np.testing.assert_array_equal(made.normals, (there / 5).astype(np.float32))
    assert made.seen_from.tolist() == (there[0] * 7).tolist() and made.origin.tolist() == (there[0] * 9).tolist()


def test_places_of_which_float32_would_tell_no_millimetre_keep_every_bit():
    at = np.random.default_rng(3).uniform(4e6, 5e6, (50, 3))
    made = turned(ps.PointCloud(at, seen_from=at, up="z"), "opengl")
    np.testing.assert_array_equal(made.positions, at[:, [0, 2, 1]] * (1, 1, -1))
    np.testing.assert_array_equal(made.seen_from, made.positions)
    assert (made.up, made.front) == ("y", None), "no camera took it: it is seen from above, as before"


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("axes", CLOUD_AXES)
def test_nothing_is_mirrored_and_up_stays_up(up, axes):
    corner = np.eye(3)
    cloud = ps.PointCloud(corner, up=up)
    made = turned(cloud, axes)
    assert np.linalg.det(made.positions) == pytest.approx(1)
    np.testing.assert_array_equal(made.positions @ made.up_direction, corner @ cloud.up_direction)


@pytest.mark.parametrize("axes", WORDS)
def test_axes_are_said_in_words_from_which_the_front_is_read(axes):
    up, front = CLOUD_AXES[axes]
    assert axes_in_words(up, front) == WORDS[axes]
    assert front_in_words(WORDS[axes]) == front
    assert front_in_words("z up, made by somebody") is None


@pytest.mark.parametrize("axes", CLOUD_AXES)
def test_a_cloud_with_a_front_is_seen_from_there_in_any_axes(axes):
    """Where a point lies in the picture does not depend on the axes."""
    at = np.random.default_rng(8).uniform((-1, -1, 4), (1, 1, 6), (400, 3))
    seen = ps.PointCloud(at, front="-z")
    cloud = turned(seen, axes)
    before, scene = scene_of(seen), scene_of(cloud)
    expected = before.camera.project(seen.positions, before.pose)
    np.testing.assert_allclose(scene.camera.project(cloud.positions, scene.pose), expected, atol=1e-6)
    assert expected[np.argmax(at[:, 1]), 1] > 240 and expected[np.argmax(at[:, 0]), 0] > 320  # y down, x right


def test_a_front_along_up_is_refused():
    with pytest.raises(ValueError, match="front must be another axis than up='y', got -y"):
        ps.PointCloud(SEEN, up="y", front="-y")
    with pytest.raises(ValueError, match="unknown front 'near': known are x, y, z"):
        ps.PointCloud(SEEN, front="near")
