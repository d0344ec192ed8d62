"""Recordings of Record3D: packed, exported and unpacked ones give the same frames."""

import json
import struct
import zipfile
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.files.containers.opening import is_zip_folder, open_container, unpack_folder

W, H, DW, DH = 24, 32, 6, 8
K = [30.0, 0, 0, 0, 31.0, 0, 11.5, 16.5, 1]  # column by column
QUARTER = [0, np.sin(np.pi / 4), 0, np.cos(np.pi / 4)]  # about y: the camera's z is the world's x
POSES = [[0, 0, 0, 1, 0, 0, 0], [*QUARTER, 1, 2, 3], [0, 0, 0, 1, 0, 0, 5]]


def depth_of(k):
    depth = (1 + k + np.arange(DW * DH) / 100).astype(np.float32).reshape(DH, DW)
    depth[0, 0] = np.nan
    return depth


def jpeg(k, size=(W, H)):
    file = BytesIO()
    Image.new("RGB", size, (40 * k, 90, 200)).save(file, "JPEG", quality=95)
    return file.getvalue()


def metadata(**values):
    return json.dumps({"w": W, "h": H, "dw": DW, "dh": DH, "fps": 60, "K": K, "poses": POSES} | values).encode()


def pack(data):
    return pytest.importorskip("liblzfse").compress(data)


def r3d(path, numbers=(0, 1, 2), size=(W, H), **values):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", metadata(**values))
        archive.writestr("icon", b"icon")
        for k in numbers:
            confidence = np.full((DH, DW), 2, np.uint8)
            confidence[-1] = 0
            confidence[-2] = 1
            archive.writestr(f"rgbd/{k}.jpg", jpeg(k, size))
            archive.writestr(f"rgbd/{k}.depth", pack(depth_of(k).tobytes()))
            archive.writestr(f"rgbd/{k}.conf", pack(confidence.tobytes()))
    return path


def check(frame, k):
    np.testing.assert_array_equal(frame.depth, depth_of(k))
    np.testing.assert_allclose(frame.intrinsics.numbers, (30, 31, 11, 16))  # centres at integers, not at +0.5
    assert frame.intrinsics.size == (W, H) and frame.color.shape == (H, W, 3)
    np.testing.assert_allclose(frame.color[5, 5].astype(int), (40 * k, 90, 200), atol=3)


def test_a_recording(tmp_path):
    notes = []
    frames = open_container(r3d(tmp_path / "a.r3d"), notes.append)
    assert len(frames) == 3 and notes == []
    for k in range(3):
        check(frames[k], k)
    assert frames[0].valid[:-1].all() and not frames[0].valid[-1].any()
    assert len(notes) == 1 and "12% of the depth is of low confidence and left out" in notes[0]


def test_poses_turn_from_opengl_to_opencv(tmp_path):
    frames = open_container(r3d(tmp_path / "a.r3d"), lambda _: None)
    np.testing.assert_array_equal(frames[0].pose, np.diag([1, -1, -1, 1]))  # the world keeps y up
    looking, up = frames[1].pose[:3, 2], -frames[1].pose[:3, 1]
    np.testing.assert_allclose(looking, (-1, 0, 0), atol=1e-12)  # a camera that looked along -z, turned about y
    np.testing.assert_allclose(up, (0, 1, 0), atol=1e-12)
    np.testing.assert_array_equal(frames[1].pose[:3, 3], (1, 2, 3))


def test_frames_may_be_thinned_out_and_have_cameras_of_their_own(tmp_path):
    each = [[30.0, 31, 11.5, 16.5], [40.0, 41, 12.5, 17.5], [50.0, 51, 10.5, 15.5]]
    frames = open_container(r3d(tmp_path / "a.r3d", (0, 2), perFrameIntrinsicCoeffs=each), lambda _: None)
    assert len(frames) == 2 and frames[1].pose[2, 3] == 5
    assert frames[1].intrinsics.numbers == (50, 51, 10, 15)


def test_the_camera_grows_with_a_larger_colour_picture(tmp_path):
    frames = open_container(r3d(tmp_path / "a.r3d", size=(2 * W, 2 * H)), lambda _: None)
    assert frames[0].intrinsics.size == (2 * W, 2 * H)
    np.testing.assert_allclose(frames[0].intrinsics.numbers, (60, 62, 22.5, 32.5))


@pytest.mark.parametrize("is_zipped", [True, False])
def test_an_export_of_exr_and_jpeg(tmp_path, is_zipped):
    OpenEXR = pytest.importorskip("OpenEXR")
    folder = tmp_path / "EXR_RGBD"
    for name in ("rgb", "depth"):
        (folder / name).mkdir(parents=True)
    (folder / "metadata.json").write_bytes(metadata())
    for k in (0, 1):
        (folder / "rgb" / f"{k}.jpg").write_bytes(jpeg(k))
        with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"R": depth_of(k)}) as file:
            file.write(str(folder / "depth" / f"{k}.exr"))
    path = folder
    if is_zipped:
        path = tmp_path / "export.zip"
        with zipfile.ZipFile(path, "w") as archive:
            for file in sorted(folder.rglob("*.*")):
                archive.write(file, file.relative_to(tmp_path))
    frames = open_container(path, print)
    assert len(frames) == 2
    check(frames[1], 1)
    assert frames[0].valid is None


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"dw": 7}, r"rgbd/0\.depth holds 192 bytes, expected 224"),
        ({"dw": 60000, "dh": 60000}, r"60000x60000 pixels, the limit is"),
        ({"dw": "x"}, r"metadata: dw must be a whole number of pixels above 0, got 'x'"),
        ({"K": [1, 2]}, r"metadata: K must be 9 numbers, got \[1, 2\]"),
        ({"K": [0] * 9}, r"metadata: camera fx must be above 0"),
        ({"poses": [[1]]}, r"metadata: poses must be 7 numbers, got \[1\]"),
    ],
)
def test_bad_metadata(tmp_path, values, sentence):
    frames = open_container(r3d(tmp_path / "a.r3d", **values), lambda _: None)
    with pytest.raises(ValueError, match=sentence):
        frames[0]


