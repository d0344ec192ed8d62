"""Corrected poses against true ones: how near they come, what stays as given, and what is said about it."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere
from pointshade_gl.estimation.alignment import motion_matrix, motion_of, pair_equations, solved_motions

from ..support.posed_views import (
    CAMERA,
    ball_before_plane,
    corner,
    disturbed,
    off,
    off_surface,
    one_plane,
    painted,
    plain,
    tiled,
    turned,
    two_planes,
    views,
)


def aligned(given):
    """The frames with corrected poses, and the notes."""
    notes = []
    return ps.align_frames(given, notes=notes.append), notes


def errors(found, true, how=off):
    return [1000 * how(frame, other) for frame, other in zip(found, true, strict=True)]


def same_pose(frame, other):
    return np.array_equal(frame.pose, other.pose)


def right_or_given(frame, given, true):
    return same_pose(frame, given) or off(frame, true) < 0.002


class TestSteps:
    def test_a_motion_and_its_step_belong_together(self):
        step = np.array([0.1, -0.2, 0.05, 0.3, 0.2, -0.1])
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turned(40, np.array([1, 2, 3])), (0.1, 0.2, 0.5)
        np.testing.assert_allclose(motion_of(motion_matrix(step, 0.7) @ pose, pose, 0.7), step, atol=1e-12)
        np.testing.assert_allclose(motion_of(pose, pose, 0.7), 0, atol=1e-12)

    def test_what_noise_adds_to_the_equations_is_known(self):
        rng = np.random.default_rng(2)
        points, weights = rng.normal(0, 1, (200_000, 3)), rng.uniform(0, 1, 200_000)
        directions = rng.normal(0, 0.1, points.shape)
        found = pair_equations(points, directions, weights, weights, np.full(len(points), 0.01), 1.3)
        np.testing.assert_allclose(found.noise, found.matrix, atol=0.03 * found.matrix.max())

    def test_only_motions_that_exceed_the_noise_are_solved(self):
        matrices = np.stack([np.diag([4.0, 1, 1]), np.zeros((3, 3))])
        noises = np.stack([np.diag([0.01, 0.01, 0.5]), np.zeros((3, 3))])
        step, loose = solved_motions(matrices, noises, np.array([-8.0, 3, 5]))
        np.testing.assert_allclose(step, [2, -3, 0], atol=1e-6)
        np.testing.assert_allclose(np.abs(loose), [[0, 0, 1]], atol=1e-6)


class TestAccuracy:
    @pytest.mark.parametrize(("metres", "degrees"), [(0.0, 0.0), (0.01, 0.3), (0.03, 0.9), (0.1, 3.0)])
    def test_frames_come_back_from_any_errors_alike(self, metres, degrees):
        true = views(corner(), 5, noise=0.0015)
        found, notes = aligned(disturbed(true, metres, degrees))
        assert not notes and same_pose(found[0], true[0])
        assert max(errors(found, true)) < 1.0

    @pytest.mark.parametrize("paint", [painted, plain])
    def test_clean_depth_gives_exact_poses_by_depth_or_colour(self, paint):
        true = views(corner(paint), 3)
        found, notes = aligned(disturbed(true, 0.02, 0.5))
        assert not notes and max(errors(found, true)) < 0.8 and max(errors(found, true, off_surface)) < 0.05

    def test_colours_fix_what_planes_do_not(self):
        for scene in (one_plane(painted), two_planes(painted), ball_before_plane(painted)):
            true = views(scene, 3, noise=0.001)
            found, notes = aligned(disturbed(true, 0.02, 0.5))
            assert not notes and max(errors(found, true)) < 1.0

    def test_other_exposures_and_cameras_do_no_harm(self):
        true = views(corner(), 4, noise=0.001)
        gains = 1, 0.8, 1.15, 0.9
        colors = [np.clip(one.color * gain, 0, 255).astype(np.uint8) for one, gain in zip(true, gains, strict=True)]
        given = [ps.Frame(c, f.depth, f.camera, f.pose) for c, f in zip(colors, true, strict=True)]
        given[2] = ps.Frame(given[2].color[:100], given[2].depth[:100], replace(CAMERA, height=100), true[2].pose)
        found, notes = aligned(disturbed(given, 0.02, 0.6))
        assert not notes and max(errors(found, given)) < 1.0

    def test_colours_that_are_exactly_alike_nearly_everywhere_do_not_mislead(self):
        """Of a drawn floor of tiles and bare things: only the borders differ, and those are what tells."""
        tiles = [plane((0, -1, 0), (0, 0.6, 2), tiled), plane((0, 0, -1), (0, 0, 2.7), plain)]
        balls = [sphere((0.1, -0.05, 1.7), 0.35, plain), sphere((-0.45, 0.35, 1.9), 0.25, plain)]
        rng, true = np.random.default_rng(4), views(tiles + balls, 3)
        given = [ps.Frame(one.color, one.depth * rng.normal(1, 0.002, one.depth.shape), one.camera, one.pose)
                 for one in true]  # fmt: skip
        found, notes = aligned(disturbed(given, 0.02, 0.5))
        assert not notes and max(errors(found, true)) < 5.0

    def test_colours_lead_where_depth_is_noisy(self):
        """The noise of the depth is more than a pixel there, by which brightness would be worth nothing."""
        true = views(two_planes(painted), 3, noise=0.005)
        found, notes = aligned(disturbed(true, 0.02, 0.5))
        assert not notes and max(errors(found, true)) < 3.0

    def test_colours_that_do_not_lie_on_the_depth_do_not_lead(self):
        true = views(corner(), 4, noise=0.001)
        shifts = 0, 22, -22, 14  # pixels, of 160
        colors = [np.roll(one.color, shift, 1) for one, shift in zip(true, shifts, strict=True)]
        given = [ps.Frame(c, f.depth, f.camera, f.pose) for c, f in zip(colors, true, strict=True)]
        found, notes = aligned(disturbed(given, 0.02, 0.5))
        assert len(notes) == 1 and notes[0].startswith("the colours of the frames do not lie on their depth")
        assert max(errors(found, true)) < 2.0

    def test_frames_without_colours_and_one_alone(self):
        true = [ps.Frame(None, one.depth, one.camera, one.pose) for one in views(corner(), 3, noise=0.001)]
        found, notes = aligned(disturbed(true, 0.02, 0.5))
        assert not notes and max(errors(found, true)) < 2.0
        alone, notes = aligned(true[:1])
        assert not notes and same_pose(alone[0], true[0])


class TestWhatNothingFixes:
    """Motions that neither depth nor colours fix stay as given, and a note names them."""

    @pytest.mark.parametrize("noise", [0.0, 0.0015])
    @pytest.mark.parametrize(
        ("scene", "motions"), [(one_plane, 3), (two_planes, 1), (ball_before_plane, 1)], ids=("plane", "planes", "ball")
    )
    def test_of_surfaces_without_texture(self, scene, motions, noise):
        true = views(scene(), 3)
        shown = views(scene(), 3, noise)
        given = disturbed(shown, 0.02, 0.5)
        found, notes = aligned(given)
        assert len(notes) == 1 and f"{motions} motion" in notes[0] and "of 6 (of frame 1: " in notes[0]
        assert max(errors(found, true, off_surface)) < (0.05 if noise == 0 else 0.6)
        for one, other, first in zip(found[1:], given[1:], true[1:], strict=True):
            assert off(one, other) < 2 * off(other, first)

    def test_a_shift_along_both_planes_is_named_in_the_axes_of_the_camera(self):
        _, notes = aligned(disturbed(views(two_planes(), 2), 0.02, 0.5))
        assert "shifts along (0.0, 1.0, 0.0)" in notes[0].replace("-0.1", "0.0").replace("0.1", "0.0")

    def test_poses_do_not_move_along_such_motions(self):
        given = views(one_plane(), 2, noise=0.001)
        pose = given[1].pose.copy()
        pose[:3, 3] += pose[:3, :3] @ np.cross(pose[:3, :3].T @ np.array([0.2, -0.1, -1]), (0, 1, 0)) * 0.03
        found, _ = aligned([given[0], given[1].at(pose)])
        assert off(found[1], given[1].at(pose)) < 0.004


class TestWhatCannotBePlaced:
    """Each ends with the given pose and one sentence; the others are aligned."""

    def spoilt(self, change):
        true = views(corner(), 4, noise=0.001)
        given = disturbed(true, 0.02, 0.5)
        given[2] = given[2].at(change(given[2].pose))
        found, notes = aligned(given)
        assert len(notes) == 1 and "frame 2 of 4" in notes[0] and notes[0].endswith("the given pose stays")
        assert same_pose(found[2], given[2])
        del found, given
        return notes[0]

    def test_a_frame_that_shows_nothing_of_the_others(self):
        assert "shares too little with the others" in self.spoilt(
            lambda pose: np.block([[turned(170, np.array([0, 1, 0])) @ pose[:3, :3], pose[:3, 3:]], [pose[3:]]])
        )

    def test_a_frame_upside_down(self):
        assert "could not be aligned" in self.spoilt(lambda pose: pose @ np.diag([-1, -1, 1, 1]))

    def test_a_frame_30_cm_off(self):
        def shifted(pose):
            pose = pose.copy()
            pose[:3, :3] = turned(9, np.array([1, 2, 1])) @ pose[:3, :3]
            pose[:3, 3] += (0.2, 0.2, -0.1)
            return pose

        assert "could not be aligned" in self.spoilt(shifted)

    def test_the_others_are_right(self):
        true = views(corner(), 4, noise=0.001)
        given = disturbed(true, 0.02, 0.5)
        given[2] = given[2].at(given[2].pose @ np.diag([-1, -1, 1, 1]))
        found, _ = aligned(given)
        assert max(errors(found[:2] + found[3:], true[:2] + true[3:])) < 1.0

    def test_mirrored_poses(self):
        """Here the second frame is 80 cm from where it belongs, the others 35 and 65."""
        true = views(corner(), 4, noise=0.001)
        mirror, first = np.diag([-1, 1, 1, 1]), true[0].pose
        given = [one.at(first @ mirror @ np.linalg.inv(first) @ one.pose @ mirror) for one in true]
        found, notes = aligned(given)
        assert len(notes) == 1 and " of 4 could not be aligned" in notes[0]
        assert all(map(right_or_given, found, given, true))

    def test_two_frames_without_overlap(self):
        first, other = views(corner(), 2)
        pose = other.pose.copy()
        pose[:3, :3] = turned(180, np.array([0, 1, 0])) @ pose[:3, :3]
        found, notes = aligned([first, other.at(pose)])
        assert notes == ["frames 0, 1 of 2 share too little with the others: the given poses stay"]
        assert same_pose(found[1], other.at(pose))

    def test_a_first_frame_that_shows_nothing_of_the_others(self):
        true = views(corner(), 3, noise=0.001)
        pose = true[0].pose.copy()
        pose[:3, :3] = turned(180, np.array([0, 1, 0])) @ pose[:3, :3]
        given = [true[0].at(pose), true[1], *disturbed(true[1:], 0.02, 0.5)[1:]]
        found, notes = aligned(given)
        assert len(notes) == 1 and "frame 0 of 3 shares too little" in notes[0]
        assert max(errors(found[1:], true[1:])) < 1.0

    def test_frames_that_share_nothing_with_the_first_are_aligned_to_each_other(self):
        true = views(corner(), 4, noise=0.001)
        given = disturbed(true, 0.02, 0.5)
        away = np.eye(4)
        away[0, 3] = 20
        given[2:] = [one.at(away @ one.pose) for one in given[2:]]
        found, notes = aligned(given)
        assert not notes and off(found[1], true[1]) < 0.001 and same_pose(found[2], given[2])
        beside = np.linalg.inv(found[2].pose) @ found[3].pose
        assert off(true[3].at(true[2].pose @ beside), true[3]) < 0.001

    @pytest.mark.parametrize("size", [(1, 1), (1, 2), (3, 2), (1, 40), (9, 1), (20, 15)])
    @pytest.mark.parametrize("search", [False, True])
    def test_tiny_frames(self, size, search):
        camera = replace(CAMERA, width=size[1], height=size[0])
        small = [
            ps.Frame(np.full((*size, 3), 9 * k, np.uint8), np.full(size, 2.0), camera, frame.pose)
            for k, frame in enumerate(views(corner(), 2))
        ]
        assert len(ps.align_frames([*small, views(corner(), 1)[0]], search=search, notes=lambda _: None)) == 3

    def test_frames_without_any_point(self):
        first, other = views(corner(), 2)
        empty = ps.Frame(other.color, np.zeros_like(other.depth), other.camera, other.pose)
        for given in ([first, empty], [empty, first], [empty, empty]):
            found, notes = aligned(given)
            assert len(notes) == 1 and same_pose(found[1], given[1])

    def test_the_same_frame_twice_stays_and_hinders_no_other(self):
        true = views(corner(), 2, noise=0.001)
        other = disturbed(true, 0.02, 0.5)[1]
        found, notes = aligned([true[0], true[0], other, true[0]])
        assert not notes and max(errors(found, [true[0], true[0], true[1], true[0]])) < 1.0
        found, notes = aligned([true[0], true[0]])
        assert not notes and off(found[1], true[0]) < 1e-6

    @pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.system) for seed in range(1, 8))])
    def test_far_off_is_right_or_declined(self, seed):
        true = views(corner(), 5, noise=0.001)
        given = disturbed(true, 0.25, 8.0, seed)
        found, _ = aligned(given)
        assert all(map(right_or_given, found, given, true))
