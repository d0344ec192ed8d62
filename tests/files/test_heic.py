"""Photographs of phones with depth inside."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.cameras.camera_files import camera_from_exif
from pointshade_gl.files.containers.opening import open_container
from pointshade_gl.files.frames.assembly import read_color

from ..support.heic_files import heic

pytest.importorskip("pillow_heif")

H, W = 96, 128
COLOR = np.zeros((H, W, 3), np.uint8)
COLOR[..., 0], COLOR[..., 1] = np.arange(W), 90
CODES = np.tile(np.arange(64, dtype=np.uint8) * 4, (48, 1))
APPLE = {"low": 0.5, "high": 2.0, "width": 4 * W, "height": 4 * H, "camera": (400, 404, 250.5, 190.5)}


def lens(focal=26, orientation=1):
    exif = Image.Exif()
    exif[0x0112] = orientation
    exif.get_ifd(0x8769)[0xA405] = focal
    return exif.tobytes()


@pytest.fixture
def load(tmp_path):
    """load(...): the frame of such a photograph, and the notes."""

    def call(*arguments, **options):
        (tmp_path / "a.heic").write_bytes(heic(*arguments, **options))
        notes = []
        (frame,) = open_container(tmp_path / "a.heic", notes.append)
        return frame, notes

    return call


def test_a_photograph_typed_alone_brings_its_own_colour_and_camera(tmp_path):
    (tmp_path / "IMG_0001.heic").write_bytes(heic(COLOR, CODES, apple=APPLE))
    notes = []
    frame = ps.load_frame(tmp_path / "IMG_0001.heic", notes=notes.append)
    assert frame.color is not None and frame.color.shape == (H, W, 3) and frame.camera.fx == 50
    np.testing.assert_allclose(frame.depth, 1 / (0.5 + CODES / 255 * 1.5), rtol=1e-5)
    assert len(notes) == 1 and "scaled to the depth's 64x48" in notes[0]


def test_apples_disparity_is_in_metres_and_has_its_camera(load):
    frame, notes = load(COLOR, CODES, apple=APPLE)
    np.testing.assert_allclose(frame.depth, 0.5 + CODES / 255 * 1.5, rtol=1e-6)
    assert frame.depth_kind == "inverse" and frame.depth_scale == 1 and notes == []
    np.testing.assert_allclose(frame.intrinsics.numbers, (100, 101, 62.125, 47.125))  # (x + .5) / 4 - .5, from x - .5
    assert frame.intrinsics.size == (W, H) and frame.intrinsics.depth_kind == "inverse"
    assert np.abs(frame.color.astype(int) - COLOR).max() <= 2


def test_without_apples_words_it_is_relative_and_the_lens_is_the_camera(load):
    frame, notes = load(COLOR, CODES, exif=lens())
    np.testing.assert_array_equal(frame.depth, CODES)
    assert frame.depth_kind == "inverse" and frame.depth_scale is None
    assert frame.intrinsics.numbers[0] == pytest.approx(26 / np.hypot(36, 24) * np.hypot(W, H))
    assert any("taken as inverse depth without a scale" in note for note in notes)
    assert any("the camera is taken from the lens in EXIF" in note for note in notes)


def test_a_photograph_without_depth_says_so_and_is_a_colour_picture(load, tmp_path):
    with pytest.raises(ValueError, match=r"a\.heic has no depth in it: phones add it in portrait mode"):
        load(COLOR, exif=lens())
    assert np.abs(read_color(tmp_path / "a.heic")[..., :3].astype(int) - COLOR).max() <= 2
    assert camera_from_exif(tmp_path / "a.heic").size == (W, H)


def test_a_cut_photograph(tmp_path):
    data = heic(COLOR, CODES, apple=APPLE)
    for length in (300, 1200):
        (tmp_path / "a.heic").write_bytes(data[:length])
        with pytest.raises(ValueError, match=r"a\.heic is a broken or truncated HEIC picture"):
            list(open_container(tmp_path / "a.heic", print))


@pytest.mark.parametrize(
    ("orientation", "is_turned", "camera"),
    [
        (3, True, (100, 101, 64.875, 47.875)),
        (6, True, (101, 100, 47.875, 62.125)),
        (6, False, (101, 100, 47.875, 62.125)),
        (8, True, (101, 100, 47.125, 64.875)),
        (8, False, (101, 100, 47.125, 64.875)),
    ],
)
def test_a_phone_held_upright_turns_colour_depth_and_camera_alike(load, orientation, is_turned, camera):
    frame, _ = load(COLOR, CODES, exif=lens(orientation=orientation), apple=APPLE, is_turned=is_turned)
    np.testing.assert_allclose(frame.intrinsics.numbers, camera)
    red = frame.color[::2, ::2, 0].astype(float)
    assert red.shape == frame.depth.shape and frame.intrinsics.size == frame.color.shape[1::-1]
    assert np.corrcoef(red.ravel(), frame.depth.ravel())[0, 1] > 0.999  # both rise along the sensor's rows
