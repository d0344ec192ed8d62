"""Cameras and poses: the conventions, and the errors for impossible ones."""

import math

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import check_pose, view_matrix


def test_field_of_view_spans_the_outer_edges_of_the_picture():
    camera = ps.Camera.from_fov(60, 640, 480)
    top_edge = (-0.5 - camera.cy) / camera.fy
    assert math.degrees(2 * math.atan(-top_edge)) == pytest.approx(60)
    assert (camera.cx, camera.cy) == (319.5, 239.5)


def test_resizing_keeps_the_outer_edges_in_place():
    camera = ps.Camera(1390, 1390, 959.5, 719.5, 1920, 1440).resized(256, 192)
    assert (camera.cx, camera.cy) == pytest.approx((127.5, 95.5))
    assert camera.fx == pytest.approx(1390 / 7.5)


def test_fitting_into_another_shape_does_not_distort():
    camera = ps.Camera(500, 510, 319.5, 239.5, 640, 480).fitted(320, 480)
    assert camera.fx / camera.fy == pytest.approx(500 / 510)
    assert (camera.cx, camera.cy) == pytest.approx((159.5, 239.5))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"fx": 0}, "fx must be above 0"),
        ({"fx": -5}, "fx must be above 0 pixels, got -5"),
        ({"fy": 0}, "fy must not be 0"),
        ({"cx": math.nan}, "cx must be a finite number"),
        ({"width": 0}, "width must be a whole number"),
        ({"height": 4.5}, "height must be a whole number"),
    ],
)
def test_impossible_cameras_are_named(change, complaint):
    values = {"fx": 500, "fy": 500, "cx": 3, "cy": 3, "width": 8, "height": 8} | change
    with pytest.raises(ValueError, match=complaint):
        ps.Camera(**values)


def test_negative_fy_is_a_camera():
    assert ps.Camera(481.2, -480.0, 319.5, 239.5, 640, 480).fy == -480.0


@pytest.mark.parametrize("fov", [0, 180, -10, math.nan])
def test_impossible_fields_of_view_are_named(fov):
    with pytest.raises(ValueError, match="fov must lie between"):
        ps.Camera.from_fov(fov, 64, 48)


@pytest.mark.parametrize(
    ("pose", "complaint"),
    [
        (np.eye(3), r"shape \(4, 4\), got \(3, 3\)"),
        (np.full((4, 4), np.nan), "must be finite"),
        (np.diag([2.0, 2, 2, 1]), "a rotation and a translation"),
        (np.diag([1.0, -1, 1, 1]), "mirrors"),
    ],
)
def test_impossible_poses_are_named(pose, complaint):
    with pytest.raises(ValueError, match=complaint):
        check_pose(pose)


def test_orbiting_keeps_the_pivot_where_it_is_in_the_picture():
    pivot = np.array([0.1, -0.2, 1.5])
    pose = ps.orbit_pose(None, pivot, yaw=25, pitch=-10)
    seen = view_matrix(np.eye(4), pose) @ [*pivot, 1]
    assert seen[:3] == pytest.approx(pivot)


def test_positive_yaw_moves_the_camera_right_and_positive_pitch_up():
    moved = ps.orbit_pose(None, (0, 0, 2), yaw=30, pitch=20)[:3, 3]
    assert moved[0] > 0.5 and moved[1] < -0.5


def test_dolly_goes_a_share_of_the_way():
    assert ps.orbit_pose(None, (0, 0, 2), dolly=0.25)[:3, 3] == pytest.approx((0, 0, 0.5))


def test_dolly_through_the_pivot_is_refused():
    with pytest.raises(ValueError, match="dolly below 1"):
        ps.orbit_pose(None, (0, 0, 2), dolly=1)


CAMERA = ps.Camera(50, -40, 2.5, 1.25, 6, 4)  # y points up
POSE = np.array([[0.0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]])


def test_rays_go_through_the_centres_of_pixels():
    rays = CAMERA.rays()
    assert rays.shape == (4, 6, 3) and rays.dtype == np.float64
    assert rays[3, 5] == pytest.approx(((5 - 2.5) / 50, (3 - 1.25) / -40, 1))
    assert (rays[..., 2] == 1).all()


def test_depth_becomes_points():
    depth = np.arange(24, dtype=np.float32).reshape(4, 6)
    points = CAMERA.unproject(depth)
    assert points.dtype == np.float64 and points.shape == (4, 6, 3)
    np.testing.assert_array_equal(points, CAMERA.rays() * depth[..., None])
    assert points[0, 0].tolist() == [0, 0, 0]  # no depth


def test_depths_of_some_pixels_become_points():
    points = CAMERA.unproject([2.0, 3.0], [(2.5, 1.25), (52.5, 41.25)])
    np.testing.assert_allclose(points, [(0, 0, 2), (3, -3, 3)])
    assert CAMERA.unproject(2.0, (2.5, 1.25)).tolist() == [0, 0, 2]


def test_points_of_the_world():
    np.testing.assert_allclose(CAMERA.unproject([3.0], [(52.5, 41.25)], POSE), [(13, 23, 33)])
    np.testing.assert_allclose(CAMERA.project([(13, 23, 33)], POSE), [(52.5, 41.25)])


def test_the_center_of_projection():
    np.testing.assert_allclose(CAMERA.project((1.0, 2.0, 4.0)), (50 / 4 + 2.5, -40 * 2 / 4 + 1.25))


@pytest.mark.parametrize("pose", [None, POSE])
def test_points_are_projected_where_they_come_from(pose):
    depth = np.random.default_rng(0).uniform(0.1, 9, (4, 6))
    v, u = np.mgrid[:4, :6]
    np.testing.assert_allclose(
        CAMERA.project(CAMERA.unproject(depth, pose=pose), pose), np.stack([u, v], -1), atol=1e-9
    )


def test_what_is_not_in_front_appears_nowhere():
    found = CAMERA.project([(1, 1, 0), (0, 0, 0), (1, 1, -2), (np.nan, 1, 1), (0, 0, 1)])
    assert np.isnan(found[:3]).all() and np.isnan(found[3, 0]) and found[4].tolist() == [2.5, 1.25]


@pytest.mark.parametrize(
    ("call", "error", "complaint"),
    [
        (lambda: CAMERA.unproject(np.ones((6, 4))), ValueError, r"depth must have shape \(4, 6\).*got \(6, 4\)"),
        (lambda: CAMERA.unproject("depth"), TypeError, "depth must be numbers"),
        (
            lambda: CAMERA.unproject(np.ones(3), np.ones((2, 2))),
            ValueError,
            r"depth must have shape \(2,\).*got \(3,\)",
        ),
        (lambda: CAMERA.unproject(np.ones(3), np.ones((3, 3))), ValueError, r"pixels must have shape \(\.\.\., 2\)"),
        (lambda: CAMERA.unproject(np.ones((4, 6)), pose=np.eye(3)), ValueError, "pose must have shape"),
        (lambda: CAMERA.project(np.ones((5, 2))), ValueError, r"points must have shape \(\.\.\., 3\), got \(5, 2\)"),
        (lambda: CAMERA.project(1.0), ValueError, "points must have shape"),
        (lambda: CAMERA.project(None), TypeError, "points must be numbers"),
        (lambda: CAMERA.project(np.ones(3), np.diag([1.0, -1, 1, 1])), ValueError, "pose mirrors"),
    ],
)
def test_wrong_points_and_depths_are_named(call, error, complaint):
    with pytest.raises(error, match=complaint):
        call()
