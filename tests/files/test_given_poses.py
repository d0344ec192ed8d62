"""Poses from a file that the caller names, and the file that `save_poses` writes."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.cameras.pose_files import WRITTEN, read_poses
from pointshade_gl.files.finding.folder_cameras import poses_of_inputs
from pointshade_gl.files.writing.maps_and_points import check_poses_path

from ..support import frames
from ..support.layouts.writing import as_json, text, tum_poses
from ..support.view_sets import pose_at, seen_from, write_views

YAWS = (-8, 0, 8)
VIEWS = [seen_from(pose_at(yaw)) for yaw in YAWS]
POSES = [pose_at(yaw + 1, 2) for yaw in YAWS]  # others than in the folder


@pytest.fixture
def walk(tmp_path):
    return write_views(tmp_path / "walk", VIEWS)


@pytest.fixture
def still(tmp_path):
    """A camera that stands still: three frames without poses."""
    folder = write_views(tmp_path / "still", [VIEWS[1]] * 3)
    for path in (folder / "pose").iterdir():
        path.unlink()
    return folder


def named(**poses):
    return {name: np.asarray(pose).tolist() for name, pose in poses.items()}


def opened(folder, poses, notes=None):
    return ps.open_source(folder, poses=poses, notes=(notes if notes is not None else []).append)


def assert_at(sequence, poses, atol=1e-6):
    assert len(sequence) == len(poses)
    for frame, pose in zip(sequence, poses, strict=True):
        np.testing.assert_allclose(frame.pose, np.eye(4) if pose is None else pose, atol=atol)


class TestOfAFolder:
    def test_they_replace_those_in_the_folder(self, walk, tmp_path):
        as_json(tmp_path / "poses.json", named(**{f"{k}.png": POSES[k] for k in (2, 0, 1)}))
        notes = []
        sequence = opened(walk, tmp_path / "poses.json", notes)
        assert_at(sequence, POSES)
        assert sequence.posed == 3 and sequence.poses_from == str(tmp_path / "poses.json")
        assert not any("poses are read from" in note for note in notes)

    def test_a_list_is_in_the_order_of_the_frames(self, walk, tmp_path):
        text(tmp_path / "poses.txt", *(" ".join(map(str, pose.ravel())) for pose in POSES))
        assert_at(opened(walk, tmp_path / "poses.txt"), POSES)

    def test_time_stamps_are_those_of_the_pictures(self, tmp_path):
        folder = write_views(tmp_path / "timed", VIEWS)
        for name in ("color", "depth"):
            for k in range(3):
                (folder / name / f"{k}.png").rename(folder / name / f"{10 + k}.5.png")
        text(tmp_path / "traj.txt", *tum_poses([12.5, 11.9, 11.5, 10.5], [POSES[2], pose_at(40), POSES[1], POSES[0]]))
        assert_at(opened(folder, tmp_path / "traj.txt"), POSES, atol=1e-5)

    def test_load_frame_reads_the_first_frame_with_its_pose(self, walk, tmp_path):
        as_json(tmp_path / "poses.json", named(**{str(k): pose for k, pose in enumerate(POSES)}))
        frame = ps.load_frame(walk, poses=tmp_path / "poses.json", notes=[].append)
        np.testing.assert_allclose(frame.pose, POSES[0])

    def test_a_single_frame_has_one_too(self, tmp_path):
        folder = write_views(tmp_path / "one", VIEWS[:1])
        as_json(tmp_path / "poses.json", [POSES[2].tolist()])
        np.testing.assert_allclose(opened(folder, tmp_path / "poses.json").pose, POSES[2])

    @pytest.mark.parametrize("name", ["pose", "c2w", "w2c", "extrinsics"])
    def test_alone_in_a_file_a_matrix_means_what_its_name_says(self, tmp_path, name):
        """It is no frame's name: `w2c` was taken as camera to world."""
        folder, notes = write_views(tmp_path / "one", VIEWS[:1]), []
        written = POSES[2] if name in ("pose", "c2w") else np.linalg.inv(POSES[2])
        as_json(tmp_path / "poses.json", {name: written.tolist()})
        np.testing.assert_allclose(opened(folder, tmp_path / "poses.json", notes).pose, POSES[2], atol=1e-12)
        assert any("one pose is taken" in note for note in notes)

    def test_of_one_alone_it_is_said_how_it_is_taken_and_how_to_turn_it(self, walk, tmp_path):
        """No other view shows in whose axes it is: with OpenGL's light comes from the wrong side."""
        folder, notes = write_views(tmp_path / "one", VIEWS[:1]), []
        text(tmp_path / "pose.txt", " ".join(map(str, POSES[2].ravel())))
        ps.load_frame(folder, poses=tmp_path / "pose.txt", notes=notes.append)
        ps.load_frame(folder, pose=tmp_path / "pose.txt", notes=notes.append)
        said = [note for note in notes if "one pose is taken as x right, y down, z forward, camera to world" in note]
        assert len(said) == 2 and all("pose @ diag(1, -1, -1, 1)" in note for note in said)
        notes.clear()
        text(tmp_path / "poses.txt", *(" ".join(map(str, pose.ravel())) for pose in POSES))
        opened(walk, tmp_path / "poses.txt", notes)
        ps.save_poses(tmp_path / "ours.txt", VIEWS[:1])
        opened(folder, tmp_path / "ours.txt", notes)
        ps.load_frame(folder, pose=POSES[2], notes=notes.append)
        assert not any("one pose is taken" in note for note in notes)

    def test_a_pose_by_the_folders_name_is_that_of_all_frames(self, still, tmp_path):
        as_json(tmp_path / "poses.json", named(other=POSES[0], still=POSES[1]))
        assert_at(opened(still, tmp_path / "poses.json"), [POSES[1]] * 3)

    def test_names_of_frames_count_before_that_of_the_folder(self, tmp_path):
        folder = write_views(tmp_path / "1", VIEWS)
        as_json(tmp_path / "poses.json", named(**{str(k): pose for k, pose in enumerate(POSES)}))
        assert_at(opened(folder, tmp_path / "poses.json"), POSES)

    def test_a_file_with_many_frames_gets_them_in_order_and_not_its_own(self, tmp_path):
        depth = np.stack([view.depth for view in VIEWS])
        own = np.linalg.inv(np.stack([view.pose for view in VIEWS]))
        camera = np.array([[131, 0, 79.5], [0, 131, 59.5], [0, 0, 1.0]])
        np.savez(tmp_path / "clip.npz", depth=depth, intrinsic=np.stack([camera] * 3), extrinsic=own)
        text(tmp_path / "poses.txt", *(" ".join(map(str, pose.ravel())) for pose in POSES))
        sequence = opened(tmp_path / "clip.npz", tmp_path / "poses.txt")
        assert_at(sequence, POSES)
        assert sequence.poses_from == str(tmp_path / "poses.txt")

    def test_photographs_have_them_by_name(self, walk, tmp_path):
        as_json(tmp_path / "poses.json", named(**{f"{k}.png": pose for k, pose in enumerate(POSES)}))
        shown = {"depth": lambda _: VIEWS[0].depth, "fov": 50, "notes": [].append}
        photos = ps.open_source(walk / "color", poses=tmp_path / "poses.json", **shown)
        assert_at(photos, POSES)

    @pytest.mark.parametrize(
        ("options", "sentence"),
        [
            ({"pose": np.eye(4)}, "pass pose or poses, not both"),
            ({"depth": "depth.png"}, "poses is about the frames of a folder"),
            ({"poses": "none.json"}, "none.json"),
        ],
    )
    def test_what_does_not_go_together_is_one_sentence(self, walk, tmp_path, options, sentence):
        as_json(tmp_path / "poses.json", named(walk=POSES[0]))
        with pytest.raises((ValueError, OSError), match=sentence):
            ps.load_frame(walk, **({"poses": tmp_path / "poses.json"} | options))

    def test_without_a_folder_there_is_nothing_to_pose(self):
        with pytest.raises(ValueError, match="about the frames of a folder"):
            ps.load_frame(depth=VIEWS[0].depth, fov=50, poses="poses.json")

    def test_another_number_says_what_was_found_and_expected(self, walk, tmp_path):
        as_json(tmp_path / "poses.json", named(a=POSES[0], b=POSES[1]))
        with pytest.raises(ValueError, match=r"holds 2 poses \(a, b\), and .*walk has 3 frames: expected one for each"):
            opened(walk, tmp_path / "poses.json")

    def test_a_scene_and_a_cloud_have_none(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3)))
        for source in ("demo", tmp_path / "a.ply"):
            with pytest.raises(ValueError, match="leave out poses"):
                ps.sources.load_any(source, poses="poses.json")


