"""Frames from folders, files and arrays: what is found, what is guessed and printed, what is refused."""

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import builtin_folder
from pointshade_gl.files.cameras.pose_files import load_pose
from pointshade_gl.files.frame_sources import load_any
from pointshade_gl.files.frames.assembly import read_color

V, U = np.mgrid[0:30, 0:40]
DEEP = (900 + 3 * U + 5 * V).astype(np.uint16)
COLOR = np.random.default_rng(5).integers(0, 256, (30, 40, 3), dtype=np.uint8)
INTRINSICS = {"width": 40, "height": 30, "fx": 50, "fy": 50, "cx": 19.5, "cy": 14.5, "depth_scale": 5000}
CAMERA = ps.Camera(50, 50, 19.5, 14.5, 40, 30)


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def save(array, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)


@pytest.fixture
def folder(tmp_path):
    save(COLOR, tmp_path / "color.png")
    save(DEEP, tmp_path / "depth.png")
    (tmp_path / "intrinsics.json").write_text(json.dumps(INTRINSICS))
    return tmp_path


def test_a_folder_becomes_a_frame_without_a_guess(folder):
    frame = ps.load_frame(folder, notes=refuse)
    assert frame.camera == CAMERA
    np.testing.assert_array_equal(frame.color, COLOR)
    np.testing.assert_allclose(frame.depth, DEEP / 5000, rtol=1e-6)
    np.testing.assert_array_equal(frame.pose, np.eye(4))


def test_rgb_and_upper_case_suffixes_are_found(folder):
    (folder / "color.png").rename(folder / "rgb.PNG")
    np.testing.assert_array_equal(ps.load_frame(str(folder), notes=refuse).color, COLOR)


def test_of_several_depths_the_one_that_keeps_the_most_is_taken_and_told(folder):
    notes = []
    np.save(folder / "depth.npy", DEEP.astype(np.float32) + 0.5)
    frame = ps.load_frame(folder, depth_scale=5000, notes=notes.append)
    np.testing.assert_allclose(frame.depth, (DEEP + 0.5) / 5000, rtol=1e-6)
    assert len(notes) == 1 and "depth.npy, depth.png: depth.npy is taken" in notes[0]


def test_a_folder_without_colour_is_told(folder):
    notes = []
    (folder / "color.png").unlink()
    assert ps.load_frame(folder, notes=notes.append).color is None
    assert len(notes) == 1 and "has no colour picture (color.*, rgb.*, image.*): the surface is light grey" in notes[0]


def test_of_a_sequence_the_first_depth_and_its_own_colour_are_taken(tmp_path):
    notes = []
    for i in (2, 1, 3):
        save(DEEP + np.uint16(i), tmp_path / "depth" / f"{i}.png")
    for i in (0, 1, 2):  # the first colour has no depth
        save(COLOR + np.uint8(i), tmp_path / "color" / f"{i}.png")
    (tmp_path / "depth" / "._0.png").write_bytes(b"macOS")
    frame = ps.load_frame(tmp_path, intrinsics=CAMERA, depth_scale=1000, notes=notes.append)
    np.testing.assert_allclose(frame.depth, (DEEP + 1) / 1000, rtol=1e-6)
    np.testing.assert_array_equal(frame.color, COLOR + np.uint8(1))
    assert len(notes) == 2
    assert "1 of 3 depth pictures have no colour picture and are left out" in notes[0]
    assert "is a sequence of 2 frames: 1.png is taken" in notes[1]


def test_files_win_over_the_folder(folder):
    save(DEEP * np.uint16(2), folder / "other.png")
    save(255 - COLOR, folder / "other_color.png")
    camera = ps.Camera(60, 60, 19, 14, 40, 30)
    frame = ps.load_frame(
        folder, color=folder / "other_color.png", depth=folder / "other.png", intrinsics=camera, notes=refuse
    )
    np.testing.assert_allclose(frame.depth, DEEP * 2 / 5000, rtol=1e-6)  # the scale is still the folder's
    np.testing.assert_array_equal(frame.color, 255 - COLOR)
    assert frame.camera == camera


@pytest.mark.parametrize("named", ["second_depth", "../link"])
def test_the_colour_of_a_depth_by_another_path_lies_beside_it(tmp_path, monkeypatch, named):
    """Folders with "depth" in their names may have their colours beside them: another data set's are not taken."""
    for name, color in (("first_depth", 255 - COLOR), ("second_depth", COLOR)):
        save(color, tmp_path / "sets" / name / "color.png")
        save(DEEP, tmp_path / "sets" / name / "depth.png")
        (tmp_path / "sets" / name / "intrinsics.json").write_text(json.dumps(INTRINSICS))
    (tmp_path / "link").symlink_to(tmp_path / "sets" / "second_depth")
    monkeypatch.chdir(tmp_path / "sets")
    frame = ps.load_frame(named, depth=f"{named}/depth.png", notes=refuse)
    np.testing.assert_array_equal(frame.color, COLOR)