@pytest.mark.parametrize("data", [b"bvx2" + bytes(60), b"bvx-\xff\xff\xff\xff" + bytes(9), b"bvx-\x04", b"nothing"])
def test_bad_depth(tmp_path, data):
    pack(b"")
    with zipfile.ZipFile(tmp_path / "a.r3d", "w") as archive:
        archive.writestr("metadata", metadata())
        archive.writestr("rgbd/0.depth", data)
    with pytest.raises(ValueError, match=r"rgbd/0\.depth is broken or truncated"):
        open_container(tmp_path / "a.r3d", print)[0]


def test_what_would_unpack_to_gigabytes_is_not_unpacked(tmp_path):
    block = b"bvx-" + struct.pack("<I", 8) + bytes(8)
    with zipfile.ZipFile(tmp_path / "a.r3d", "w") as archive:
        archive.writestr("metadata", metadata())
        archive.writestr("rgbd/0.depth", pack(bytes(10**7)))
        archive.writestr("rgbd/1.depth", block * 100 + b"bvx$")
    frames = open_container(tmp_path / "a.r3d", print)
    with pytest.raises(ValueError, match="holds 10000000 bytes, expected 192"):
        frames[0]
    with pytest.raises(ValueError, match="holds 800 bytes, expected 192"):
        frames[1]


def test_metadata_of_other_programs_make_no_recording(tmp_path):
    (tmp_path / "depth").mkdir()
    (tmp_path / "depth" / "0.exr").write_bytes(b"exr")
    (tmp_path / "metadata.json").write_text('{"author": "me"}')
    assert open_container(tmp_path, print) is None


class TestFoldersInArchives:
    def archive(self, path, **members):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            for name, data in members.items():
                file.writestr(name.replace("__", "/").replace("UP", ".."), data)
        return path

    def test_the_only_folder_is_unpacked_once(self, tmp_path):
        path = self.archive(tmp_path / "a.zip", frame__color="c", frame__depth__0="d", frame__x="y")
        folder = unpack_folder(path)
        assert folder.name == "frame" and (folder / "depth" / "0").read_text() == "d"
        assert unpack_folder(path) == folder and open_container(path, print) is None and is_zip_folder(path)
        np.savez(tmp_path / "arrays.npz", a=np.ones(3))
        assert not is_zip_folder(tmp_path / "arrays.npz") and not is_zip_folder(__file__)

    def test_names_outside_are_refused(self, tmp_path):
        for k, name in enumerate(("UP__evil", "a__UP__UP__evil", "__tmp__evil", "C:evil")):
            with pytest.raises(ValueError, match=r"names '.*evil', which lies outside it"):
                unpack_folder(self.archive(tmp_path / f"{k}.zip", good="x", **{name: "x"}))

    def test_a_bomb_is_not_unpacked(self, tmp_path):
        data = bytearray(self.archive(tmp_path / "a.zip", a="x").read_bytes())
        struct.pack_into("<I", data, data.index(b"PK\x01\x02") + 24, 4 * 10**9)  # its size when unpacked
        (tmp_path / "a.zip").write_bytes(data)
        with pytest.raises(ValueError, match=r"has 4000000000 bytes when unpacked, .*: pass max_pixels"):
            unpack_folder(tmp_path / "a.zip")


@pytest.mark.data
def test_a_phones_depth_in_a_recording(shared_data, tmp_path):
    """The LiDAR frame as Record3D would have written it: 256x192 beside a colour of 1920x1440."""
    folder = shared_data / "iphone_lidar_promptda"
    depth = np.asarray(Image.open(folder / "depth.png")).astype(np.float32) / 1000
    values = {"w": 1920, "h": 1440, "dw": 256, "dh": 192, "K": [1390, 0, 0, 0, 1390, 0, 960, 720, 1], "poses": POSES}
    with zipfile.ZipFile(tmp_path / "a.r3d", "w") as archive:
        archive.writestr("metadata", metadata(**values))
        archive.writestr("rgbd/0.jpg", (folder / "color.jpg").read_bytes())
        archive.writestr("rgbd/0.depth", pack(depth.tobytes()))
    (frame,) = open_container(tmp_path / "a.r3d", print)
    np.testing.assert_array_equal(frame.depth, depth)
    assert frame.intrinsics.numbers == (1390, 1390, 959.5, 719.5) and frame.intrinsics.size == (1920, 1440)
    assert frame.color.shape == (1440, 1920, 3) and frame.valid is None
