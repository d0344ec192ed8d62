"""The poses of a sequence are corrected frame by frame, in films and in Python."""

import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.cameras.pose_files import read_poses
from pointshade_gl.pipeline import aligned_poses as pose_track
from pointshade_gl.renderer.series import sequence_jobs

from ..support.posed_views import MIDDLE, ball_before_plane, corner, off, turned, view_from
from ..support.view_sets import write_views

COUNT = 10


@pytest.fixture(scope="module")
def true():
    rng = np.random.default_rng(5)
    return [view_from(corner(), ps.orbit_pose(None, MIDDLE, 3.0 * k - 12, k / 2), 0.001, rng) for k in range(COUNT)]


@pytest.fixture(scope="module")
def drifting(true):
    """Each frame is off by 4 mm and .15 degrees more than the one before, in any direction."""
    rng, drift, found = np.random.default_rng(6), np.eye(4), true[:1]
    for frame in true[1:]:
        step, way = np.eye(4), rng.normal(0, 1, 3)
        step[:3, :3], step[:3, 3] = turned(0.15, rng.normal(0, 1, 3)), 0.004 * way / np.linalg.norm(way)
        drift = step @ drift
        found.append(frame.at(drift @ frame.pose))
    return found


def followed(renderer, frames):
    notes = []
    return list(renderer.align_sequence(frames, notes=notes.append)), notes


def worst(frames, true):
    return max(off(one, other) for one, other in zip(frames, true, strict=True))


def test_drift_is_taken_out(renderer, true, drifting):
    found, notes = followed(renderer, drifting)
    assert worst(drifting, true) > 0.01 and worst(found, true) < 0.0015 and not notes
    assert all(one.depth is other.depth for one, other in zip(found, drifting, strict=True))


def test_a_camera_that_moves_slowly_needs_no_poses(renderer, true):
    found, notes = followed(renderer, [one.at(true[0].pose) for one in true])
    assert worst(found, true) < 0.0015 and not notes


def test_right_poses_stay(renderer, true):
    found, notes = followed(renderer, true)
    assert worst(found, true) < 0.0015 and not notes


@pytest.mark.system
def test_keyframes_are_few(renderer, true, monkeypatch):
    monkeypatch.setattr(pose_track, "MOST_KEYFRAMES", 2)
    found, _ = followed(renderer, true * 2)
    assert worst(found, true * 2) < 0.002


def test_a_frame_that_fits_none_is_noted_once_and_moved_as_the_last(renderer, true, drifting):
    empty = [ps.Frame(None, np.zeros_like(one.depth), one.camera, one.pose) for one in drifting[4:6]]
    found, notes = followed(renderer, [*drifting[:4], *empty, *drifting[6:]])
    assert len(notes) == 1 and "fits none before it" in notes[0]
    last = found[3].pose @ np.linalg.inv(drifting[3].pose)
    assert all(np.allclose(one.pose, last @ given.pose) for one, given in zip(found[4:6], empty, strict=True))
    assert worst([*found[:4], *found[6:]], [*true[:4], *true[6:]]) < 0.0015


def test_many_frames_without_depth_are_not_what_others_are_aligned_to(renderer, true, drifting):
    empty = [ps.Frame(None, np.zeros_like(one.depth), one.camera, one.pose) for one in drifting[4:5]] * 20
    found, _ = followed(renderer, [*drifting[:4], *empty, *drifting[6:]])
    assert worst([*found[:4], *found[-4:]], [*true[:4], *true[6:]]) < 0.0015


def test_a_camera_that_is_elsewhere_goes_on_from_there(renderer, true, drifting):
    away = np.eye(4)
    away[0, 3] = 30
    rng = np.random.default_rng(2)
    others = [view_from(ball_before_plane(), one.pose, 0.001, rng).at(away @ one.pose) for one in true]
    found, notes = followed(renderer, [*drifting[:3], *others])
    assert len(notes) == 1 and len(found) == 3 + len(others)


def test_what_is_asked_wrongly_is_said_at_once(renderer, true):
    with pytest.raises(TypeError, match=r"align_sequence.*did you mean noise"):
        renderer.align_sequence(true, noize=0.01)
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'shading'"):
        renderer.align_frames(true, shading="flat")
    for method in (renderer.align_sequence, renderer.align_frames):
        with pytest.raises(ValueError, match="arrays belong to one frame"):
            method(true, noise=np.full((120, 160), 0.01))


def test_frames_come_one_by_one(renderer, drifting):
    asked = []

    def source():
        for k, frame in enumerate(drifting):
            asked.append(k)
            yield frame

    frames = renderer.align_sequence(source())
    assert not asked and next(frames) is drifting[0] and asked == [0]
    with pytest.raises(TypeError, match="what the source gives"):
        list(renderer.align_sequence([drifting[0], "vase"]))


def test_films_are_drawn_with_corrected_poses(renderer, true, drifting):
    view = ps.View(look=ps.Appearance(shading="none", align=True), pose=true[4].pose)
    jobs = [job for _, job in sequence_jobs(drifting, view, print, renderer)]
    assert worst([job.source for job in jobs], true) < 0.0015
    own = [job for _, job in sequence_jobs(drifting, ps.View(look=view.look), print, renderer)]
    assert all(np.array_equal(job.pose, job.source.pose) for job in own)  # who looks goes along


def test_a_film_on_the_command_line_saves_its_poses(typed, tmp_path, true, drifting):
    write_views(tmp_path / "walk", drifting[:5])
    pose = ",".join(f"{value:.9g}" for value in drifting[1].pose.ravel())
    for name, more in (("given", ""), ("aligned", "--align --save-poses poses.txt"), ("again", "--poses poses.txt")):
        code, out, errors = typed(f"render walk -o {name}%d.png --pose {pose} --shading none --samples 1 {more}")
        assert code == 0, errors
        assert (name == "aligned") == ("poses.txt: 5 poses" in out)
        told = re.search(r"note: 4 poses corrected by up to [\d.]+ mm and [\d.]+ degrees; that of the first", errors)
        assert (name == "aligned") == bool(told)
    given, aligned, again = ((tmp_path / f"{name}4.png").read_bytes() for name in ("given", "aligned", "again"))
    assert given != aligned and again == aligned
    found = read_poses(tmp_path / "poses.txt").poses
    assert worst([one.at(pose) for one, pose in zip(drifting, found, strict=False)], true[:5]) < 0.0015
