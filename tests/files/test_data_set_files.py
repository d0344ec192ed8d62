"""HDF5, MATLAB's files, COLMAP's depth, and the lens in EXIF: depth, colour and camera as their makers meant them."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.arrays.matlab import read_matrix_mat
from pointshade_gl.files.arrays.numpy_files import is_colmap_depth, read_colmap_depth
from pointshade_gl.files.cameras.camera_files import camera_from_exif
from pointshade_gl.files.containers.opening import open_container

from ..support.known_arrays import CAMERA, H, W, colors, matrix, pose, wavy


@pytest.fixture
def hdf5(tmp_path):
    """hdf5(name of the file, {name: array}): its path."""
    h5py = pytest.importorskip("h5py")

    def write(file_name, arrays, matlab=False):
        path = tmp_path / file_name
        with h5py.File(path, "w", userblock_size=512 if matlab else 0) as file:
            for name, array in arrays.items():
                file.create_dataset(name, data=array)
        if matlab:
            with path.open("r+b") as file:
                file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")
        return path

    return write


class TestHdf5:
    def test_rgb_and_depth_with_channels_first(self, hdf5):
        path = hdf5("00001.h5", {"rgb": colors(1)[0].transpose(2, 0, 1), "depth": wavy()})
        (frame,) = open_container(path, print)
        np.testing.assert_array_equal(frame.depth, wavy())
        np.testing.assert_array_equal(frame.color, colors(1)[0])
        assert frame.intrinsics is None

    def test_frames_with_cameras_and_poses_in_a_group(self, hdf5):
        depth, poses = np.stack([wavy(), wavy(shift=1)]), np.stack([pose(), pose(1)])
        arrays = {"depths": depth, "images": colors(2), "camera/K": matrix(), "camera/c2w": poses}
        frames = open_container(hdf5("a.hdf5", {f"scene/{key}": value for key, value in arrays.items()}), print)
        assert len(frames) == 2 and frames[1].intrinsics.numbers == CAMERA
        np.testing.assert_array_equal(frames[1].depth, depth[1])
        np.testing.assert_array_equal(frames[1].color, colors(2)[1])
        np.testing.assert_array_equal(frames[1].pose, poses[1])

    def test_hypersim_counts_along_the_ray(self, hdf5):
        notes = []
        path = hdf5("frame.0000.depth_meters.hdf5", {"dataset": wavy(768, 1024).astype(np.float16)})
        (frame,) = open_container(path, notes.append)
        assert frame.depth_kind == frame.intrinsics.depth_kind == "ray" and frame.depth.dtype == np.float16
        assert frame.intrinsics.numbers == (886.81, 886.81, 511.5, 383.5) and "Hypersim's usual" in notes[0]

    def test_a_folder_of_hypersim_is_read_along_the_axis(self, tmp_path):
        h5py = pytest.importorskip("h5py")
        folder = tmp_path / "scene_cam_00_geometry_hdf5"
        folder.mkdir()
        v, u = np.mgrid[:768, :1024]
        longer = np.sqrt(((u - 511.5) / 886.81) ** 2 + ((v - 383.5) / 886.81) ** 2 + 1)
        with h5py.File(folder / "frame.0000.depth_meters.hdf5", "w") as file:
            file["dataset"] = (2 * longer).astype(np.float16)
        frame = ps.load_frame(tmp_path, notes=lambda _: None)
        assert frame.camera.fx == 886.81
        np.testing.assert_allclose(frame.depth, 2, rtol=2e-3)

    def test_nyu_is_turned_and_has_its_camera(self, hdf5):
        """The labelled set, as MATLAB 7.3 has it: (n, 3, w, h) and (n, w, h)."""
        depth, seen, notes = np.stack([wavy(480, 640), wavy(480, 640, 1)]), colors(2, 480, 640), []
        arrays = {"depths": depth.transpose(0, 2, 1), "images": seen.transpose(0, 3, 2, 1)}
        frames = open_container(hdf5("nyu.mat", arrays, matlab=True), notes.append)
        assert len(frames) == 2
        np.testing.assert_array_equal(frames[1].depth, depth[1])
        np.testing.assert_array_equal(frames[1].color, seen[1])
        assert frames[0].intrinsics.numbers == (518.857901, 519.469611, 325.582449, 253.736166)
        assert frames[0].intrinsics.size == (640, 480) and "NYU Depth v2" in notes[0]

    def test_links_to_other_files_are_not_followed(self, hdf5, tmp_path):
        h5py = pytest.importorskip("h5py")
        other = hdf5("other.h5", {"depth": wavy()})
        values = h5py.VirtualLayout((H, W), np.float32)
        values[...] = h5py.VirtualSource(str(other), "depth", shape=(H, W))
        (tmp_path / "raw.bin").write_bytes(wavy().tobytes())
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["depth"] = h5py.ExternalLink(str(other), "depth")
            file.create_virtual_dataset("depths", values)
            file.create_dataset("disparity", (H, W), "f4", external=[(str(tmp_path / "raw.bin"), 0, 4 * H * W)])
            file["rgb"] = colors(1)[0]
        with pytest.raises(ValueError, match=r"no array called depth or points, only rgb \(48, 64, 3\)"):
            open_container(tmp_path / "a.h5", print)

    def test_sizes_are_checked_before_anything_is_unpacked(self, hdf5, tmp_path):
        h5py = pytest.importorskip("h5py")
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file.create_dataset("depth", (60000, 60000), "f4", chunks=(100, 100), compression="gzip")
        with pytest.raises(ValueError, match="has 60000x60000 pixels, the limit is 134217728"):
            open_container(tmp_path / "a.h5", print)
        with h5py.File(tmp_path / "b.h5", "w") as file:
            file["depth"] = wavy()
            file.create_dataset("K", (3, 3, 30000, 30000), "f8", chunks=(1, 1, 100, 100), compression="gzip")
        with pytest.raises(ValueError, match=r"has no array|does not fit|limit"):
            open_container(tmp_path / "b.h5", _fail)

    def test_a_cut_file(self, hdf5):
        path = hdf5("a.h5", {"depth": wavy()})
        path.write_bytes(path.read_bytes()[:1500])
        with pytest.raises(ValueError, match=r"a\.h5 is a broken or truncated HDF5 file"):
            open_container(path, print)


def _fail(text):
    raise ValueError(text)


class TestMatlab:
    def test_depth_of_version_5(self, tmp_path):
        io = pytest.importorskip("scipy.io")
        io.savemat(tmp_path / "a.mat", {"depth": wavy(), "rgb": colors(1)[0], "K": matrix(), "note": "text"})
        (frame,) = open_container(tmp_path / "a.mat", print)
        np.testing.assert_array_equal(frame.depth, wavy())
        np.testing.assert_array_equal(frame.color, colors(1)[0])
        assert frame.intrinsics.numbers == CAMERA

    def test_matlab_counts_frames_by_the_last_axis(self, tmp_path):
        io, depth = pytest.importorskip("scipy.io"), np.stack([wavy(), wavy(shift=1)])
        arrays = {"depths": depth.transpose(1, 2, 0), "images": colors(2).transpose(1, 2, 3, 0), "K": matrix()}
        io.savemat(tmp_path / "a.mat", arrays)
        frames = open_container(tmp_path / "a.mat", print)
        assert len(frames) == 2
        np.testing.assert_array_equal(frames[1].depth, depth[1])
        np.testing.assert_array_equal(frames[1].color, colors(2)[1])

    @pytest.mark.parametrize("version", ["5", "7.3"])
    def test_small_matrices(self, tmp_path, hdf5, version):
        arrays = {"intrinsic_matrix": matrix(), "factor_depth": np.array([[1000.0]]), "big": np.zeros((300, 300))}
        arrays["poses"] = np.arange(36.0).reshape(3, 4, 3)
        if version == "5":
            pytest.importorskip("scipy.io").savemat(tmp_path / "a.mat", arrays | {"cls": "text"})
        else:
            hdf5("a.mat", {name: array.T for name, array in arrays.items()}, matlab=True)
        found = read_matrix_mat(tmp_path / "a.mat")
        assert sorted(found) == ["factor_depth", "intrinsic_matrix", "poses"]
        for name in found:
            np.testing.assert_array_equal(found[name], arrays[name].ravel())

    def test_other_and_broken_files(self, tmp_path):
        io = pytest.importorskip("scipy.io")
        io.savemat(tmp_path / "a.mat", {"depth": wavy()}, do_compression=True)
        data = (tmp_path / "a.mat").read_bytes()
        (tmp_path / "a.mat").write_bytes(data[:1000])
        with pytest.raises(ValueError, match=r"a\.mat is a broken or truncated MATLAB file"):
            list(open_container(tmp_path / "a.mat", print))
        (tmp_path / "b.mat").write_bytes(b"hello, this is a text")
        with pytest.raises(ValueError, match=r"b\.mat is not a MATLAB file of version 5 or 7\.3"):
            read_matrix_mat(tmp_path / "b.mat")


class TestColmap:
    def test_rows_and_columns_are_not_exchanged(self, tmp_path):
        (tmp_path / "a.jpg.geometric.bin").write_bytes(f"{W}&{H}&1&".encode() + wavy().tobytes())
        np.testing.assert_array_equal(read_colmap_depth(tmp_path / "a.jpg.geometric.bin"), wavy())
        assert is_colmap_depth((tmp_path / "a.jpg.geometric.bin").read_bytes()[:64]) and not is_colmap_depth(b"\x89PNG")

    @pytest.mark.parametrize(
        ("data", "sentence"),
        [
            (b"64&48&1&" + bytes(99), "is truncated: it has 99 of 12288 bytes"),
            (b"64&48&3&" + bytes(99), "64x48 pixels and 3 channels, expected one channel"),
            (b"99999&48&1&", "99999x48 pixels, the limit for a side is 65536"),
            (b"hello", "is not a depth of COLMAP"),
        ],
    )
    def test_bad_files(self, tmp_path, data, sentence):
        (tmp_path / "a.bin").write_bytes(data)
        with pytest.raises(ValueError, match=sentence):
            read_colmap_depth(tmp_path / "a.bin")


def photo(path, size, orientation=1, focal=26, said=None):
    exif = Image.Exif()
    exif[0x0112] = orientation
    tags = exif.get_ifd(0x8769)
    if focal:
        tags[0xA405] = focal
    if said:
        tags[0xA002], tags[0xA003] = said
    Image.new("RGB", size).save(path, exif=exif)
    return path


class TestLens:
    @pytest.mark.parametrize("suffix", ["jpg", "png", "webp"])
    def test_the_focal_length_counts_along_the_diagonal(self, tmp_path, suffix):
        """26 mm of an iPhone 13 Pro at 4032x3024 are 3028 pixels; the phone itself says 3032."""
        camera = camera_from_exif(photo(tmp_path / f"a.{suffix}", (400, 300)))
        assert camera.numbers[0] == camera.numbers[1] == pytest.approx(3028.66 * 400 / 4032, rel=1e-4)
        assert camera.numbers[2:] == (199.5, 149.5) and camera.size == (400, 300)

    def test_a_turned_picture_is_upright(self, tmp_path):
        camera = camera_from_exif(photo(tmp_path / "a.jpg", (400, 300), orientation=6, said=(4000, 3000)))
        assert camera.size == (300, 400) and camera.numbers[2:] == (149.5, 199.5)

    def test_what_is_not_said_or_was_cropped_has_no_camera(self, tmp_path):
        assert camera_from_exif(photo(tmp_path / "a.jpg", (400, 300), focal=0)) is None
        assert camera_from_exif(photo(tmp_path / "b.jpg", (300, 300), said=(4000, 3000))) is None
        (tmp_path / "c.jpg").write_bytes((tmp_path / "b.jpg").read_bytes()[:50])
        assert camera_from_exif(tmp_path / "c.jpg") is None
