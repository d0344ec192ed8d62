"""Depth and normals in files, read back by other libraries: Pillow, NumPy, OpenEXR and ffmpeg."""

import subprocess
import sys

import numpy as np
import OpenEXR
import pytest
from imageio_ffmpeg import get_ffmpeg_exe
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.writing.maps_and_points import check_depth_path, check_normals_path

RNG = np.random.default_rng(5)
DEPTH = RNG.uniform(0.4, 9, (5, 7)).astype(np.float32)
DEPTH[1, 2] = 0
# three normals by hand, each leaning one way from the viewer: to the right, up, and neither; the fourth is missing
NORMALS = np.array([[(0.6, 0, -0.8), (0, -0.6, -0.8), (0, 0, -1), (np.nan,) * 3]], np.float32)
TURNED = {
    "opencv": [(0.6, 0, -0.8), (0, -0.6, -0.8), (0, 0, -1)],
    "opengl": [(0.6, 0, 0.8), (0, 0.6, 0.8), (0, 0, 1)],
    "directx": [(0.6, 0, 0.8), (0, -0.6, 0.8), (0, 0, 1)],
}


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def decoded(path, kind, dtype):
    """The planes or pixels of a picture, by ffmpeg."""
    command = [get_ffmpeg_exe(), "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", kind, "-"]
    return np.frombuffer(subprocess.run(command, check=True, capture_output=True).stdout, dtype)


class TestDepth:
    def test_exr_holds_metres_in_the_channel_that_is_called_depth_and_as_grey(self, tmp_path):
        """Grey is what Blender and OpenCV show: see clients/test_exr.py."""
        ps.save_depth(tmp_path / "d.exr", DEPTH)
        assert sorted(channels(tmp_path / "d.exr")) == ["Y", "Z"]
        for one in channels(tmp_path / "d.exr").values():
            assert one.dtype == np.float32
            np.testing.assert_array_equal(one, DEPTH)

    @pytest.mark.parametrize("suffix", ["tif", "tiff", "npy"])
    def test_tiff_and_npy_hold_metres(self, tmp_path, suffix):
        path = tmp_path / f"d.{suffix}"
        ps.save_depth(path, DEPTH.astype(np.float64))
        read = np.load(path) if suffix == "npy" else np.asarray(Image.open(path).copy())
        assert read.dtype == np.float32
        np.testing.assert_array_equal(read, DEPTH)

    def test_png_holds_millimetres(self, tmp_path):
        ps.save_depth(tmp_path / "d.png", DEPTH, notes=pytest.fail)
        with Image.open(tmp_path / "d.png") as image:
            assert image.mode == "I;16"
            np.testing.assert_array_equal(np.asarray(image), np.rint(DEPTH * 1000.0))

    def test_what_millimetres_cannot_hold_becomes_missing_and_is_counted(self, tmp_path):
        notes = []
        ps.save_depth(tmp_path / "d.png", np.array([[65.535, 65.536, 1e9, 0.0004, 0.0006, 0]]), notes.append)
        with Image.open(tmp_path / "d.png") as image:
            assert np.asarray(image).tolist() == [[65535, 0, 0, 0, 1, 0]]
        assert len(notes) == 1 and "3 of 5 depths are outside 1 mm to 65.535 m" in notes[0]

    def test_a_png_that_would_hold_nothing_is_refused(self, tmp_path):
        with pytest.raises(ValueError, match=r"no depth lies within 1 mm to 65\.535 m, use \.exr, \.tif or \.npy"):
            ps.save_depth(tmp_path / "d.png", np.full((2, 3), 167.0))
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("suffix", ["png", "exr", "tif", "npy"])
    def test_all_that_means_missing_is_0_and_our_own_reader_agrees(self, tmp_path, suffix):
        depth = np.array([[1.5, np.nan, np.inf], [-1, 0, 2.25]])
        ps.save_depth(tmp_path / f"d.{suffix}", depth)
        read = ps.load_frame(depth=tmp_path / f"d.{suffix}", fov=50, depth_scale=1000 if suffix == "png" else 1)
        np.testing.assert_array_equal(read.depth, [[1.5, 0, 0], [0, 0, 2.25]])

    @pytest.mark.parametrize(
        ("depth", "error", "sentence"),
        [
            (np.zeros((2, 3, 1)), ValueError, r"depth must have shape \(h, w\), got \(2, 3, 1\)"),
            (np.zeros((0, 3)), ValueError, r"depth must have shape \(h, w\), got \(0, 3\)"),
            (np.full((2, 3), 1500, np.uint16), TypeError, "depth must be floating point metres, got uint16"),
        ],
    )
    def test_what_is_no_depth_is_refused(self, tmp_path, depth, error, sentence):
        with pytest.raises(error, match=sentence):
            ps.save_depth(tmp_path / "d.npy", depth)


