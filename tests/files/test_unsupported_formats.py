"""What is no depth is refused by a sentence that says what it is and what to do; nobody else's camera is taken."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps


@pytest.mark.parametrize(
    ("name", "head", "says"),
    [
        ("a.bag", b"#ROSBAG V2.0\n", "a ROS bag: write its colour and depth topics as PNG"),
        ("a.mcap", b"\x89MCAP0\r\n", "a ROS 2 bag"),
        ("a.svo2", b"\0" * 20, "ZED_SVO_Export"),
        ("a.klg", b"\x10\0\0\0" * 9, "ElasticFusion"),
        ("a.sens", b"\4\0\0\0" * 9, "SensReader"),
        ("a.PLY", b"ply\n", "a point cloud: it has no pictures: .* load_cloud reads it"),
        ("a.obj", b"v 0 0 0\n", "a model: .* glTF"),
        ("a.mp4", b"\0\0\0\x18ftypmp42", "a video: pass the folder"),
        ("a.pt", b"PK\3\4", r"save its depth as \.npy"),
        ("a.tar.gz", b"\x1f\x8b", "an archive: unpack it"),
    ],
)
def test_a_recording_or_model_is_named_with_the_way_out(tmp_path, name, head, says):
    (tmp_path / name).write_bytes(head)
    with pytest.raises(ValueError, match=says):
        ps.open_source(tmp_path / name)


def test_a_folder_with_a_recording_names_it(tmp_path):
    (tmp_path / "run 1.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(FileNotFoundError, match=r"no depth picture.*run 1\.bag is a ROS bag: write"):
        ps.open_source(tmp_path)


def test_a_folder_of_photographs_says_where_a_depth_comes_from(tmp_path):
    Image.new("RGB", (40, 30), "red").save(tmp_path / "holiday.jpg")
    with pytest.raises(
        FileNotFoundError, match=r"holiday\.jpg is a photograph: a network makes its depth: download model"
    ):
        ps.open_source(tmp_path)


def test_an_empty_folder_is_called_empty(tmp_path):
    with pytest.raises(FileNotFoundError, match="it is empty"):
        ps.open_source(tmp_path)


def test_a_photograph_alone_is_no_depth(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "photo.png")
    with pytest.raises(
        ValueError, match=r"photo\.png is a photograph: a network makes its depth: .*; or pass it as color=FILE"
    ):
        ps.load_frame(tmp_path / "photo.png", fov=60)


def test_the_camera_of_another_frame_beside_a_file_is_not_taken(tmp_path):
    depth = np.full((30, 40), 1500, np.uint16)
    depth[5:9] = 1200
    (tmp_path / "other").mkdir()
    for folder in (tmp_path, tmp_path / "other"):
        Image.fromarray(depth).save(folder / "depth.png")
    (tmp_path / "other/intrinsics.json").write_text(json.dumps({"fx": 50, "fy": 50, "cx": 19.5, "cy": 14.5}))
    assert ps.load_frame(tmp_path / "depth.png", notes=lambda _: None).camera.fx != 50
