"""Intrinsics: every form that users bring, and the picture they belong to."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.cameras.camera_files import read_intrinsics
from pointshade_gl.files.cameras.intrinsics import Intrinsics, place_camera

K = [[500, 0, 320.5], [0, 510, 240.25], [0, 0, 1]]
NUMBERS = (500, 510, 320.5, 240.25)
K4 = np.eye(4)
K4[:3, :3] = K


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def write(path, content):
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


@pytest.mark.parametrize(
    "source",
    ["500,510,320.5,240.25", "500 510 320.5 240.25", NUMBERS, list(NUMBERS), np.array(NUMBERS), K, K4],
    ids=["commas", "blanks", "tuple", "list", "array", "matrix", "matrix 4x4"],
)
def test_numbers_and_matrices(source):
    intrinsics = read_intrinsics(source, refuse)
    assert intrinsics.numbers == NUMBERS
    assert intrinsics.size is None


@pytest.mark.parametrize("matrix", [K, K4.tolist()], ids=["3x3", "4x4"])
def test_text_files_with_a_matrix(tmp_path, matrix):
    text = "# color camera\n" + "\n".join(" ".join(map(str, row)) for row in matrix) + "\n"
    assert read_intrinsics(write(tmp_path / "intrinsic.txt", text), refuse).numbers == NUMBERS


def test_a_column_major_matrix_is_recognised_and_told(tmp_path):
    notes = []
    path = write(tmp_path / "arkit.txt", "500 0 0\n0 510 0\n320.5 240.25 1\n")
    assert read_intrinsics(path, notes.append).numbers == NUMBERS
    assert len(notes) == 1 and "rows and columns of the matrix are exchanged" in notes[0]


def test_our_json_carries_size_scale_kind_and_baseline(tmp_path):
    content = {"width": 640, "height": 480, "fx": 500, "fy": -510, "cx": 320.5, "cy": 240.25}
    path = write(tmp_path / "a.json", content | {"depth_scale": 5000, "depth_kind": "ray", "baseline": 0.1})
    intrinsics = read_intrinsics(path, refuse)
    assert intrinsics.numbers == (500, -510, 320.5, 240.25)
    assert (intrinsics.size, intrinsics.depth_scale) == ((640, 480), 5000)
    assert (intrinsics.depth_kind, intrinsics.baseline) == ("ray", 0.1)


@pytest.mark.parametrize("nested", [False, True], ids=["intrinsic", "camera parameters"])
def test_open3d_json_is_column_major(tmp_path, nested):
    content = {"width": 640, "height": 480, "intrinsic_matrix": [500, 0, 0, 0, 510, 0, 320.5, 240.25, 1]}
    path = write(tmp_path / "a.json", {"extrinsic": [], "intrinsic": content} if nested else content)
    intrinsics = read_intrinsics(path, refuse)
    assert (intrinsics.numbers, intrinsics.size) == (NUMBERS, (640, 480))


def test_nerfstudio_json_counts_from_the_corner_and_scales_the_other_way(tmp_path):
    content = {"fl_x": 500, "fl_y": 510, "cx": 321, "cy": 240.75, "w": 640, "h": 480, "depth_unit_scale_factor": 0.0002}
    intrinsics = read_intrinsics(write(tmp_path / "transforms.json", content), refuse)
    assert (intrinsics.numbers, intrinsics.size) == (NUMBERS, (640, 480))
    assert intrinsics.depth_scale == pytest.approx(5000)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ('{"fx": 5,', "is not valid JSON"),
        ({"fx": 500, "cx": 3}, "holds no camera: expected fx, fy, cx, cy, or a 3x3 matrix .* it has fx, cx"),
        ({"fx": "a", "fy": 1, "cx": 1, "cy": 1}, "holds no camera: .* it has fy, cx, cy"),
        ({"fx": 1, "fy": 1, "cx": 1, "cy": 1, "width": 6.5, "height": 4}, "width and height must be whole numbers"),
        ({"intrinsic_matrix": [1, 2, 3]}, "holds no camera: .* it has intrinsic_matrix"),
        ("focal length: large", "must hold numbers only"),
        ("1 2 3", r"intrinsics\.json must hold fx, fy, cx, cy or a matrix of 3x3 or 4x4, got 3 numbers"),
        ("1 2 3 4 5 6 7 8 9", r"must be a matrix \[\[fx, 0, cx\]"),
        ("", "is empty"),
        ("version https://git-lfs.github.com/spec/v1\n", "run `git lfs pull`"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(tmp_path, content, sentence):
    with pytest.raises(ValueError, match=sentence):
        read_intrinsics(write(tmp_path / "intrinsics.json", content), refuse)


def test_a_binary_file_is_no_text(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(ValueError, match="is not a text file"):
        read_intrinsics(tmp_path / "a.txt", refuse)


def test_a_missing_file_is_named():
    with pytest.raises(FileNotFoundError, match=r"nothing\.json does not exist"):
        read_intrinsics("nothing.json", refuse)


@pytest.mark.parametrize("source", ["500,510,320", (1, 2, 3)])
def test_three_numbers_are_no_intrinsics(source):
    with pytest.raises(ValueError, match="got 3 numbers"):
        read_intrinsics(source, refuse)


def test_other_objects_are_no_intrinsics():
    with pytest.raises(TypeError, match=r"intrinsics must be a file, .* or a Camera, got {'fx': 1}"):
        read_intrinsics({"fx": 1}, refuse)


def test_a_camera_of_the_depth_picture_is_taken_as_it_is():
    camera = ps.Camera(*NUMBERS, 640, 480)
    assert place_camera(read_intrinsics(camera, refuse), (640, 480), (1280, 960), refuse) == camera


def test_a_camera_of_the_colour_picture_is_scaled_to_the_depth():
    notes = []
    camera = ps.Camera(*NUMBERS, 640, 480)
    assert place_camera(read_intrinsics(camera, refuse), (160, 120), (640, 480), notes.append) == camera.resized(
        160, 120
    )
    assert len(notes) == 1 and "for the color of 640x480, scaled to the depth's 160x120" in notes[0]


@pytest.mark.parametrize(("color", "seen"), [((320, 200), "color is 320x200"), (None, "there is no color")])
def test_a_camera_of_neither_picture_is_refused(color, seen):
    intrinsics = read_intrinsics(ps.Camera(*NUMBERS, 640, 480), refuse)
    with pytest.raises(ValueError, match=f"for 640x480 pixels, but depth is 160x100 and {seen}"):
        place_camera(intrinsics, (160, 100), color, refuse)


def test_a_camera_of_the_same_view_at_another_size_is_scaled_and_it_is_told():
    notes = []
    camera = ps.Camera(*NUMBERS, 640, 480)
    assert place_camera(read_intrinsics(camera, refuse), (160, 120), None, notes.append) == camera.resized(160, 120)
    assert len(notes) == 1 and "for 640x480 pixels, scaled to the depth's 160x120" in notes[0]


def test_numbers_without_a_size_belong_to_the_depth_picture_and_it_is_told():
    notes = []
    camera = place_camera(read_intrinsics(NUMBERS, refuse), (640, 480), (1280, 960), notes.append)
    assert camera == ps.Camera(*NUMBERS, 640, 480)
    assert len(notes) == 1 and "taken as for the depth picture of 640x480" in notes[0]


def test_numbers_that_only_fit_the_colour_picture_belong_to_it():
    notes = []
    camera = place_camera(read_intrinsics(NUMBERS, refuse), (160, 120), (640, 480), notes.append)
    assert camera == ps.Camera(*NUMBERS, 640, 480).resized(160, 120)
    assert "taken as for the color picture of 640x480" in notes[0]


def test_a_principal_point_outside_every_picture_of_its_shape_is_refused():
    with pytest.raises(ValueError, match=r"principal point \(320.5, 240.25\) must lie in the depth picture of 160x90"):
        place_camera(read_intrinsics(NUMBERS, refuse), (160, 90), None, refuse)


def test_a_camera_of_a_picture_that_was_turned_is_turned_and_it_is_told():
    notes = []
    upright = Intrinsics("K.txt", (500, 510, 230, 330), (480, 640))
    lying = place_camera(upright, (640, 480), None, notes.append)
    assert (lying.fx, lying.fy, lying.cx, lying.cy) == (510, 500, 330, 249)
    assert "K.txt is for 480x640 and the picture is turned: the camera is turned, too" in notes[0]
    back = place_camera(Intrinsics("K.txt", (510, 500, 330, 249), (640, 480)), (480, 640), None, notes.append)
    assert (back.fx, back.fy, back.cx, back.cy) == (500, 510, 230, 330)


def test_a_square_camera_or_one_of_another_shape_is_not_turned():
    with pytest.raises(ValueError, match="intrinsics are for 300x640 pixels"):
        place_camera(Intrinsics("K.txt", (500, 500, 150, 320), (300, 640)), (640, 480), None, lambda _: None)


def test_a_fourth_line_with_a_factor_and_a_range_is_a_depth_scale(tmp_path):
    path = tmp_path / "K.txt"
    path.write_text("1216.73000,0,639.5000\n0,1216.73000,479.5000\n0,0,1\n2,0,9870")
    found = read_intrinsics(path, lambda _: None)
    assert found.numbers == (1216.73, 1216.73, 639.5, 479.5)
    assert found.depth_scale == pytest.approx(65535 / 9.87)