class TestOfSeveralInputs:
    @pytest.mark.parametrize(
        ("names", "inputs", "places"),
        [
            ("AB", ["A", "B"], [0, 1]),
            ("AB", ["B", "A"], [1, 0]),
            ("ABC", ["./C/", "/elsewhere/A"], [2, 0]),
            (["x/cam", "y/cam"], ["y/cam/", "./x/cam"], [1, 0]),
            (["x/cam", "y/cam", "z"], ["z", "x/cam"], [2, 0]),
            (["left", "right"], ["right.npz", "left.npz"], [1, 0]),
            ("AB", ["A", "A"], [0, 0]),
        ],
    )  # fmt: skip
    def test_they_are_found_by_name(self, tmp_path, names, inputs, places):
        poses = [pose_at(10 * k) for k in range(len(names))]
        as_json(tmp_path / "poses.json", named(**dict(zip(names, poses, strict=True))))
        found = poses_of_inputs(tmp_path / "poses.json", inputs)
        assert all((one == poses[k]).all() for one, k in zip(found, places, strict=True))

    @pytest.mark.parametrize(
        ("names", "inputs"),
        [
            ("AB", ["A", "C"]),
            (["x/cam", "y/cam"], ["/p/cam", "/q/cam"]),
            (["cam"], ["x/cam", "y/cam"]),
        ],
    )
    def test_what_is_unclear_is_refused(self, tmp_path, names, inputs):
        as_json(tmp_path / "poses.json", named(**dict.fromkeys(names, np.eye(4))))
        with pytest.raises(ValueError, match=f"expected one for each of 2 INPUTs: {', '.join(inputs)}"):
            poses_of_inputs(tmp_path / "poses.json", inputs)

    def test_without_names_they_are_in_order(self, tmp_path):
        text(tmp_path / "poses.txt", *tum_poses(range(3), POSES))
        for one, pose in zip(poses_of_inputs(tmp_path / "poses.txt", "ABC"), POSES, strict=True):
            np.testing.assert_allclose(one, pose, atol=1e-5)
        with pytest.raises(ValueError, match="holds 3 poses, expected one for each of 2 INPUTs: A, B"):
            poses_of_inputs(tmp_path / "poses.txt", "AB")

    def test_what_is_no_pose_is_named(self, tmp_path):
        as_json(tmp_path / "poses.json", named(A=np.eye(4), B=2 * np.eye(4)))
        with pytest.raises(ValueError, match=r"poses\.json: pose 1 must be camera-to-world"):
            poses_of_inputs(tmp_path / "poses.json", "AB")


