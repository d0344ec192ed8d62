"""Do the views agree? What no file says about poses and cameras is found out from views that overlap."""

import time

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.cameras.pose_files import Reading, find_reading
from pointshade_gl.scene.camera import AXES, OPENGL

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def views(shared_data):
    room = ps.open_source(shared_data / "icl_livingroom_23views", notes=lambda _: None)
    return [ps.Frame(None, room[k].depth, room[k].camera, room[k].pose) for k in (5, 7, 9)]


def changed(views, pose=lambda pose: pose, camera=lambda camera: camera, scale=1.0):
    return [
        ps.Frame(None, view.depth * np.float32(scale), camera(view.camera), pose(view.pose.copy())) for view in views
    ]


def test_views_that_agree_are_left_as_they_are(views):
    found = find_reading(views, may_scale=True, metric_poses=True)
    assert found.reading == Reading() and found.error < 0.01


@pytest.mark.parametrize("axes", [name for name in AXES if name != "opencv"])
@pytest.mark.parametrize("to_world", [True, False])
def test_axes_and_direction_of_poses_are_found(views, axes, to_world):
    def written(pose):
        pose = pose @ np.linalg.inv(AXES[axes])
        return pose if to_world else np.linalg.inv(pose)

    # a world of its own: otherwise some directions are the same by accident
    world = np.linalg.inv(views[2].pose) @ OPENGL
    found = find_reading(changed(views, lambda pose: written(world @ pose)), may_scale=True, metric_poses=True)
    assert (found.reading.axes, found.reading.to_world, found.reading.mirrored) == (axes, to_world, False)
    assert found.error < 0.002 < 0.01 < found.error_as_written


def test_a_mirrored_picture_is_found(views):
    """ICL-NUIM's fy is negative, which its files do not say: the pictures are those of a world with y upwards."""
    mirror = np.diag([1.0, -1, 1, 1])
    found = find_reading(changed(views, lambda pose: mirror @ pose @ mirror), may_scale=False, metric_poses=True)
    assert found.reading == Reading(mirrored=True) and found.error < 0.01


@pytest.mark.parametrize("per_metre", [5000, 4000, 6553.5, 10000, 256])
def test_the_unit_of_guessed_depth_is_found(views, per_metre):
    found = find_reading(changed(views, scale=per_metre / 1000), may_scale=True, metric_poses=True)
    assert found.reading == Reading(scale=1000 / per_metre)
    assert find_reading(changed(views, scale=5), may_scale=False, metric_poses=True).reading == Reading()


@pytest.mark.parametrize("size", [0.037, 0.25, 17.0])
def test_poses_of_any_unit_are_fitted_to_the_depth(views, size):
    def written(pose):
        pose[:3, 3] *= size
        return pose

    started = time.process_time()
    found = find_reading(changed(views, written), may_scale=True, metric_poses=False)
    assert found.reading.pose_scale * size == pytest.approx(1, abs=0.02)
    assert time.process_time() - started < 5


def test_views_that_see_different_things_tell_nothing(views):
    away = np.diag([-1.0, 1, -1, 1])
    apart = [views[0], ps.Frame(None, views[1].depth, views[1].camera, away)]
    assert find_reading(apart, may_scale=False, metric_poses=True) is None
    assert find_reading(views[:1], may_scale=False, metric_poses=True) is None
