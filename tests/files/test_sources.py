"""Streams of frames: sequences on disk and their poses, decoding ahead, what is skipped and what is refused."""

import json
import threading
import time
from collections.abc import Sequence

import numpy as np
import pytest
from PIL import Image
from pytest import approx

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import builtin_folder
from pointshade_gl.files.cameras.camera_files import read_transforms
from pointshade_gl.files.frame_sources import open_source, prefetched
from pointshade_gl.files.frames.sequences import FrameSequence

DEEP = (900 + 3 * np.arange(40) + 5 * np.arange(30)[:, None]).astype(np.uint16)
COLOR = np.zeros((30, 40, 3), np.uint8)
CAMERA = ps.Camera(50, 50, 19.5, 14.5, 40, 30)
OPTIONS = {"intrinsics": CAMERA, "depth_scale": 1000}


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def only_where_poses_are_from(text):
    assert text.startswith("poses are read from "), text


def save(array, path):
    path.parent.mkdir(exist_ok=True, parents=True)
    Image.fromarray(array).save(path)


def write(folder, count, depth="depth/{:03d}.png", color="color/{:03d}.png", first=0):
    """Frame k is 0.9 m + k mm away at its upper left and has colours of value k."""
    for k in range(count):
        save(DEEP + np.uint16(k), folder / depth.format(first + k))
        save(COLOR + np.uint8(k), folder / color.format(first + k))


def numbers(frames):
    """Which frames these are, by their depth; their colours must agree."""
    found = [round(float(frame.depth[0, 0]) * 1000) - 900 for frame in frames]
    assert [int(frame.color[0, 0, 0]) for frame in frames] == found
    return found


@pytest.mark.parametrize(
    ("depth", "color"),
    [
        ("depth/{:03d}.png", "color/{:03d}.png"),
        ("depth/{}.png", "rgb/{}.bmp"),  # 10 comes after 9
        ("depth/depth{}.png", "color/color{}.png"),
        ("depth_{:04d}.png", "color_{:04d}.png"),
        ("{:04d}.depth.png", "{:04d}.rgb.png"),
        ("frame-{:06d}.depth.png", "frame-{:06d}.color.png"),
    ],
)
def test_a_folder_of_many_frames_is_a_sequence_in_their_order(tmp_path, depth, color):
    write(tmp_path, 12, depth, color)
    source = open_source(tmp_path, **OPTIONS, notes=refuse)
    assert isinstance(source, FrameSequence) and len(source) == 12
    assert numbers(source) == list(range(12))
    assert numbers([source[7], source[-1]]) == [7, 11]
    assert numbers(source[2:5]) == [2, 3, 4]
    assert all(frame.camera == CAMERA for frame in source[:2])
    with pytest.raises(IndexError):
        source[12]


def test_a_folder_of_one_frame_is_that_frame(tmp_path):
    write(tmp_path, 1, "depth.png", "color.png")
    assert numbers([open_source(tmp_path, **OPTIONS, notes=refuse)]) == [0]
    write(tmp_path, 3)
    assert numbers([open_source(tmp_path, **OPTIONS, notes=refuse)]) == [0]


def test_a_sequence_of_one_is_a_frame(tmp_path):
    write(tmp_path, 1)
    assert numbers([open_source(tmp_path, **OPTIONS, notes=refuse)]) == [0]


def test_a_built_in_name_and_single_files_are_frames(tmp_path):
    assert isinstance(open_source("vase"), ps.Frame)
    write(tmp_path, 2)
    assert isinstance(open_source(None, depth=tmp_path / "depth/001.png", **OPTIONS), ps.Frame)
    frame = open_source(tmp_path, depth=tmp_path / "depth/001.png", **OPTIONS, notes=lambda _: None)
    assert numbers([frame]) == [1]


