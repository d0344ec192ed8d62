"""align=True: poses are corrected once for each object, before it is drawn; cameras of streams share one alignment."""

import itertools
import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation import alignment

from ..support.posed_views import corner, disturbed, off, turned, views

VIEW = {"shading": "none", "samples": 1}


@pytest.fixture(scope="module")
def true():
    return views(corner(), 3, noise=0.001)


@pytest.fixture
def given(true):
    return disturbed(true, 0.02, 0.5)


@pytest.fixture
def renderer():
    with ps.Renderer() as one:
        yield one


@pytest.fixture
def runs(monkeypatch):
    """How many frames were aligned, each time."""
    counted, usual = [], alignment.align
    monkeypatch.setattr(alignment, "align", lambda *args: (counted.append(len(args[0])), usual(*args))[1])
    return counted


class TestPictures:
    def test_the_picture_is_that_of_the_aligned_frames(self, renderer, given):
        found = renderer.align_frames(given)
        picture = renderer.render(given, align=True, **VIEW)
        assert (picture == renderer.render(found, **VIEW)).all()
        assert (picture != renderer.render(given, **VIEW)).any()

    def test_also_in_a_scene_and_for_depth(self, renderer, given):
        found, camera = renderer.align_frames(given), given[0].camera
        scene = ps.Scene((ps.Node(ps.PointObject(given, align=True)),), camera=camera)
        plain = ps.Scene((ps.Node(ps.PointObject(found)),), camera=camera)
        assert (renderer.render(scene) == renderer.render(plain)).all()
        assert (renderer.render_depth(scene) == renderer.render_depth(plain)).all()

    def test_a_single_frame_is_drawn_as_it_is(self, renderer, given, runs):
        assert (renderer.render(given[1], align=True, **VIEW) == renderer.render(given[1], **VIEW)).all() and not runs

    def test_an_object_is_aligned_once(self, renderer, given, runs):
        thing = ps.PointObject(given, align=True)
        for yaw in range(3):
            renderer.render(ps.Scene((ps.Node(thing),), camera=given[0].camera), yaw=yaw)
        assert runs == [3]

    def test_frames_are_aligned_once_for_all_looks(self, renderer, given, runs):
        for look in ({}, {"shading": "flat"}, {"point_size": 2.0}, {"material": ps.Material(ambient=0.4)}, {}):
            renderer.render(given, align=True, **{**VIEW, **look})
        assert runs == [3]
        renderer.render(given, align=True, normals="central", **VIEW)  # other normals fix other poses
        assert runs == [3, 3]

    def test_frames_of_a_renderer_that_ends_are_freed(self, given):
        import weakref

        one = ps.Frame(given[2].color, given[2].depth, given[2].camera, given[2].pose)
        left = weakref.ref(one)
        with ps.Renderer() as renderer:
            renderer.render([given[0], one], align=True, **VIEW)
        del renderer, one
        import gc

        gc.collect()
        assert left() is None

    def test_progress_counts_each_frame_and_level_and_ends(self, renderer, given):
        told = []
        renderer.render(given, align=True, progress=lambda *done: told.append(done), **VIEW)
        assert [done for done, _ in told] == sorted(done for done, _ in told)
        assert len({every for _, every in told}) == 1 and told[-1][0] == told[-1][1] > 2 * 3 + 3
        told.clear()
        renderer.align_frames(given, progress=lambda *done: told.append(done))
        assert told[-1] == (10, 10) and told[0] == (1, 10)

    def test_it_can_be_cancelled_and_done_again(self, renderer, given, true):
        for end in range(1, 8):
            with pytest.raises(ps.Cancelled):
                renderer.align_frames(given, progress=lambda done, all, end=end: done < end)
        assert off(renderer.align_frames(given)[1], true[1]) < 0.001

    @pytest.mark.parametrize("wrong", [None, 3, [], ["vase"]])
    def test_anything_but_frames_is_refused(self, renderer, wrong):
        with pytest.raises((TypeError, ValueError)):
            renderer.align_frames(wrong)

    def test_frames_share_their_arrays(self, renderer, given):
        for one, other in zip(renderer.align_frames(given), given, strict=True):
            assert one.depth is other.depth and one.color is other.color


class TestWords:
    def test_corrections_overlap_and_residuals_are_explained(self, renderer, given):
        renderer.render(given, align=True, **VIEW)
        lines = [line for line in renderer.explain(["a", "b", "c"]) if line.startswith("aligned")]
        assert lines[0] == "aligned: 2 of 2 poses corrected; that of frame a stays"
        assert re.fullmatch(
            r"aligned: frame b by \d+\.?\d* mm and 0\.\d+ degrees; overlap \d\d%, depths differ by 0\.\d+ % before, "
            r"0\.0\d+ % after, 100% agree",
            lines[1],
        )
        assert len(lines) == 3 and lines[2].startswith("aligned: frame c by ")
        renderer.render(given, **VIEW)
        assert not any("aligned" in line for line in renderer.explain())

    def test_the_corrected_frames_can_be_had(self, renderer, given, true):
        renderer.render(given, align=True, **VIEW)
        found = renderer.aligned
        assert list(found) == given and off(found[given[1]], true[1]) < 0.001
        renderer.render(given, **VIEW)
        assert renderer.aligned == {}

    def test_what_cannot_be_placed_is_noted(self, renderer, given):
        notes = []
        given[2] = given[2].at(given[2].pose @ np.diag([-1, -1, 1, 1]))
        renderer.render(given, align=True, notes=notes.append, **VIEW)
        assert any("frame 2 of 3 could not be aligned" in note for note in notes)


