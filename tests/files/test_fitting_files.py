"""Files that fit each other: cameras of another size are scaled, other recordings left alone, numbers come first."""

import json

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.cameras.intrinsics import Intrinsics, place_camera
from pointshade_gl.notes.notes import Doubt

from ..support.painted_room import CAMERA, FOCAL, HEIGHT, WIDTH, millimetres, seen, write

COLOR, DEPTH = seen()
RIGHT = FOCAL, FOCAL, CAMERA["cx"], CAMERA["cy"]


def load(source, **options):
    notes = []
    return ps.load_frame(source, notes=notes.append, **options), notes


def doubts(notes):
    return [one for one in notes if isinstance(one, Doubt)]


def of_size(width, height, corner=0.0):
    """K of the same view at another size; pixels counted from their centres, or from the picture's corner (0.5)."""
    across, down = width / WIDTH, height / HEIGHT
    return [FOCAL * across, FOCAL * down, (width - 1) / 2 + corner, (height - 1) / 2 + corner]


@pytest.mark.parametrize("size", [(640, 480), (480, 360), (160, 120), (1280, 960), (256, 192), (1920, 1440)])
@pytest.mark.parametrize("corner", [0.0, 0.5])
def test_a_camera_of_another_size_is_scaled_and_said(tmp_path, size, corner):
    folder = write(tmp_path / "a", COLOR, DEPTH, None)
    fx, fy, cx, cy = of_size(*size, corner)
    np.savetxt(folder / "intrinsics.txt", [[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    frame, notes = load(folder)
    assert frame.camera.intrinsics == pytest.approx(RIGHT, abs=0.6 * WIDTH / size[0] + 0.5)
    assert len(doubts(notes)) == 1 and f"is for {size[0]}x{size[1]} pixels by its principal point" in doubts(notes)[0]


@pytest.mark.parametrize("size", [(640, 480), (480, 360), (1280, 960)])
@pytest.mark.parametrize("off", [(0.012, -0.02), (-0.018, 0.01), (0.015, 0.012)])
def test_a_measured_camera_whose_center_is_off_is_scaled_by_the_usual_ratio(size, off):
    fx, fy, cx, cy = of_size(*size)
    notes = []
    numbers = fx, fy, cx + off[0] * size[0], cy + off[1] * size[1]
    camera = place_camera(Intrinsics("K.txt", numbers), (WIDTH, HEIGHT), (WIDTH, HEIGHT), notes.append)
    assert camera.fx == pytest.approx(FOCAL) and camera.cx == pytest.approx(CAMERA["cx"] + off[0] * WIDTH, abs=0.3)
    assert len(doubts(notes)) == 1


@pytest.mark.parametrize(("cx", "cy"), [(318.6, 255.3), (339.5, 242.7), (300.0, 260.0), (350.0, 210.0)])
def test_measured_centers_of_the_same_size_are_kept(cx, cy):
    notes = []
    camera = place_camera(Intrinsics("K.txt", (525, 525, cx, cy)), (640, 480), (640, 480), notes.append)
    assert camera.intrinsics == (525, 525, cx, cy) and not notes


def test_a_file_that_states_its_size_is_believed_and_doubted(tmp_path):
    folder = write(tmp_path / "a", COLOR, DEPTH, {**CAMERA, "cx": 319.5, "cy": 239.5})
    frame, notes = load(folder)
    assert frame.camera.cx == 319.5
    assert len(doubts(notes)) == 1 and "(319.5, 239.5) is far from the middle of 320x240" in doubts(notes)[0]


def test_a_camera_of_another_shape_is_refused(tmp_path):
    folder = write(tmp_path / "a", COLOR, DEPTH, None)
    np.savetxt(folder / "K.txt", [[1000, 0, 959.5], [0, 1000, 269.5], [0, 0, 1]])
    with pytest.raises(ValueError, match=r"principal point .* must lie in the depth picture of 320x240"):
        load(folder)


OTHER = {**CAMERA, "fx": 400, "fy": 400, "depth_scale": 4000}


@pytest.mark.parametrize("names", ["file", "folder"])
@pytest.mark.parametrize("other", ["other_scan", "2024-05-01", "backup/scan", "zzz"])
def test_the_camera_and_the_unit_of_another_recording_are_left_alone(tmp_path, names, other):
    (tmp_path / other).mkdir(parents=True)
    (tmp_path / other / "camera.json").write_text(json.dumps(OTHER))
    Image.fromarray(millimetres(DEPTH)).save(tmp_path / "depth.png")
    frame, notes = load(tmp_path / "depth.png" if names == "file" else tmp_path)
    assert frame.camera.fx != pytest.approx(400) and np.median(frame.depth) == pytest.approx(np.median(DEPTH), rel=0.01)
    assert any("no camera is known" in one for one in notes)


def test_beside_a_folder_of_pictures_another_recording_is_left_alone(tmp_path):
    for name, picture in (("rgb", COLOR), ("depth", millimetres(DEPTH))):
        (tmp_path / name).mkdir()
        Image.fromarray(picture).save(tmp_path / name / "0.png")
    (tmp_path / "older_scan").mkdir()
    (tmp_path / "older_scan/camera.json").write_text(json.dumps(OTHER))
    frame, _ = load(tmp_path)
    assert frame.camera.fx != pytest.approx(400) and np.median(frame.depth) == pytest.approx(np.median(DEPTH), rel=0.01)
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration/camera.json").write_text(json.dumps(CAMERA))
    assert load(tmp_path)[0].camera.intrinsics == pytest.approx(RIGHT)


def test_the_poses_of_another_recording_are_left_alone(tmp_path):
    for k in range(2):
        write(tmp_path / "frames" / f"{k}", *seen(0.2 * k))
        for name in ("color", "depth"):
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / f"frames/{k}/{name}.png").rename(tmp_path / name / f"{k}.png")
        (tmp_path / f"frames/{k}/camera.json").unlink()
        (tmp_path / f"frames/{k}").rmdir()
    (tmp_path / "frames").rmdir()
    (tmp_path / "yesterday").mkdir()
    np.savetxt(tmp_path / "yesterday/poses.txt", np.tile(np.eye(4).reshape(1, 16), (2, 1)))
    assert ps.open_source(tmp_path, notes=lambda _: None).posed == 0
    (tmp_path / "yesterday").rename(tmp_path / "poses")
    assert ps.open_source(tmp_path, notes=lambda _: None).posed == 2


@pytest.mark.parametrize("source", ["depth.png", ""])
def test_the_colours_of_another_recording_are_left_alone(tmp_path, source):
    write(tmp_path / "other_scan", COLOR[:, ::-1].copy(), DEPTH[:, ::-1])
    Image.fromarray(millimetres(DEPTH)).save(tmp_path / "depth.png")
    frame, notes = load(tmp_path / source)
    assert frame.color is None and any("no colour picture" in one for one in notes)


def test_of_several_cameras_that_of_the_same_name_is_taken(tmp_path):
    for name in ("depth", "rgb", "intrinsics"):
        (tmp_path / name).mkdir()
    for place in ("hall", "kitchen"):
        focal = {"hall": 300, "kitchen": FOCAL}[place]
        text = f"{focal} 0 {CAMERA['cx']}\n0 {focal} {CAMERA['cy']}\n0 0 1\n"
        (tmp_path / f"intrinsics/{place}.txt").write_text(text)
    for name, picture in (("rgb", COLOR), ("depth", millimetres(DEPTH))):
        (tmp_path / name / "kitchen").mkdir()
        Image.fromarray(picture).save(tmp_path / name / "kitchen/0.png")
    assert load(tmp_path)[0].camera.intrinsics == pytest.approx(RIGHT)


TABLE = "Frame Info: \nType,Depth\nFormat,Z16\nResolution x,320\nResolution y,240\nBytes per pix,2\n,\nIntrinsic:,\n"
LENS = f"Fx,{FOCAL}\nFy,{FOCAL}\nPPx,{CAMERA['cx']}\nPPy,{CAMERA['cy']}\n"


def jet(depth):
    """For the eye: equalised by its histogram."""
    codes = millimetres(depth)
    share = np.bincount(codes.ravel(), minlength=65536).cumsum() / codes.size
    return (np.clip(1.5 - abs(4 * (1 - share[codes])[..., None] - [3, 2, 1]), 0, 1) * 255).astype(np.uint8)


def grey(depth):
    return np.rint(255 * (1 - depth / depth.max())).astype(np.uint8)


@pytest.mark.parametrize("picture", [jet, grey])
@pytest.mark.parametrize("named", ["", "snap_Depth.png", "snap_Depth.raw"])
@pytest.mark.parametrize("has_table", [True, False])
def test_a_snapshot_is_read_from_its_numbers(tmp_path, picture, named, has_table):
    Image.fromarray(COLOR).save(tmp_path / "snap_Color.png")
    Image.fromarray(picture(DEPTH)).save(tmp_path / "snap_Depth.png")
    millimetres(DEPTH).astype("<u2").tofile(tmp_path / "snap_Depth.raw")
    if has_table:
        (tmp_path / "snap_Depth_metadata.csv").write_text(TABLE + LENS)
    frame, notes = load(tmp_path / named)
    np.testing.assert_allclose(frame.depth, DEPTH, atol=0.00051)
    assert np.array_equal(frame.color, COLOR) and not doubts(notes)
    assert not has_table or frame.camera.intrinsics == pytest.approx(RIGHT)


def test_bare_numbers_have_the_size_in_their_name(tmp_path):
    millimetres(DEPTH).astype("<u2").tofile(tmp_path / "depth_320x240.raw")
    np.testing.assert_allclose(load(tmp_path / "depth_320x240.raw")[0].depth, DEPTH, atol=0.00051)


def test_deep_pictures_stay_before_bare_numbers(tmp_path):
    Image.fromarray(millimetres(DEPTH)).save(tmp_path / "depth.png")
    np.zeros((HEIGHT, WIDTH), "<u2").tofile(tmp_path / "depth.raw")
    np.testing.assert_allclose(load(tmp_path)[0].depth, DEPTH, atol=0.00051)


class TestTheVerdictOfInfo:
    def verdict(self, typed, source):
        code, out, errors = typed(f"info {source}")
        assert code == 0, errors
        return out.strip().splitlines()[-1]

    def test_what_fits(self, typed, tmp_path):
        assert self.verdict(typed, write(tmp_path / "a", COLOR, DEPTH)).startswith("verdict   these fit: the edges")

    def test_a_bare_wall(self, typed, tmp_path):
        folder = write(tmp_path / "a", COLOR, np.full_like(DEPTH, 2.0) + np.arange(WIDTH) / 1000)
        assert "these fit by their sizes; there are few edges" in self.verdict(typed, folder)

    def test_without_colours(self, typed, tmp_path):
        (write(tmp_path / "a", COLOR, DEPTH) / "color.png").unlink()
        assert "these fit by their sizes; there is no colour" in self.verdict(typed, tmp_path / "a")

    def test_what_does_not_fit_is_all_named(self, typed, tmp_path):
        folder = write(tmp_path / "a", COLOR[:, ::-1].copy(), DEPTH, None)
        np.savetxt(folder / "intrinsics.txt", [[2 * FOCAL, 0, 319.5], [0, 2 * FOCAL, 239.5], [0, 0, 1]])
        verdict = self.verdict(typed, folder)
        assert "these do not fit as they are: " in verdict
        assert "by its principal point" in verdict and "mirrored left to right" in verdict

    def test_for_programs(self, typed, tmp_path):
        code, out, _ = typed(f"info --json {write(tmp_path / 'a', COLOR[::-1].copy(), DEPTH)}")
        fit = json.loads(out)["fit"]
        assert code == 0 and fit["compared"] and "mirrored top to bottom" in fit["doubts"][0]


def test_a_set_that_is_called_for_depth_has_no_cameras_of_the_sets_beside_it(tmp_path):
    """my_depth_set/depth/0.png is no tree of depth beside other_set/calib."""
    for name, picture in (("rgb", COLOR), ("depth", millimetres(DEPTH))):
        (tmp_path / "my_depth_set" / name).mkdir(parents=True)
        Image.fromarray(picture).save(tmp_path / "my_depth_set" / name / "0.png")
    (tmp_path / "camera_set/calib").mkdir(parents=True)
    (tmp_path / "camera_set/calib/camera.json").write_text(json.dumps(OTHER))
    for source in ("my_depth_set", "my_depth_set/depth", "my_depth_set/depth/0.png"):
        frame, _ = load(tmp_path / source)
        assert frame.camera.fx != pytest.approx(400) and np.array_equal(frame.color, COLOR)
        assert np.median(frame.depth) == pytest.approx(np.median(DEPTH), rel=0.01)