def test_the_built_in_vase_from_all_sides_begins_with_its_front(capsys):
    front, frames = ps.load_frame("vase"), open_source("vase/whole")
    assert len(frames) == 11 and frames[0].camera == front.camera and np.array_equal(frames[0].color, front.color)
    np.testing.assert_allclose(frames[0].depth, front.depth, rtol=0, atol=1e-5)
    np.testing.assert_allclose(frames[0].pose, front.pose, atol=1e-12)
    assert {frame.camera for frame in frames} == {front.camera}
    turns = [np.degrees(np.arccos((np.trace(frame.pose[:3, :3]) - 1) / 2)) for frame in frames]
    assert min(turns[1:]) > 30 and max(turns) > 150
    assert capsys.readouterr().err == ""  # how they are read is no news


def test_all_sides_of_the_vase_add_little_to_the_package():
    files = [file for file in builtin_folder("vase/whole").rglob("*") if file.is_file()]
    assert len(files) == 23 and sum(file.stat().st_size for file in files) < 1.5e6


def test_files_are_read_when_they_are_asked_for(tmp_path):
    write(tmp_path, 5)
    source = open_source(tmp_path, **OPTIONS)
    (tmp_path / "depth/003.png").unlink()
    assert numbers([source[1], source[4]]) == [1, 4]
    with pytest.raises(OSError, match=r"^frame 3: .*003\.png does not exist$"):
        source[3]


@pytest.mark.parametrize("content", [b"", b"no picture at all", b"\x89PNG\r\n\x1a\n half of one"])
def test_an_unreadable_frame_is_one_sentence_with_its_number(tmp_path, content):
    write(tmp_path, 5)
    (tmp_path / "depth/003.png").write_bytes(content)
    with pytest.raises(ValueError, match=r"^frame 3: .*003\.png is "):
        open_source(tmp_path, **OPTIONS)[3]


def test_a_frame_without_any_depth_is_named(tmp_path):
    write(tmp_path, 4)
    save(DEEP * np.uint16(0), tmp_path / "depth/001.png")
    with pytest.raises(ValueError, match=r"^frame 1: .*001\.png: depth must be known somewhere"):
        open_source(tmp_path, **OPTIONS)[1]


def test_what_is_wrong_with_all_frames_is_said_on_opening(tmp_path):
    write(tmp_path, 4)
    with pytest.raises(ValueError, match=r"frame 0: .*disparity needs the distance of the two cameras"):
        open_source(tmp_path, depth_kind="disparity")
    with pytest.raises(ValueError, match="unknown depth_kind 'sonar'"):
        open_source(tmp_path, **OPTIONS, depth_kind="sonar")
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        open_source(tmp_path / "nowhere")


def test_a_broken_first_frame_does_not_hide_the_others(tmp_path):
    write(tmp_path, 4)
    (tmp_path / "depth/000.png").write_bytes(b"")
    assert numbers(open_source(tmp_path, **OPTIONS)[1:]) == [1, 2, 3]


def test_each_kind_of_note_is_told_once(tmp_path):
    notes = []
    write(tmp_path, 6)
    list(open_source(tmp_path, intrinsics=CAMERA, notes=notes.append))
    assert len(notes) == 1 and "taken as millimetres" in notes[0]