def streamed(frames, seed=0, noise=0.001):
    """The next frames of the same cameras: other noise."""
    rng = np.random.default_rng(seed)
    noises = (rng.normal(0, noise, frame.depth.shape) * (frame.depth > 0) for frame in frames)
    return [
        ps.Frame(frame.color, frame.depth + noise, frame.camera, frame.pose, source=k)
        for k, (frame, noise) in enumerate(zip(frames, noises, strict=True))
    ]


class TestLiveSets:
    def draw(self, renderer, frames, **options):
        return renderer.render(frames, align=True, **VIEW, **options)

    @pytest.mark.system
    def test_still_cameras_are_aligned_once_and_refined_ever_more_seldom(self, renderer, given, runs):
        for k in range(20):
            self.draw(renderer, streamed(given, k))
        assert runs == [3, 3, 3]  # sets 1, 4 and 16

    def test_a_frame_without_depth_is_no_camera_that_was_moved(self, renderer, given, true, runs):
        notes, dark = [], ps.Frame(None, np.zeros_like(given[2].depth), given[2].camera, given[2].pose)
        for k in range(7):
            frames = streamed([*given[:2], dark if k in (2, 3, 5) else given[2]], k)
            self.draw(renderer, frames, notes=notes.append)
        assert not [note for note in notes if "moved" in note] and runs == [3, 3]
        assert off(renderer.aligned[frames[2]], true[2]) < 0.001

    def test_a_camera_that_gives_no_depth_at_first_is_aligned_soon(self, renderer, given, true):
        dark = ps.Frame(None, np.zeros_like(given[2].depth), given[2].camera, given[2].pose)
        for k in range(5):
            frames = streamed([*given[:2], dark if k < 2 else given[2]], k)
            self.draw(renderer, frames)
        assert off(renderer.aligned[frames[2]], true[2]) < 0.001

    def test_corrections_are_explained_against_the_given_poses_after_refining(self, renderer, given):
        first = None
        for k in range(5):
            self.draw(renderer, streamed(given, k))
            lines = [line for line in renderer.explain() if line.startswith("aligned: frame 1")]
            first = first or lines
        assert first[0].split(" after")[0].rpartition(",")[0] == lines[0].split(" after")[0].rpartition(",")[0]

    def test_nothing_is_aligned_while_nothing_is_new(self, renderer, given, runs):
        thing = ps.PointObject(streamed(given), align=True)
        for _ in range(20):
            self.draw(renderer, thing.frames)
        assert len(runs) <= 3

    @pytest.mark.system
    def test_refining_brings_poses_nearer(self, renderer, true, given):
        errors = []
        for k in range(16):
            frames = streamed(given, k, noise=0.02)
            self.draw(renderer, frames)
            errors.append(max(off(renderer.aligned[a], b) for a, b in zip(frames, true, strict=True)))
        assert errors[15] < errors[0] < 0.01

    def test_a_camera_that_was_moved_is_told_and_aligned_again(self, renderer, true, given, runs):
        notes = []
        for k in range(6):
            self.draw(renderer, streamed(given, k), notes=notes.append)
        assert not [note for note in notes if "moved" in note] and runs == [3, 3]
        moved = ps.orbit_pose(None, (0, 0.1, 2.0), 20, 5)
        from pointshade_gl.bench.tracing import as_frame, trace  # the camera sees from elsewhere, nobody says so

        new = as_frame(trace(corner(), given[2].camera, moved), given[2].camera, given[2].pose)
        for k in range(6, 9):
            self.draw(renderer, streamed([*given[:2], new], k), notes=notes.append)
        assert len([note for note in notes if note.startswith("the camera of frame 2 was moved")]) == 1
        assert runs == [3, 3, 3]
        frames = streamed([*given[:2], new], 9)
        self.draw(renderer, frames)
        assert off(renderer.aligned[frames[2]], true[2].at(moved)) < 0.002


def test_a_frame_at_another_pose_is_the_same_but_for_it(true):
    frame, pose = true[1], np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned(30, np.array([0, 1, 0])), (1, 2, 3)
    pivot = frame.pivot
    moved = frame.at(pose)
    assert moved.depth is frame.depth and moved.camera is frame.camera and (moved.pose == pose).all()
    assert moved != frame and not np.allclose(moved.pivot, pivot)
    same = ps.Frame(frame.color, frame.depth, frame.camera, pose)
    assert all((getattr(moved, name) == getattr(same, name)).all() for name in ("pivot", "pose"))
    with pytest.raises(ValueError, match="pose"):
        frame.at(np.zeros((4, 4)))
    assert len(set(itertools.chain([moved], [frame]))) == 2
