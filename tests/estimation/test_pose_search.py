"""Poses of which nothing is known: they are found, or a sentence says why not, and no wrong one is sure."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.sources import open_source

from ..support.posed_views import (
    CAMERA,
    MIDDLE,
    ball_before_plane,
    corner,
    off,
    one_plane,
    painted,
    patterned,
    plain,
    turned,
    two_planes,
    view_from,
    views,
    waves,
)

SOME_POSE = np.block([[turned(130, np.array([1, 2, 3])), np.array([[4], [5], [6]])], [np.zeros((1, 3)), 1]])
QUARTER = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])  # of a turn about the optical axis
NOISE = 0.0015


def lost(frames):
    """Frames of which only the first has its pose."""
    return [frames[0], *(frame.at(SOME_POSE) for frame in frames[1:])]


def searched(given, progress=None):
    """The frames at the poses that were found, and the notes."""
    notes = []
    return ps.align_frames(given, search=True, notes=notes.append, progress=progress), notes


def pose_at(yaw, pitch=8.0, roll=0.0, nearer=0.0):
    """A camera round the middle of the scene, turned about its own axis, and moved towards what it sees by so much."""
    pose = ps.orbit_pose(None, MIDDLE, yaw, pitch)
    pose[:3, 3] += nearer * pose[:3, 2]
    pose[:3, :3] = pose[:3, :3] @ turned(roll, np.array([0, 0, 1]))
    return pose


def pair(scene, pose, seed=0):
    rng = np.random.default_rng(seed)
    return [view_from(scene, one, NOISE, rng) for one in (pose_at(-10), pose)]


def half(frame, is_left):
    """The frame with depth in one half only."""
    depth = frame.depth.copy()
    depth[:, CAMERA.width // 2 :] *= not is_left
    depth[:, : CAMERA.width // 2] *= is_left
    return ps.Frame(frame.color, depth, frame.camera, frame.pose)


def is_sure(found):
    return found.fit.placed and not found.doubt


class TestFound:
    @pytest.mark.parametrize(
        ("seed", "yaws", "steps"),
        [(0, (0, -22), 10), *(pytest.param(seed, (0, -22, 25), 13, marks=pytest.mark.system) for seed in range(3))],
    )
    def test_views_of_a_textured_corner(self, seed, yaws, steps):
        rng = np.random.default_rng(seed)
        true = [view_from(corner(painted), pose_at(yaw, *rng.uniform(-5, 12, 2)), NOISE, rng) for yaw in yaws]
        told = []
        found, notes = searched(lost(true), lambda *done: told.append(done))
        assert not notes and np.array_equal(found[0].pose, true[0].pose)
        assert max(off(one, other) for one, other in zip(found, true, strict=True)) < 0.002
        # progress counts frames, pairs and levels
        assert [done for done, _ in told] == sorted(done for done, _ in told) and told[-1] == (steps, steps)

    @pytest.mark.parametrize(
        ("yaw", "roll", "nearer"), [(20, 40, 0), (15, -115, 0), (0, 180, 0), (10, 5, 0.7), (45, 0, 0)]
    )
    def test_rolled_nearer_and_wide_apart(self, yaw, roll, nearer):
        true = pair(corner(painted), pose_at(yaw, 8, roll, nearer))
        found, _ = searched(lost(true))
        assert off(found[1], true[1]) < 0.003

    def test_shape_alone_suffices(self, renderer):
        true = views(corner(plain), 3, NOISE)[::2]
        bare = [ps.Frame(None, one.depth, one.camera, one.pose) for one in true]
        for given in (true, bare):
            found = renderer.search_poses(lost(given))[1]
            assert found.fit.placed and off(true[1].at(found.fit.pose), true[1]) < 0.003

    def test_the_same_frame_twice(self):
        frame = views(corner(painted), 1, NOISE)[0]
        found, notes = searched(lost([frame, frame]))
        assert not notes and off(found[1], frame) < 1e-4

    def test_another_exposure_and_size(self):
        true = pair(corner(painted), pose_at(12))
        color = np.clip(true[1].color * 0.75, 0, 255).astype(np.uint8)
        small = ps.Camera(CAMERA.fx, CAMERA.fy, CAMERA.cx - 20, CAMERA.cy, CAMERA.width - 20, CAMERA.height)
        true[1] = ps.Frame(color[:, 20:], true[1].depth[:, 20:], small, true[1].pose)
        found, _ = searched(lost(true))
        assert off(found[1], true[1]) < 0.002

    @pytest.mark.system
    def test_again_the_same(self):
        given = lost(views(corner(painted), 2, NOISE))
        once, again = (searched(given)[0] for _ in range(2))
        assert all(np.array_equal(one.pose, other.pose) for one, other in zip(once, again, strict=True))


class TestNotFound:
    """Each stays as given, with one sentence."""

    def declined(self, given, why):
        found, notes = searched(given)
        assert len(notes) == 1 and np.array_equal(found[1].pose, given[1].pose)
        assert f"the pose of frame 1 of {len(given)} was not found and stays as given: " in notes[0] and why in notes[0]
        return found

    @pytest.mark.parametrize(("scene", "motions"), [(one_plane, 3), (two_planes, 1), (ball_before_plane, 1)])
    def test_what_nothing_fixes(self, scene, motions):
        self.declined(lost(views(scene(), 2, NOISE)), f"fix {motions} of 6 motions")

    def test_a_pattern_that_repeats_itself(self):
        self.declined(lost(views(one_plane(patterned), 2, NOISE)), "another pose fits as well")

    def test_views_of_different_things(self):
        self.declined([views(corner(painted), 1, NOISE)[0], views(ball_before_plane(), 2, NOISE)[1].at(SOME_POSE)], "")

    def test_frames_without_any_point(self):
        first, other = views(corner(painted), 2)
        empty = ps.Frame(other.color, np.zeros_like(other.depth), CAMERA, SOME_POSE)
        self.declined([first, empty], "too few points")
        self.declined([empty, first], "too few points")

    @pytest.mark.parametrize("count", [2, pytest.param(3, marks=pytest.mark.system)])
    def test_the_others_are_found(self, count):
        true = views(corner(painted), count, NOISE)
        empty = ps.Frame(true[0].color, np.zeros_like(true[0].depth), CAMERA, SOME_POSE)
        stranger = views(two_planes(plain), 1, NOISE)[0] if count == 3 else empty
        found = self.declined(lost([true[0], stranger, *true[1:]]), "")
        assert max(off(one, other) for one, other in zip(found[2:], true[1:], strict=True)) < 0.002


@pytest.mark.parametrize("paint", [patterned, waves, painted, plain])
@pytest.mark.parametrize(
    ("seed", "yaw", "halves"),
    [
        (0, 12, (True, False)),
        (1, 25, (False, True)),
        pytest.param(0, 12, (False, True), marks=pytest.mark.system),
        pytest.param(1, 25, (True, False), marks=pytest.mark.system),
    ],
)
def test_hardly_any_overlap_is_right_or_not_sure(renderer, paint, seed, yaw, halves):
    true = pair(corner(paint), pose_at(yaw), seed)
    found = renderer.search_poses(lost([half(*one) for one in zip(true, halves, strict=True)]))[1]
    assert not is_sure(found) or off(true[1].at(found.fit.pose), true[1]) < 0.01


def test_what_is_asked_wrongly(renderer):
    frame = views(corner(painted), 1)[0]
    with pytest.raises(ValueError, match="at most 8 frames at once, got 9"):
        renderer.search_poses([frame] * 9)
    with pytest.raises(TypeError, match="search must be a bool"):
        renderer.align_frames([frame, frame], search="yes")
    assert np.array_equal(renderer.align_frames(frame, search=True)[0].pose, frame.pose)


@pytest.mark.data
class TestRealFrames:
    @pytest.mark.parametrize(
        "numbers", [(0, 9), *(pytest.param(numbers, marks=pytest.mark.system) for numbers in ((7, 17), (3, 14, 20)))]
    )
    def test_a_room_from_20_to_60_degrees_apart(self, shared_data, numbers):
        source = open_source(shared_data / "icl_livingroom_23views")
        given = [source[k] for k in numbers]
        found, notes = searched([given[0], *map(self.on_its_side, given[1:])])
        assert not notes
        for one, true in zip(found[1:], ps.align_frames(given)[1:], strict=True):
            assert off(true.at(one.pose @ np.linalg.inv(QUARTER)), true) < 0.01

    def on_its_side(self, frame):
        """What the camera sees, turned by a quarter about its axis, with a pose of which nothing is true."""
        c = frame.camera
        camera = ps.Camera(c.fy, c.fx, c.cy, c.width - 1 - c.cx, c.height, c.width)
        return ps.Frame(np.rot90(frame.color).copy(), np.rot90(frame.depth).copy(), camera, SOME_POSE)

    def test_two_corners_of_a_workshop_share_too_little(self, shared_data):
        given = [ps.load_frame(shared_data / f"realsense_box_{k}") for k in (2, 6)]
        found, notes = searched(given)
        assert len(notes) == 1 and "not found" in notes[0] and np.array_equal(found[1].pose, given[1].pose)
