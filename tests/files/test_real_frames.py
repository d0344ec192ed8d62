"""The readers on real files: a frame of every sensor, and every odd kind of file that users have."""

import shutil

import numpy as np
import pytest

import pointshade_gl as ps

pytestmark = pytest.mark.data


def load(folder, **options):
    """A frame, its known depths in metres, the notes."""
    notes = []
    frame = ps.load_frame(folder, notes=notes.append, **options)
    return frame, frame.depth[frame.depth > 0], notes


@pytest.mark.parametrize(
    ("name", "points", "median"),
    [
        ("tum_fr3_kinect1", 248250, 2.415),
        ("realsense_box_2", 298949, 0.832),
        ("realsense_box_6", 296598, 1.282),
        ("stereo_glass_reflections", 266860, 0.859),
        ("stereo_metal_floor", 296359, 1.099),
        ("d435_table_exr_halffloat", 728943, 0.582),
        ("d2nt_3f2n_gt_normals", 102989, 167.041),
    ],
)
def test_frames_of_every_sensor_are_read_without_a_guess(shared_data, name, points, median):
    frame, depths, notes = load(shared_data / name)
    assert notes == []
    assert frame.points_known == points
    assert np.median(depths) == pytest.approx(median, abs=0.001)
    assert frame.color is not None and frame.color.shape[:2] == frame.depth.shape


def test_the_clipped_sky_is_missing_and_counted(shared_data):
    _, depths, notes = load(shared_data / "stereo_skatepark_65520")
    assert depths.max() < 25 and depths.size == 640 * 480 - 32942 - 14492  # zeros, clipped values
    assert notes == ["14492 depth values from 65400 to 65535 are taken as missing"]


def test_colour_intrinsics_are_scaled_to_the_phones_small_depth(shared_data):
    frame, depths, notes = load(shared_data / "iphone_lidar_promptda")
    assert frame.camera.intrinsics == pytest.approx((1390 / 7.5, 1390 / 7.5, 127.5, 95.5))
    assert depths.size == 256 * 192 and 1.5 < depths.min() < depths.max() < 3.6
    assert len(notes) == 1 and "for the color of 1920x1440, scaled to the depth's 256x192" in notes[0]


def test_a_sequence_gives_its_first_view(shared_data):
    folder = shared_data / "icl_livingroom_23views"
    frame, depths, notes = load(folder)
    assert np.median(depths) == pytest.approx(1.845, abs=0.001)
    assert notes[0] == "poses are read from poses_tum.txt, not from trajectory.log, transforms.json"
    assert len(notes) == 2 and "is a sequence of 23 frames: 000.png is taken" in notes[1]
    assert frame.camera.cx == 319.5


def test_nerfstudio_counts_half_a_pixel_on(shared_data):
    folder = shared_data / "icl_livingroom_23views"
    ours, nerfstudio = ps.load_frame(folder), ps.load_frame(folder, intrinsics=folder / "transforms.json")
    assert nerfstudio.camera.intrinsics == (525, 525, 319, 239)
    np.testing.assert_allclose(nerfstudio.depth, ours.depth, rtol=1e-6)


def test_the_raw_background_of_a_renderer_is_recognised(shared_data):
    folder = shared_data / "d2nt_3f2n_gt_normals"
    raw = np.fromfile(folder / "depth.bin", "<f4").reshape(480, 640)  # background 1.0, the object at 160..192
    frame, _, notes = load(folder, depth=raw)
    np.testing.assert_array_equal(frame.depth, ps.load_frame(folder).depth)
    assert len(notes) == 1 and "the depth value 1 of 66% of the pixels is taken as background" in notes[0]


def test_odd_pgm_wrong_endian_kinect2_is_read_byte_swapped(shared_data):
    _, depths, notes = load(shared_data / "odd_pgm_wrong_endian_kinect2")
    assert (np.median(depths), depths.max()) == pytest.approx((1.071, 7.993), abs=0.001)
    assert len(notes) == 2 and "no colour" in notes[0] and "wrong byte order" in notes[1]


def test_odd_colorised_depth_png_is_read_back_and_the_true_one_read(shared_data):
    folder = shared_data / "odd_colorised_depth_png"
    frame, _, notes = load(folder, depth=folder / "depth.png")
    assert len(notes) == 1 and "colour-mapped picture of depth (jet)" in notes[0] and "red is far" in notes[0]
    true, depths, notes = load(folder)
    assert (
        len(notes) == 1
        and "depth_true.png is taken as the depth, not depth.png" in notes[0]
        and depths.size == 640 * 480 - 1513
    )
    assert (depths.min(), depths.max()) == pytest.approx((0.971, 7.854))
    np.testing.assert_array_equal(frame.depth > 0, true.depth > 0)
    ratio = frame.depth[true.depth > 0] / depths
    assert np.quantile(ratio / np.median(ratio), (0.05, 0.95)) == pytest.approx((1, 1), abs=0.06)


def test_odd_android_depth16_is_read_and_its_preview_refused(shared_data):
    folder = shared_data / "odd_android_depth16"
    with pytest.raises(
        ValueError, match=r"is a colour picture, not depth, nor depth colour-mapped by .*: pass depth \(16-bit"
    ):
        ps.load_frame(folder, depth=folder / "depth_rgba_preview.png")
    _, raw, notes = load(folder, depth=folder / "depth16.bin")
    assert any("Android's DEPTH16: millimetres in the low 13 bits" in note for note in notes)
    _, depths, _ = load(folder, depth=folder / "depth16_from_author.png", depth_scale=5000)
    assert np.median(depths) == pytest.approx(2.342, abs=0.001)
    assert np.median(raw) == pytest.approx(2.342, abs=0.01)
    _, _, notes = load(folder)
    assert any("are spaced like TUM's: pass depth_scale=5000" in note for note in notes)


def test_odd_color_16bit_rgba_becomes_8_bits(shared_data):
    folder = shared_data / "odd_color_16bit_rgba"
    frame, depths, notes = load(folder, depth=folder / "disparity_like.exr", depth_kind="inverse")
    assert frame.color is not None and frame.color.shape == (256, 256, 4) and frame.color.dtype == np.uint8
    assert (depths.min(), depths.max()) == pytest.approx((1, 10))
    assert len(notes) == 1 and "inverse depth has no scale" in notes[0]


@pytest.mark.parametrize("name", ["depth.npy", "depth.png"])
def test_odd_lfs_pointer_says_how_to_get_the_file(shared_data, tmp_path, name):
    shutil.copy(shared_data / "odd_lfs_pointer" / "depth.npy", tmp_path / name)
    with pytest.raises(ValueError, match=r"is a git-LFS pointer, not the file itself: run `git lfs pull`"):
        ps.load_frame(tmp_path)