def test_arrays_need_no_file():
    frame = ps.load_frame(color=COLOR, depth=DEEP / 1000, intrinsics=CAMERA, notes=refuse)
    np.testing.assert_allclose(frame.depth, DEEP / 1000, rtol=1e-6)
    np.testing.assert_array_equal(frame.color, COLOR)


def test_an_array_of_floats_is_metres_whatever_the_folder_says(folder):
    np.testing.assert_allclose(ps.load_frame(folder, depth=DEEP / 1000, notes=refuse).depth, DEEP / 1000, rtol=1e-6)


def test_fov_stands_in_for_intrinsics():
    frame = ps.load_frame(depth=DEEP / 1000, fov=60, notes=refuse)
    assert frame.camera == ps.Camera.from_fov(60, 40, 30)


def test_the_kind_and_the_baseline_may_come_from_the_file(folder):
    content = INTRINSICS | {"depth_scale": 16, "depth_kind": "disparity", "baseline": 0.1}
    (folder / "intrinsics.json").write_text(json.dumps(content))
    np.testing.assert_allclose(ps.load_frame(folder, notes=refuse).depth, 50 * 0.1 * 16 / DEEP, rtol=1e-6)


def test_a_scale_in_units_per_metre_is_not_applied_to_inverse_depth(folder):
    notes = []
    frame = ps.load_frame(folder, depth_kind="inverse", notes=notes.append)
    assert (frame.depth.min(), frame.depth.max()) == pytest.approx((1, 10))
    assert len(notes) == 1 and "inverse depth has no scale" in notes[0]


def test_guesses_go_to_stderr_unless_a_function_takes_them(capsys):
    ps.load_frame(depth=DEEP, color=np.repeat(COLOR, 2, 0).repeat(2, 1), intrinsics="50,50,19.5,14.5")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and all(line.startswith("note: ") for line in lines)
    assert "taken as millimetres" in lines[0] and "taken as for the depth picture of 40x30" in lines[1]


def test_pictures_of_another_aspect_ratio_are_told():
    notes = []
    ps.load_frame(color=COLOR[:28], depth=DEEP / 1000, fov=60, notes=notes.append)
    assert len(notes) == 1 and "do not look registered" in notes[0]
    ps.load_frame(color=np.repeat(COLOR, 2, axis=0)[:59].repeat(2, axis=1), depth=DEEP / 1000, fov=60, notes=refuse)


@pytest.mark.parametrize("suffix", ["txt", "npy", "json"])
def test_poses_of_every_form(tmp_path, suffix):
    pose = ps.orbit_pose(None, (0, 0, 2), yaw=20, pitch=10)
    path = tmp_path / f"pose.{suffix}"
    if suffix == "npy":
        np.save(path, pose)
    elif suffix == "json":
        path.write_text(json.dumps(pose.tolist(), indent=1))
    else:
        np.savetxt(path, pose)
    np.testing.assert_allclose(load_pose(path), pose, atol=1e-12)
    np.testing.assert_allclose(ps.load_frame(depth=DEEP / 1000, fov=60, pose=path).pose, pose, atol=1e-12)


@pytest.mark.parametrize("content", ["1 0 0 4\n0 1 0 5\n0 0 1 6", "4 5 6 0 0 0 1", "1305031.45 4 5 6 0 0 0 1"])
def test_poses_of_three_rows_or_of_a_place_and_a_quaternion(tmp_path, content):
    (tmp_path / "pose.txt").write_text(content)
    expected = np.eye(4)
    expected[:3, 3] = 4, 5, 6
    np.testing.assert_allclose(load_pose(tmp_path / "pose.txt"), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (
            "1 0 0\n0 1 0\n0 0 1\n",
            r"pose\.txt must hold a matrix of 4x4 or 3x4, or tx ty tz qx qy qz qw, got 9 numbers",
        ),
        ("1 2 3 0 0 0 2", r"pose\.txt must end with qx qy qz qw of length 1, got \[0.0, 0.0, 0.0, 2.0\]"),
        ("1 2 3 0 0 0 0", r"pose\.txt must end with qx qy qz qw of length 1"),
        ("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1", r"pose\.txt must be camera-to-world"),
        ("-inf " * 16, r"pose\.txt must be finite"),
        ("one two", "must hold numbers only"),
    ],
)
def test_poses_that_are_none(tmp_path, content, sentence):
    (tmp_path / "pose.txt").write_text(content)
    with pytest.raises(ValueError, match=sentence):
        load_pose(tmp_path / "pose.txt")