class TestNormals:
    @pytest.mark.parametrize("axes", TURNED)
    def test_axes_of_numbers(self, tmp_path, axes):
        ps.save_normals(tmp_path / "n.npy", NORMALS, axes)
        ps.save_normals(tmp_path / "n.exr", NORMALS, axes)
        read, planes = np.load(tmp_path / "n.npy"), channels(tmp_path / "n.exr")
        assert read.dtype == np.float32 and np.isnan(read[0, 3]).all()
        np.testing.assert_array_equal(read[0, :3], np.array(TURNED[axes], np.float32))
        exr = np.stack([planes[name][0] for name in "RGBA"], -1)
        np.testing.assert_array_equal(exr[:3, :3], np.array(TURNED[axes], np.float32))
        assert exr[:, 3].tolist() == [1, 1, 1, 0] and exr[3].tolist() == [0, 0, 0, 0]

    @pytest.mark.parametrize("axes", TURNED)
    def test_axes_of_colours_in_8_and_16_bits(self, tmp_path, axes):
        ps.save_normals(tmp_path / "n8.png", NORMALS, axes)
        ps.save_normals(tmp_path / "n16.png", NORMALS, axes, bits=16)
        with Image.open(tmp_path / "n8.png") as image:
            read = np.asarray(image)[0].astype(int)
        assert read[:, 3].tolist() == [255, 255, 255, 0] and not read[3].any()
        np.testing.assert_allclose(read[:3, :3] / 127.5 - 1, TURNED[axes], atol=0.51 / 127.5)
        deep = decoded(tmp_path / "n16.png", "rgba64le", "<u2").reshape(4, 4).astype(int)
        assert deep[:, 3].tolist() == [65535, 65535, 65535, 0] and not deep[3].any()
        np.testing.assert_allclose(deep[:3, :3] / 32767.5 - 1, TURNED[axes], atol=0.51 / 32767.5)

    def test_each_format_has_its_usual_axes(self, tmp_path):
        for name in ("n.npy", "n.exr", "n.png", "n.webp"):
            ps.save_normals(tmp_path / name, NORMALS)
        np.testing.assert_array_equal(np.load(tmp_path / "n.npy"), NORMALS)
        assert channels(tmp_path / "n.exr")["B"][0].tolist() == pytest.approx([0.8, 0.8, 1, 0])
        for name in ("n.png", "n.webp"):
            with Image.open(tmp_path / name) as image:
                right, up, towards = np.asarray(image)[0, :3, :3].tolist()
            assert (right, up, towards) == ([204, 128, 230], [128, 204, 230], [128, 128, 255])

    def test_exr_opens_in_another_decoder(self, tmp_path):
        normals = RNG.normal(size=(4, 6, 3)).astype(np.float32)
        ps.save_normals(tmp_path / "n.exr", normals, "opencv")
        green, blue, red, _ = decoded(tmp_path / "n.exr", "gbrapf32le", "<f4").reshape(4, 4, 6)
        np.testing.assert_array_equal(np.stack([red, green, blue], -1), normals)

    @pytest.mark.parametrize(
        ("name", "options", "sentence"),
        [
            ("n.png", {"axes": "blender"}, "unknown axes 'blender': known are opencv, opengl, directx"),
            ("n.png", {"bits": 12}, "bits must be 8 or 16, got 12"),
            ("n.jpg", {"bits": 16}, r"n\.jpg: bits=16 needs \.png; \.exr and \.npy hold floats"),
            ("n.xyz", {}, r"n\.xyz: its suffix must be one of \.png, "),
        ],
    )
    def test_options_that_do_not_fit_are_refused(self, tmp_path, name, options, sentence):
        with pytest.raises(ValueError, match=sentence):
            ps.save_normals(tmp_path / name, NORMALS, **options)
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("check", "save"), [(check_depth_path, ps.save_depth), (check_normals_path, ps.save_normals)])
class TestPlaces:
    def test_a_missing_folder_is_named(self, tmp_path, check, save):
        for call in (check, lambda path: save(path, NORMALS[..., 0] if save is ps.save_depth else NORMALS)):
            with pytest.raises(FileNotFoundError, match="create it first"):
                call(tmp_path / "no" / "x.exr")

    def test_without_the_extra_it_is_named(self, tmp_path, monkeypatch, check, save):
        monkeypatch.setitem(sys.modules, "OpenEXR", None)
        with pytest.raises(ValueError, match=r"pip install '\.\[exr\]' in the clone for \.exr; \.npy works without"):
            check(tmp_path / "x.exr")
        save(tmp_path / "x.npy", DEPTH if save is ps.save_depth else NORMALS)

    def test_a_failed_write_leaves_the_old_file_and_nothing_else(self, tmp_path, monkeypatch, check, save):
        class Broken:
            def __init__(self, *_):
                raise RuntimeError("no space left")

        (tmp_path / "x.exr").write_bytes(b"the old one")
        monkeypatch.setattr(OpenEXR, "File", Broken)
        with pytest.raises(OSError, match=r"cannot write .+: no space left"):
            save(check(tmp_path / "x.exr"), DEPTH if save is ps.save_depth else NORMALS)
        assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("x.exr", b"the old one")]


def test_depth_of_an_unknown_suffix_lists_the_known_ones(tmp_path):
    with pytest.raises(ValueError, match=r"the suffix of depth must be one of \.png, \.exr, \.tif, \.tiff, \.npy"):
        ps.save_depth(tmp_path / "d.jpg", DEPTH)


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
def test_a_png_of_16_bits_keeps_every_value(tmp_path, shape):
    image = RNG.integers(0, 65536, shape, np.uint16)
    ps.save_image(tmp_path / "a.png", image)
    kind = {2: "gray16le", 3: "rgb48le" if shape[-1] == 3 else "rgba64le"}[len(shape)]
    np.testing.assert_array_equal(decoded(tmp_path / "a.png", kind, "<u2").reshape(shape), image)
