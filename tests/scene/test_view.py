"""How frames are seen, and how lights move around their object."""

import inspect

import numpy as np
import pytest
from pytest import approx

import pointshade_gl as ps
from pointshade_gl.scene.viewpoint import View, views_of_turn, with_camera_turned, with_light_turned

CAMERA = ps.Camera(50, 50, 19.5, 14.5, 40, 30)
POSE = ps.orbit_pose(None, (0.3, -0.2, 2), yaw=35, pitch=-20)  # some camera of the world


def wall(distance=1.5, pose=None):
    return ps.Frame(None, np.full((30, 40), distance, np.float32), CAMERA, pose)


def seen(frame, point):
    """A world point in the frame's camera axes, from its pivot, in scales of the frame."""
    return frame.pose[:3, :3].T @ (np.asarray(point) - frame.pivot) / frame.scale


def test_by_default_each_frame_is_seen_by_its_own_camera():
    look = ps.Appearance(shading="flat", material=ps.Material(specular=0))
    arguments = View(look=look).of(wall(pose=POSE))
    np.testing.assert_allclose(arguments.pop("pose"), POSE, atol=1e-12)
    assert arguments == {"light": None, "camera": None, **look.options}
    assert arguments.keys() < inspect.signature(ps.render).parameters.keys()


def test_the_objects_of_a_scene_keep_their_own_look():
    scene = ps.Scene((ps.Node(ps.PointObject(wall())),), camera=CAMERA)
    assert View(look=ps.Appearance(shading="flat")).of(scene).keys() == {"light", "camera", "pose"}


def test_the_view_is_that_of_orbit_pose_and_the_size_fits_the_whole_picture():
    frame = wall(pose=POSE)
    arguments = View(yaw=20, pitch=10, dolly=0.3, picture_size=(80, 90)).of(frame)
    np.testing.assert_allclose(arguments["pose"], ps.orbit_pose(POSE, frame.pivot, 20, 10, 0.3), atol=1e-12)
    assert arguments["camera"] == CAMERA.fitted(80, 90)


def test_one_pose_serves_all_frames():
    assert (View(pose=POSE).of(wall())["pose"] == POSE).all()


@pytest.mark.parametrize("pose", [None, POSE])
def test_the_light_starts_above_the_front_and_goes_right_behind_left(pose):
    frame = wall(pose=pose)
    way = [seen(frame, with_light_turned(View(), frame, angle).lights[0].position) for angle in (0, 90, 180, 270, 360)]
    front, right, behind, left, again = way
    assert front == approx((0, -0.45, -0.75)) and right == approx((0.75, -0.45, 0))
    assert behind == approx((0, -0.45, 0.75)) and left == approx((-0.75, -0.45, 0)) and again == approx(front)


def test_the_users_lights_go_round_together_and_keep_their_light():
    frame = wall()  # its pivot is straight ahead
    lights = [
        ps.Light(position=(0.5, -1, 1), color=(1, 0, 0)),
        ps.Light(direction=(0, 0.2, 1), intensity=2),
        ps.Light(),
    ]
    point, far, default = with_light_turned(View(lights), frame, 180).lights
    assert point.position == approx((2 * frame.pivot[0] - 0.5, -1, 2)) and point.color == (1, 0, 0)
    assert far.direction == approx((0, 0.2, -1)) and far.intensity == 2
    assert default == ps.Light()


def test_a_swing_goes_to_both_sides_slows_down_where_it_turns_and_loops_without_a_jump():
    angles = [view.yaw for view in views_of_turn(wall(), View(yaw=10), "swing", 100)]
    assert (angles[0], max(angles), min(angles)) == approx((10, 35, -15))
    steps = np.diff([*angles, angles[0]])  # and on to the first again
    assert np.abs(steps).max() == approx(25 * 2 * np.pi / 100, rel=1e-2) and steps[0] == approx(steps[-1])
    assert np.abs(np.diff(steps)).max() < 0.11 and np.abs(steps[[24, 25]]).max() < 0.06


def test_the_camera_swings_before_a_single_frame_and_goes_around_what_has_a_back():
    def yaws(source, what):
        return [view.yaw for view in views_of_turn(source, View(), what, 4)]

    scene = ps.Scene((ps.Node(ps.PointObject(wall())),), camera=CAMERA)
    assert yaws(wall(), "camera") == yaws(scene, "swing") == approx([0, 25, 0, -25])
    assert yaws(scene, "camera") == yaws(wall(), "360") == [0, 90, 180, 270]
    assert yaws(wall(), "swing:7.5") == approx([0, 7.5, 0, -7.5])


@pytest.mark.parametrize("what", ["swing:", "swing:x", "swing:0", "swing:-5", "swing:nan", "swing:181"])
def test_a_swing_of_impossible_degrees_is_refused(what):
    with pytest.raises(ValueError, match="swing:DEG takes degrees to either side, above 0 and at most 180, got"):
        views_of_turn(wall(), View(), what, 4)


@pytest.mark.parametrize("what", ["light:5", "camera:360", "around", 360, None])
def test_an_unknown_turntable_is_refused(what):
    with pytest.raises(ValueError, match=r"unknown turntable .*: known are light, camera, swing, 360"):
        views_of_turn(wall(), View(), what, 4)


def test_the_camera_goes_round_from_where_the_view_stands():
    frame = wall(pose=POSE)
    turned = with_camera_turned(View(yaw=20, pitch=10), frame, 90).of(frame)["pose"]
    np.testing.assert_allclose(turned, ps.orbit_pose(POSE, frame.pivot, 110, 10), atol=1e-12)
    own = ps.orbit_pose(None, (0, 0, 1), yaw=-30)
    turned = with_camera_turned(View(pose=own), frame, 90).of(frame)["pose"]
    np.testing.assert_allclose(turned, ps.orbit_pose(own, frame.pivot, 90), atol=1e-12)


def test_a_scene_is_gone_round_upright_however_its_camera_looks_down():
    """The horizon stays level: the camera's x never leaves the ground's plane."""
    down = ps.orbit_pose(np.diag([1.0, -1, -1, 1]), (0, 0, 0), pitch=40)
    scene = ps.Scene((ps.Node(ps.PointObject(wall())),), camera=CAMERA, pose=down)
    for degrees in (0, 90, 200, 300):
        view = with_camera_turned(View(), scene, degrees)
        pose = view.of(scene)["pose"]
        assert pose[1, 0] == approx(0, abs=1e-12) and pose[1, 2] == approx(down[1, 2])
        lamp = with_light_turned(View(), scene, degrees).lights[0]
        assert lamp.position is not None and lamp.position[1] == approx(
            with_light_turned(View(), scene, 0).lights[0].position[1]
        )


def test_a_scene_whose_camera_leans_is_gone_round_its_own_vertical():
    """As in the worlds of many data sets, where z points up."""
    leaning = ps.orbit_pose(None, (0, 0, 0), pitch=80)
    scene = ps.Scene((ps.Node(ps.PointObject(wall())),), camera=CAMERA, pose=leaning)
    pose = View(yaw=50).of(scene)["pose"]
    np.testing.assert_allclose(pose, ps.orbit_pose(leaning, scene.pivot, 50), atol=1e-12)