def test_colours_of_every_form_become_8_bit_rgb(tmp_path):
    grey = COLOR[..., 0]
    save(grey, tmp_path / "grey.png")
    save(grey.astype(np.uint16) * 257, tmp_path / "deep.png")
    for name in ("grey.png", "deep.png"):
        np.testing.assert_array_equal(read_color(tmp_path / name), np.stack([grey] * 3, axis=2))


def test_16_bit_colours_are_rounded(tmp_path):
    save(np.array([[0, 128, 129, 65406, 65407, 65535]], np.uint16), tmp_path / "deep.png")
    assert read_color(tmp_path / "deep.png")[0, :, 0].tolist() == [0, 0, 1, 254, 255, 255]


def test_floating_point_colours_are_refused(tmp_path):
    save(COLOR[..., 0].astype(np.float32), tmp_path / "color.tif")
    with pytest.raises(ValueError, match="is a floating point picture, expected colours of 8 or 16 bits"):
        read_color(tmp_path / "color.tif")


@pytest.mark.parametrize(
    ("options", "error", "sentence"),
    [
        ({}, ValueError, "a frame needs depth: pass a folder"),
        ({"depth": DEEP / 1000, "fov": 60, "intrinsics": CAMERA}, ValueError, "pass intrinsics or fov, not both"),
        (
            {"depth": DEEP / 1000, "fov": 60, "depth_kind": "Z"},
            ValueError,
            r"unknown depth_kind 'Z' \(did you mean z\?\)",
        ),
        ({"depth": DEEP * np.nan, "fov": 60}, ValueError, "depth must be known somewhere"),
        ({"depth": DEEP / 1000, "fov": 60, "color": COLOR[..., 0]}, ValueError, r"color must have shape .*\(30, 40\)"),
        ({"depth": "nowhere.png", "fov": 60}, FileNotFoundError, r"nowhere\.png does not exist"),
        ({"folder": "nowhere"}, FileNotFoundError, "there is no folder nowhere"),
        ({"folder": __file__, "color": COLOR}, ValueError, "is not a picture"),
    ],
)
def test_what_is_missing_is_told(options, error, sentence):
    with pytest.raises(error, match=sentence):
        ps.load_frame(**options, notes=refuse)


def test_a_folder_without_depth_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"has no depth picture: expected depth\.png .* or pass depth=FILE"):
        ps.load_frame(tmp_path)


def test_a_built_in_name_is_a_folder_of_the_package_and_any_other_a_path():
    assert builtin_folder("vase").parts[-2:] == ("assets", "vase")
    assert builtin_folder("vase/front") == builtin_folder("vase") != builtin_folder("vase/whole")
    assert builtin_folder("./vase").parts == ("vase",)


def test_a_path_of_a_built_in_name_is_that_name_where_nothing_else_is_called_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    built_in = ps.load_frame("vase")
    np.testing.assert_array_equal(ps.load_frame(Path("vase")).depth, built_in.depth)
    assert isinstance(load_any(Path("demo")), ps.Scene)
    Path("vase").mkdir()
    with pytest.raises(FileNotFoundError, match="vase has no depth picture"):
        ps.load_frame(Path("vase"))
    assert ps.load_frame("vase").depth.shape == built_in.depth.shape  # "./vase" is the folder


def test_a_broken_pose_array_is_refused(tmp_path):
    (tmp_path / "pose.npy").write_bytes(b"\x93NUMPY\x01\x00")
    with pytest.raises(ValueError, match=r"pose\.npy is a broken NumPy file"):
        load_pose(tmp_path / "pose.npy")


@pytest.mark.parametrize("suffix", ["png", "npy"])
def test_a_large_picture_takes_little_more_memory_than_its_frame(tmp_path, suffix):
    """Python's own count: 4 bytes a pixel stay, 42 were needed before pictures were converted in blocks."""
    raw = (1000 + np.arange(1_000_000) % 3000).astype(np.uint16).reshape(1000, 1000)
    if suffix == "png":
        save(raw, tmp_path / "depth.png")
    else:
        np.save(tmp_path / "depth.npy", raw.astype(np.float32) / 1000)
    ps.load_frame(depth=tmp_path / f"depth.{suffix}", fov=50, notes=lambda _: None)  # what is imported late
    tracemalloc.start()
    try:
        ps.load_frame(depth=tmp_path / f"depth.{suffix}", fov=50, notes=lambda _: None)
        assert tracemalloc.get_traced_memory()[1] < 20 * raw.size
    finally:
        tracemalloc.stop()