class TestWritten:
    def test_they_come_back_to_the_last_digits(self, walk, tmp_path):
        moved = [view.at(pose) for view, pose in zip(VIEWS, POSES, strict=True)]
        ps.save_poses(tmp_path / "poses.txt", moved)
        assert_at(opened(walk, tmp_path / "poses.txt"), POSES, atol=1e-15)
        head, *lines = (tmp_path / "poses.txt").read_text().splitlines()
        assert head.startswith(WRITTEN) and "camera-to-world" in head and "metres" in head
        assert [line.split()[0] for line in lines] == ["0", "1", "2"] and {len(line.split()) for line in lines} == {8}

    def test_some_of_a_folder_belong_to_the_frames_with_these_numbers(self, walk, tmp_path):
        ps.save_poses(tmp_path / "poses.txt", (VIEWS[k].at(POSES[k]) for k in (2, 0)), numbers=[2, 0])
        notes = []
        assert_at(opened(walk, tmp_path / "poses.txt", notes), [POSES[0], None, POSES[2]])
        assert any("has no pose for 1 of 3 pictures" in note for note in notes)

    def test_those_of_another_folder_are_refused(self, walk, tmp_path):
        ps.save_poses(tmp_path / "poses.txt", VIEWS, numbers=[7, 8, 9])
        with pytest.raises(ValueError, match=r"holds 3 poses, and .* has 3 frames"):
            opened(walk, tmp_path / "poses.txt")

    @pytest.mark.parametrize("number", ["nan", "1e300", "x"])
    def test_a_file_that_was_changed_since_raises_no_other_error(self, tmp_path, number):
        ps.save_poses(tmp_path / "poses.txt", VIEWS[:1])
        changed = (tmp_path / "poses.txt").read_text().replace("\n0 ", f"\n{number} ")
        (tmp_path / "poses.txt").write_text(changed)
        try:
            assert len(read_poses(tmp_path / "poses.txt").poses) == 1
        except ValueError as error:
            assert "poses.txt" in str(error)

    @pytest.mark.parametrize(
        ("wrong", "numbers", "sentence"),
        [
            ([], None, "one frame or more"),
            (VIEWS, [1], "a number for each, got 3 and 1"),
            (VIEWS[:1], [-1], "each number must be a whole number"),
            (VIEWS[:1], [0.5], "each number must be a whole number"),
            (["vase"], None, "frame 0 must be a Frame"),
            (7, None, "frames must be an iterable of frames, got 7"),
        ],
    )
    def test_wrong_values_are_one_sentence_and_no_file(self, tmp_path, wrong, numbers, sentence):
        with pytest.raises((TypeError, ValueError), match=sentence):
            ps.save_poses(tmp_path / "poses.txt", wrong, numbers)
        assert not any(tmp_path.iterdir())

    def test_a_place_that_is_none_is_told_before_work(self, tmp_path):
        for path in (tmp_path / "none" / "poses.txt", tmp_path / "poses.json"):
            with pytest.raises((ValueError, OSError), match="cannot write"):
                check_poses_path(path)

    def test_matrices_by_name_are_read_as_the_command_align_writes_them(self, tmp_path):
        (tmp_path / "poses.json").write_text(json.dumps(named(A=POSES[0], B=POSES[1])))
        found = read_poses(tmp_path / "poses.json")
        assert found.names == ["A", "B"] and (found.poses[1] == POSES[1]).all()


def test_a_frame_of_its_own_has_a_pose_file(tmp_path):
    ps.save_poses(tmp_path / "poses.txt", [frames.sphere().at(POSES[0])])
    np.testing.assert_allclose(ps.load_frame("vase", poses=tmp_path / "poses.txt").pose, POSES[0], atol=1e-15)
