"""Faults that properties and damaged files have found, each by its smallest input. Warnings are errors here, too."""

import json
import struct
import tracemalloc

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.cameras.camera_files import read_colmap_images, read_intrinsics
from pointshade_gl.files.cameras.intrinsics import Intrinsics, from_colmap, place_camera
from pointshade_gl.files.cameras.pose_files import read_poses
from pointshade_gl.files.depth.missing_depth import scale_of_values
from pointshade_gl.files.pictures.video import read_video_frame
from pointshade_gl.scene.settings import OutputSettings

from ..support.hostile_files import DEPTH, sequence


def quiet(_):
    pass


def test_nans_that_signal_are_missing(tmp_path):
    depth = (DEPTH / 1000).astype(np.float32)
    depth.view(np.uint32)[2, 3] = 0x7F800001
    np.save(tmp_path / "depth.npy", depth)
    assert ps.load_frame(depth=tmp_path / "depth.npy", fov=60, notes=quiet).points_known == 47


def test_images_of_colmap_that_promise_more_points_than_numbers_reach(tmp_path):
    row = struct.pack("<Qi7di", 2, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"a.png\0" + struct.pack("<Q", 2**64 - 1)
    (tmp_path / "images.bin").write_bytes(row + bytes(99))
    with pytest.raises(ValueError, match=r"images\.bin holds no images of COLMAP's$"):
        read_colmap_images(tmp_path / "images.bin")


@pytest.mark.parametrize("numbers", ["1e999 480 500 320 240", "640 nan 500 320 240", "640 480 500 320"])
def test_a_camera_of_colmap_with_impossible_numbers_is_none(numbers):
    assert from_colmap(f"1 PINHOLE {numbers}", "cameras.txt") == {}


def test_a_camera_file_whose_first_line_is_empty(tmp_path):
    (tmp_path / "camera.txt").write_text("\nword 1\n")
    with pytest.raises(ValueError, match=r"camera\.txt"):
        read_intrinsics(tmp_path / "camera.txt", quiet)


def test_a_camera_of_a_picture_without_rows_is_named():
    with pytest.raises(ValueError, match=r"^cameras\.bin: intrinsics are for 320x0 pixels: there is no such picture$"):
        place_camera(Intrinsics("cameras.bin", (300, 300, 160, 120), (320, 0)), (320, 240), None, quiet)


def test_infinite_poses_are_read_and_left_to_the_check(tmp_path):
    cells = {f"t_{row}{column}": 1e999 if row == column else 0 for row in range(3) for column in range(4)}
    (tmp_path / "pose.json").write_text(json.dumps(cells))
    assert not np.isfinite(read_poses(tmp_path / "pose.json").poses).all()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # imageio-ffmpeg leaves pipes to Python
def test_a_broken_video_is_told_in_one_line(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    (tmp_path / "a.mp4").write_bytes(b"\0" * 99)
    with pytest.raises(ValueError, match=r"a\.mp4 is not a video that ffmpeg can read: [^\n]*$"):
        read_video_frame(tmp_path / "a.mp4", 0)


def test_one_tiny_value_does_not_cost_the_memory_of_a_million():
    values = np.concatenate([[1], np.arange(2500, 3000)])
    tracemalloc.start()
    assert scale_of_values(values, np.ones_like(values), 2750.0, 640 * 480) is None
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 50e6


def test_a_list_whose_first_picture_is_missing_gives_the_next(tmp_path):
    folder = tmp_path / "rgbd_dataset_freiburg1_desk"
    folder.mkdir()
    sequence(folder)
    (folder / "intrinsics.json").unlink()
    for name in ("depth/1.png", "depth/2.png"):
        Image.fromarray(np.full((480, 640), 5000, np.uint16)).save(folder / name)
    (folder / "depth" / "0.png").unlink()
    (folder / "depth.txt").write_text("".join(f"{k}.0 depth/{k}.png\n" for k in range(3)))
    frame = ps.load_frame(folder, notes=quiet)
    assert frame.camera.fx == 517.3 and frame.scale == 1


def test_a_picture_that_memory_does_not_hold_is_named(tmp_path, monkeypatch):
    Image.fromarray(DEPTH).save(tmp_path / "depth.png")

    def load(_):
        raise MemoryError

    monkeypatch.setattr("PIL.ImageFile.ImageFile.load", load)
    with pytest.raises(MemoryError, match=r"depth\.png: there is not enough memory to decode it$"):
        ps.load_frame(depth=tmp_path / "depth.png", fov=60)


def test_a_background_may_be_an_array():
    assert OutputSettings(background=np.array([1, 0, 0.5])) == OutputSettings(background=(1, 0, 0.5))


def test_other_frames_that_are_none_are_named():
    frame = ps.Frame(None, np.ones((4, 5)), ps.Camera(9, 9, 2, 2, 5, 4))
    with pytest.raises(TypeError, match=r"^others must be a sequence of frames, got 5$"):
        ps.PointObject(frame, others=5)


@pytest.mark.parametrize("depth", [1e-40, 1e-19, 1.1e18, 3e38])
def test_depth_whose_square_no_shader_holds_is_missing(renderer, depth):
    frame = ps.Frame(None, np.full((4, 5), depth), ps.Camera(9, 9, 2, 2, 5, 4))
    assert not frame.depth.any() and not renderer.render(frame, yaw=10).any()
    assert np.isnan(renderer.estimate_normals(frame)).all()


@pytest.mark.parametrize("unit", [1e-17, 1e17])
def test_depth_of_any_other_unit_is_drawn(renderer, unit):
    plane = 1 + 0.02 * np.arange(20).reshape(4, 5)
    camera, light = ps.Camera(9, 9, 2, 2, 5, 4), ps.Light(direction=(1, 1, 1))
    image, other = (renderer.render(ps.Frame(None, plane * scale, camera), light, yaw=10) for scale in (1, unit))
    assert np.abs(image.astype(int) - other).max() <= 1