class TestPairing:
    def test_names_that_only_one_side_has_are_left_out_and_told(self, tmp_path):
        notes = []
        write(tmp_path, 6)
        (tmp_path / "color/002.png").unlink()
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        assert numbers(source) == [0, 1, 3, 4, 5]
        assert notes == [f"{tmp_path}: 1 of 6 depth pictures have no colour picture and are left out"]

    def test_of_two_forms_of_a_depth_the_one_that_keeps_the_most_is_taken(self, tmp_path):
        write(tmp_path, 2)
        np.save(tmp_path / "depth/001.npy", (DEEP + 0.25).astype(np.float32))
        assert open_source(tmp_path, **OPTIONS)[1].depth[0, 0] == approx(0.90025)

    def test_time_stamps_pair_where_names_do_not(self, tmp_path):
        notes = []
        for k in range(5):
            save(DEEP + np.uint16(k), tmp_path / f"depth/{100 + k / 30:.6f}.png")
        for k in range(-1, 4):  # 10 ms later, one colour more before, none for the last depth
            save(COLOR + np.uint8(k % 256), tmp_path / f"color/{100.01 + k / 30:.6f}.png")
        (tmp_path / f"color/{100.01 + 2 / 30:.6f}.png").unlink()
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        assert len(source) == 5 and numbers([source[0], source[1], source[3]]) == [0, 1, 3]
        assert "paired by the nearest time stamp, up to 0.0233 apart" in notes[0]

    def test_a_depth_picture_far_from_any_colour_is_left_out(self, tmp_path):
        notes = []
        for k in range(5):
            save(DEEP + np.uint16(k), tmp_path / f"depth/{100 + k / 30:.6f}.png")
            save(COLOR + np.uint8(k), tmp_path / f"color/{(100.01 if k < 3 else 200) + k / 30:.6f}.png")
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        assert len(source) == 4 and numbers(source[:3]) == [0, 1, 2]
        assert "1 of 5 depth pictures have no colour picture" in notes[1]

    def test_order_pairs_as_many_of_both(self, tmp_path):
        notes = []
        write(tmp_path, 3, "depth/d{}x.png", "color/c{}y1.png")
        assert numbers(open_source(tmp_path, **OPTIONS, notes=notes.append)) == [0, 1, 2]
        assert notes == [f"{tmp_path}: depth and colour are paired by order, their names do not match"]

    def test_what_cannot_be_paired_is_refused(self, tmp_path):
        write(tmp_path, 3, "depth/d{}.png", "color/c{}y1.png")
        (tmp_path / "color/c1y1.png").unlink()
        with pytest.raises(
            ValueError, match=r"has 3 depth and 2 colour pictures .* give the two of a frame the same name"
        ):
            open_source(tmp_path, **OPTIONS)

    def test_without_colours_the_surface_is_light_grey(self, tmp_path):
        notes = []
        for k in range(3):
            save(DEEP + np.uint16(k), tmp_path / f"depth/{k}.png")
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        assert len(source) == 3 and source[2].color is None
        assert len(notes) == 1 and "the surface is light grey" in notes[0]


def tum_lines(poses, start=100.0, every=1 / 30):
    lines = ["# ground truth trajectory", "# timestamp tx ty tz qx qy qz qw"]
    for k, (angle, x) in enumerate(poses):
        half = np.radians(angle) / 2
        lines.append(f"{start + k * every:.6f} {x} 0 0 0 {np.sin(half):.9f} 0 {np.cos(half):.9f}")
    return "\n".join(lines)


def turned(angle, x):
    """A turn round y, x right and z forward, then a step to the right."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([[c, 0, s, x], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


class TestPoses:
    WAY = ((0, 0.0), (10, 0.1), (20, 0.2))

    def check(self, folder, notes=None):
        source = open_source(folder, **OPTIONS, notes=only_where_poses_are_from if notes is None else notes.append)
        np.testing.assert_allclose([frame.pose for frame in source], [turned(*step) for step in self.WAY], atol=1e-6)

    def test_tum_lists_time_stamps_and_ground_truth(self, tmp_path):
        notes = []
        depth_list, color_list = ["# depth maps"], ["# color images", "# file: 'a bag'"]
        for k in range(3):
            depth_list.append(f"{100 + k / 30:.6f} depth/{100 + k / 30:.6f}.png")
            color_list.append(f"{100.004 + k / 30:.6f} rgb/{100.004 + k / 30:.6f}.png")
            save(DEEP + np.uint16(k), tmp_path / depth_list[-1].split()[1])
            save(COLOR + np.uint8(k), tmp_path / color_list[-1].split()[1])
        save(DEEP, tmp_path / "depth/1.png")  # not in the list
        (tmp_path / "depth.txt").write_text("\n".join(depth_list))
        (tmp_path / "rgb.txt").write_text("\n".join(color_list))
        denser = [(angle / 10, angle / 1000) for angle in range(-100, 301)]  # a tenth of a degree each
        (tmp_path / "groundtruth.txt").write_text(tum_lines(denser, 100 - 1 / 30, 1 / 3000))
        self.check(tmp_path, notes)
        assert numbers(open_source(tmp_path, **OPTIONS)) == [0, 1, 2]
        assert "nearest time stamp, up to 0.004 apart" in notes[0]
        assert notes[1:] == ["poses are read from groundtruth.txt"]

    def test_names_in_lists_may_have_spaces(self, tmp_path):
        for folder, array in (("depth", DEEP), ("rgb", COLOR)):
            save(array, tmp_path / folder / "one view.png")
            save(array, tmp_path / folder / "other.png")
            lines = f"0.5 {folder}/one view.png\n1.5 2.5 {folder}/other.png\n"  # two numbers are of another file
            (tmp_path / f"{folder}.txt").write_text(lines)
        frame = open_source(tmp_path, **OPTIONS)
        np.testing.assert_array_equal(frame.color, COLOR)

    def test_tum_poses_by_number_and_by_order(self, tmp_path):
        write(tmp_path, 3)
        (tmp_path / "poses_tum.txt").write_text(tum_lines(self.WAY, 0, 1))
        self.check(tmp_path)
        (tmp_path / "poses_tum.txt").write_text(tum_lines(self.WAY, 1305031102, 1))
        self.check(tmp_path)

    def test_a_picture_without_a_pose_near_in_time_gets_the_nearest_and_it_is_told(self, tmp_path):
        notes = []
        write(tmp_path, 3)
        (tmp_path / "groundtruth.txt").write_text(tum_lines([(0, 0.0), (40, 0.4)], 0, 1.9))
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        np.testing.assert_allclose([frame.pose[0, 3] for frame in source], [0, 0.4, 0.4])
        assert "2 of 3 pictures have no pose within 0.02 s and get the nearest" in notes[0]

    def test_open3d_log(self, tmp_path):
        write(tmp_path, 3)
        blocks = [
            f"{k} {k} {k + 1}\n" + "\n".join(" ".join(map(str, row)) for row in turned(*step).tolist())
            for k, step in enumerate(self.WAY)
        ]
        (tmp_path / "trajectory.log").write_text("\n".join(blocks) + "\n")
        self.check(tmp_path)

    def test_nerfstudio_has_opengl_axes_and_may_give_the_camera_too(self, tmp_path):
        write(tmp_path, 3)
        flip = np.diag([1, -1, -1, 1])
        frames = [
            {"file_path": f"color/{k:03d}.png", "transform_matrix": (turned(*self.WAY[k]) @ flip).tolist()}
            for k in (2, 0, 1)
        ]
        camera = {"fl_x": 50, "fl_y": 50, "cx": 20, "cy": 15, "w": 40, "h": 30}
        (tmp_path / "transforms.json").write_text(json.dumps(camera | {"frames": frames}))
        self.check(tmp_path)
        source = open_source(tmp_path, notes=lambda _: None)
        assert source[1].camera == CAMERA and source[1].depth[0, 0] == approx(0.901)

    def test_transforms_are_in_the_order_of_their_numbers(self, tmp_path):
        frames = [{"file_path": f"color/{k}.png", "transform_matrix": np.eye(4).tolist()} for k in (10, 2, 1)]
        (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
        found = [one.color for one in read_transforms(tmp_path / "transforms.json")]
        assert found == ["color/1.png", "color/2.png", "color/10.png"]

    def test_frames_that_transforms_do_not_name_stay_at_the_origin_and_it_is_told(self, tmp_path):
        notes = []
        write(tmp_path, 3)
        frames = [{"file_path": "color/001.png", "transform_matrix": np.diag([1, -1, -1, 1]).tolist()}]
        (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
        open_source(tmp_path, **OPTIONS, notes=notes.append)
        assert len(notes) == 2 and "has no pose for 2 of 3 pictures" in notes[0]

    def test_another_number_of_poses_is_not_used_and_it_is_told(self, tmp_path):
        notes = []
        write(tmp_path, 3)
        (tmp_path / "trajectory.log").write_text("0 0 1\n" + "\n".join("0 0 0 0" for _ in range(4)))
        source = open_source(tmp_path, **OPTIONS, notes=notes.append)
        np.testing.assert_array_equal(source[1].pose, np.eye(4))
        assert len(notes) == 1 and "has 1 poses for 3 frames: it is not used" in notes[0]

    @pytest.mark.parametrize(
        ("name", "content", "sentence"),
        [
            (
                "groundtruth.txt",
                "0 1 2 3\n",
                r"groundtruth\.txt holds no poses: expected t x y z qx qy qz qw, or .* got rows of 4",
            ),
            ("groundtruth.txt", "# nothing\n", r"groundtruth\.txt holds no poses"),
            ("trajectory.log", "0 0 1\n1 0 0 0\n", r"trajectory\.log holds no poses"),
            ("transforms.json", "{", "is not valid JSON"),
            ("transforms.json", '{"frames": [{"file_path": "a"}]}', "must have a transform_matrix of 4x4 numbers"),
        ],
    )
    def test_files_of_poses_that_hold_none(self, tmp_path, name, content, sentence):
        write(tmp_path, 3)
        (tmp_path / name).write_text(content)
        with pytest.raises(ValueError, match=sentence):
            open_source(tmp_path, **OPTIONS)

    def test_a_frame_whose_pose_was_lost_is_left_out_and_it_is_told(self, tmp_path):
        notes = []
        write(tmp_path, 3)
        (tmp_path / "groundtruth.txt").write_text("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0\n2 0 0 0 0 0 0 1\n")
        assert numbers(open_source(tmp_path, **OPTIONS, notes=notes.append)) == [0, 2]
        assert "1 of 3 frames have lost their pose (it is not finite): left out" in notes[1]


class TestRealSequence:
    pytestmark = pytest.mark.data

    def test_the_three_files_of_poses_agree(self, shared_data, tmp_path):
        room = shared_data / "icl_livingroom_23views"
        poses = {}
        for name in ("poses_tum.txt", "trajectory.log", "transforms.json"):
            folder = tmp_path / name
            folder.mkdir()
            for part in ("color", "depth", "intrinsics.json", name):
                (folder / part).symlink_to(room / part)
            source = open_source(folder, notes=only_where_poses_are_from)
            poses[name] = [frame.pose for frame in source[::7]]
        np.testing.assert_allclose(poses["trajectory.log"], poses["poses_tum.txt"], atol=2e-7)
        np.testing.assert_allclose(poses["transforms.json"], poses["poses_tum.txt"], atol=2e-7)

    def test_points_of_neighbouring_views_lie_on_each_other(self, shared_data):
        """View 1's points, carried into view 0, find view 0's depth there."""
        a, b = open_source(shared_data / "icl_livingroom_23views", notes=lambda _: None)[:2]
        v, u = np.mgrid[0:480:4, 0:640:4]
        z = b.depth[::4, ::4].astype(float)
        points = np.stack([(u - 319.5) / 525 * z, (v - 239.5) / 525 * z, z, np.ones_like(z)], -1)[z > 0]
        x, y, z, _ = np.linalg.inv(a.pose) @ b.pose @ points.T
        column, row = np.rint(525 * x / z + 319.5).astype(int), np.rint(525 * y / z + 239.5).astype(int)
        seen = (column >= 0) & (column < 640) & (row >= 0) & (row < 480)
        error = np.abs(a.depth[row[seen], column[seen]] - z[seen])
        assert seen.mean() > 0.5 and np.median(error) < 0.015


def constant(distance=1.0):
    return ps.Frame(None, np.full((3, 4), distance, np.float32), ps.Camera(5, 5, 1.5, 1, 4, 3))


def distances(frames):
    return [round(float(frame.depth[0, 0])) for frame in frames]


class Slow(Sequence):
    """Its later frames are ready before its earlier ones."""

    def __init__(self, count, bad=()):
        self.count, self.bad, self.read, self.threads = count, bad, [], set()

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        if k >= self.count:
            raise IndexError(k)
        self.threads.add(threading.get_ident())
        self.read.append(k)
        time.sleep(0.002 * (3 - k % 4))
        if k in self.bad:
            raise self.bad[k]
        return constant(k + 1)


@pytest.fixture
def decoding():
    """The threads that decode, without those of tests before, which may still be ending."""
    before = set(threading.enumerate())
    return lambda: [one for one in set(threading.enumerate()) - before if one.name.startswith("pointshade-decode")]


class TestPrefetched:
    @pytest.mark.parametrize("ahead", [1, 2, 5])
    def test_frames_come_in_their_order(self, decoding, ahead):
        source = Slow(20)
        assert distances(prefetched(source, refuse, ahead)) == list(range(1, 21))
        assert threading.get_ident() not in source.threads and len(source.threads) <= ahead
        assert not decoding()

    def test_no_more_than_asked_is_read_ahead(self, decoding):
        source = Slow(50)
        frames = prefetched(source, refuse, 3)
        for _ in range(4):
            next(frames)
        time.sleep(0.05)
        assert max(source.read) <= 3 + 3
        frames.close()
        assert not decoding()

    def test_the_frame_after_is_decoded_while_this_one_is_used(self):
        source = Slow(5)
        frames = prefetched(source, refuse)
        next(frames)
        deadline = time.monotonic() + 5
        while len(source.read) < 3 and time.monotonic() < deadline:
            time.sleep(0.001)
        assert sorted(source.read) == [0, 1, 2]
        frames.close()

    @pytest.mark.parametrize("error", [ValueError("frame 4: broken"), OSError("frame 4: broken")])
    def test_an_unreadable_frame_is_skipped_with_one_sentence_in_its_place(self, error):
        told = []
        frames = prefetched(Slow(8, {4: error}), told.append)
        assert distances(next(frames) for _ in range(4)) == [1, 2, 3, 4] and not told
        assert distances(frames) == [6, 7, 8]
        assert told == ["frame 4: broken"]

    def test_other_errors_go_through_and_the_threads_end(self, decoding):
        frames = prefetched(Slow(8, {2: KeyError("a bug")}), refuse)
        with pytest.raises(KeyError, match="a bug"):
            list(frames)
        assert not decoding()

    def test_leaving_the_loop_ends_the_threads(self, decoding):
        for frame in prefetched(Slow(1000), refuse):
            if frame.depth[0, 0] == 3:
                break
        assert not decoding()

    def test_any_iterable_will_do(self):
        assert distances(prefetched((constant(k) for k in (3, 1, 2)), refuse)) == [3, 1, 2]
        assert distances(prefetched(iter([]), refuse)) == []

    def test_what_an_iterator_gives_is_passed_on_be_it_none(self, decoding):
        first, last = constant(3), constant(1)
        assert list(prefetched(iter([None, first, None, last]), refuse)) == [None, first, None, last]
        assert not decoding()

    def test_a_camera_that_stumbles_goes_on(self, decoding):
        class Camera:
            """Has no length, and no end."""

            def __init__(self):
                self.count = 0

            def __iter__(self):
                return self

            def __next__(self):
                self.count += 1
                if self.count == 2:
                    raise OSError("nothing came for 5 s")
                return constant(self.count)

        told = []
        frames = prefetched(Camera(), told.append)
        assert distances(next(frames) for _ in range(3)) == [1, 3, 4]
        assert told == ["nothing came for 5 s"]
        frames.close()
        assert not decoding()

    def test_a_folder_with_a_broken_frame_in_the_middle(self, tmp_path):
        told = []
        write(tmp_path, 7)
        (tmp_path / "color/003.png").write_bytes(b"")
        assert numbers(list(prefetched(open_source(tmp_path, **OPTIONS), told.append))) == [0, 1, 2, 4, 5, 6]
        assert len(told) == 1 and "frame 3: " in told[0] and "003.png is empty" in told[0]
