"""Which channel of a file is depth, and what else such a file holds: colours, a camera, a unit."""

import base64
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.clouds.load_cloud import is_cloud
from pointshade_gl.files.depth.depth_files import read_depth
from pointshade_gl.files.pictures.hdr_files import write_exr
from pointshade_gl.files.pictures.picture_files import encode_png

from ..support.rooms import corner

COLOR, Z, _ = corner(0.3, 0.2)
F32 = Z.astype(np.float32)
MM = np.rint(Z * 1000).astype(np.uint16)
FOCAL = 262.5
V, U = np.mgrid[:240, :320]
POINTS = np.stack([(U - 159.5) / FOCAL * Z, (V - 119.5) / FOCAL * Z, Z], -1).astype(np.float32)
LINEAR = np.where(COLOR <= 10, COLOR / 255 / 12.92, ((COLOR / 255 + 0.055) / 1.055) ** 2.4).astype(np.float32)


@pytest.fixture
def folder(tmp_path):
    np.savetxt(tmp_path / "intrinsics.txt", [[FOCAL, 0, 159.5], [0, FOCAL, 119.5], [0, 0, 1]])
    return tmp_path


def read(source, **options):
    """A frame, and the notes."""
    notes = []
    return ps.load_frame(source, **options, notes=notes.append), notes


def refuse(note):
    raise AssertionError(note)


ONES, ZEROS = np.ones_like(F32), np.zeros_like(F32)
LAYERS = {
    "layer with alpha": {"Depth.R": F32, "Depth.G": F32, "Depth.B": F32, "Depth.A": ONES},
    "alpha that varies": {"Depth.R": F32, "Depth.G": F32, "Depth.B": F32, "Depth.A": F32[::-1]},
    "grey with alpha": {"R": F32, "G": F32, "B": F32, "A": ONES},
    "red alone": {"R": F32, "G": ZEROS, "B": ZEROS, "A": ONES},
    "red and alpha": {"R": F32, "A": ONES},
    "red of a layer": {"Depth.R": F32, "Depth.G": ZEROS, "Depth.B": ZEROS, "Depth.A": ONES},
    "Blender's": {"ViewLayer.Depth.Z": F32, "ViewLayer.Mist.Z": F32[:, ::-1], "ViewLayer.Normal.X": ZEROS},
    "Z beside normals": {"depth.V": F32, "N.X": ZEROS, "N.Y": F32[::-1], "N.Z": F32[:, ::-1]},
}


@pytest.mark.parametrize("name", LAYERS)
def test_alpha_and_channels_of_one_value_are_no_depth(folder, name):
    write_exr(folder / "depth.exr", LAYERS[name])
    frame, _ = read(folder)
    np.testing.assert_array_equal(frame.depth, F32)


def test_a_channel_or_its_layer_may_be_named(folder):
    write_exr(folder / "depth.exr", {"Depth.Z": F32[::-1], "Smooth.R": F32, "Smooth.A": ONES, "id": ONES})
    for name in ("Smooth.R", "smooth", "Smooth"):
        np.testing.assert_array_equal(read(folder, channel=name)[0].depth, F32)
    with pytest.raises(ValueError, match=r"has no channel='smoth' .did you mean Smooth.R.*only Depth.Z"):
        read(folder, channel="smoth")


def test_channels_that_cannot_be_told_apart_are_refused_with_a_way_out(folder):
    write_exr(folder / "depth.exr", {"left": F32, "right": F32[::-1]})
    with pytest.raises(ValueError, match=r"left, right, which differ.* pass channel=NAME"):
        read(folder)
    np.testing.assert_array_equal(read(folder, channel="right")[0].depth, F32[::-1])


@pytest.mark.parametrize("layer", ["", "ViewLayer.Combined."])
def test_colours_in_the_same_picture_are_its_colours(folder, layer):
    colors = {f"{layer}{one}": LINEAR[..., k] for k, one in enumerate("RGB")}
    write_exr(folder / "scene_depth.exr", {"Z": F32, f"{layer}A": ONES, **colors})
    for source in (folder, folder / "scene_depth.exr"):
        frame, notes = read(source)
        np.testing.assert_array_equal(frame.depth, F32)
        np.testing.assert_allclose(frame.color.astype(int), COLOR, atol=1)
        assert not any("light grey" in note for note in notes)


def test_a_colour_picture_beside_it_is_preferred(folder):
    write_exr(folder / "depth.exr", {"Z": F32, **{one: LINEAR[..., k] for k, one in enumerate("RGB")}})
    Image.fromarray(255 - COLOR).save(folder / "color.png")
    np.testing.assert_array_equal(read(folder)[0].color, 255 - COLOR)


@pytest.mark.parametrize("name", ["FinalImageMovieRenderQueue_WorldDepth.R", "SceneDepthWorldUnits.R"])
def test_unreals_depth_is_in_centimetres_and_said(folder, name):
    write_exr(folder / "depth.exr", {name: 100 * F32, name[:-1] + "A": ONES})
    frame, notes = read(folder)
    np.testing.assert_allclose(frame.depth, F32, rtol=1e-6)
    assert any("centimetres" in note and "pass depth_scale" in note for note in notes)
    np.testing.assert_allclose(read(folder, depth_scale=1000)[0].depth, F32 / 10, rtol=1e-6)


def test_drawn_depth_of_hundreds_is_in_centimetres_and_said(folder):
    grey = dict.fromkeys("RGB", 100 * F32)
    write_exr(folder / "depth.exr", {**grey, "A": ONES})
    frame, notes = read(folder)
    np.testing.assert_allclose(frame.depth, F32, rtol=1e-6)
    assert any("centimetres" in note for note in notes)
    write_exr(folder / "depth.exr", {"Z": MM.astype(np.float32)})  # a sensor's
    np.testing.assert_allclose(read(folder)[0].depth, MM / 1000, rtol=1e-6)


def test_a_channel_of_a_container_is_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["depth"] = F32
    with pytest.raises(ValueError, match=r"a\.h5 names its arrays: leave out channel='depth'"):
        read(tmp_path / "a.h5", channel="depth", fov=60)


@pytest.mark.parametrize("channels", [3, 4])
def test_a_png_of_equal_channels_of_16_bits_keeps_them(folder, channels):
    deep = np.repeat(MM[..., None], channels, 2)
    deep[..., 3:] = 65535
    (folder / "depth.png").write_bytes(encode_png(deep))
    np.testing.assert_array_equal(read_depth(folder / "depth.png", refuse), MM)
    np.testing.assert_allclose(read(folder)[0].depth, MM / 1000, rtol=1e-6)


def test_a_channel_of_16_bits_may_be_named_and_others_are_refused(folder):
    (folder / "depth.png").write_bytes(encode_png(np.stack([MM[::-1], MM, 0 * MM], -1)))
    for name in ("green", "G", "1"):
        np.testing.assert_array_equal(read_depth(folder / "depth.png", refuse, channel=name), MM)
    with pytest.raises(ValueError, match=r"channels that differ.* pass channel=NAME"):
        read(folder)
    with pytest.raises(ValueError, match="has no channel='alpha', only 0, 1, 2"):
        read(folder, channel="alpha")
    (folder / "depth.png").write_bytes(encode_png(np.stack([MM, 0 * MM, 0 * MM], -1)))
    np.testing.assert_array_equal(read_depth(folder / "depth.png", refuse), MM)


def tiff(values, order="<", rows=50, packed=False, predictor=1, tile=0):
    """A TIFF of floats in strips, or in square tiles."""
    height, width = values.shape[:2]
    channels, size = values[0, 0].size, values.dtype.itemsize
    data = np.ascontiguousarray(values.astype(values.dtype.newbyteorder(order)))
    strips = [data[k : k + rows].tobytes() for k in range(0, height, rows)]
    if tile:
        whole = np.pad(data, ((0, -height % tile), (0, -width % tile)))
        corners = [(v, u) for v in range(0, height, tile) for u in range(0, width, tile)]
        strips = [np.ascontiguousarray(whole[v : v + tile, u : u + tile]).tobytes() for v, u in corners]
    if predictor == 3:
        big = np.ascontiguousarray(values.astype(values.dtype.newbyteorder(">"))).view(np.uint8)
        planes = big.reshape(height, width * channels, size).transpose(0, 2, 1).reshape(height, -1)
        planes[:, 1:] -= planes[:, :-1].copy()
        strips = [planes[k : k + rows].tobytes() for k in range(0, height, rows)]
    strips = [zlib.compress(one) for one in strips] if packed else strips
    sizes, at = [len(one) for one in strips], 8
    starts = [at + sum(sizes[:k]) for k in range(len(sizes))]
    after = at + sum(sizes)
    lists = struct.pack(f"{order}{len(sizes)}I", *starts) + struct.pack(f"{order}{len(sizes)}I", *sizes)
    tags = [(256, width), (257, height), (258, 8 * size), (259, 8 if packed else 1), (262, 1), (273, after)]
    tags += [(277, channels), (278, rows), (279, after + 4 * len(sizes)), (317, predictor), (339, 3)]
    if tile:
        tags = [one for one in tags if one[0] not in (273, 278, 279)] + [(322, tile), (323, tile)]
        tags += [(324, after), (325, after + 4 * len(sizes))]
    directory = struct.pack(f"{order}H", len(tags))
    for tag, value in tags:
        directory += struct.pack(f"{order}HHII", tag, 4, len(sizes) if tag in (273, 279, 324, 325) else 1, value)
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", after + len(lists))
    return head + b"".join(strips) + lists + directory + struct.pack(f"{order}I", 0)


@pytest.mark.parametrize("kind", ["f2", "f4", "f8"])
@pytest.mark.parametrize(
    "options",
    [
        {"tile": 64},
        {},
        {"order": ">"},
        {"packed": True},
        {"packed": True, "predictor": 3},
    ],
    ids=str,
)
def test_tiff_of_any_floats(folder, kind, options):
    (folder / "depth.tiff").write_bytes(tiff(Z.astype(kind), **options))
    np.testing.assert_array_equal(read(folder)[0].depth, Z.astype(kind).astype(np.float32))


def test_a_tiff_of_points(tmp_path):
    (tmp_path / "depth.tif").write_bytes(tiff(POINTS))
    frame, _ = read(tmp_path / "depth.tif")
    np.testing.assert_array_equal(frame.depth, F32)
    assert frame.camera.fx == pytest.approx(FOCAL, rel=1e-4)


@pytest.mark.parametrize("damage", [lambda data: data[:-40], lambda data: data[:4] + b"\xff" * 4 + data[8:]])
def test_a_broken_tiff_is_named(tmp_path, damage):
    (tmp_path / "depth.tif").write_bytes(damage(tiff(Z)))
    with pytest.raises(ValueError, match=r"depth\.tif"):
        read(tmp_path / "depth.tif", fov=60)


PACKED = np.concatenate([COLOR, np.full((240, 320, 1), 255, np.uint8)], -1).view("<f4")
PCL = np.concatenate([COLOR[..., ::-1], np.zeros((240, 320, 1), np.uint8)], -1).view("<f4")
ARRAYS = {
    "positions": POINTS,
    "64 bits": POINTS.astype(float),
    "millimetres": 1000 * POINTS,
    "OpenGL's axes": POINTS * np.float32([1, -1, -1]),
    "missing": np.where(np.arange(240)[:, None, None] < 30, np.nan, POINTS).astype(np.float32),
    "homogeneous": np.concatenate([POINTS, np.ones_like(POINTS[..., :1])], -1),
    "RGBA in a float": np.concatenate([POINTS, PACKED], -1),
    "PCL's in a float": np.concatenate([POINTS, PCL], -1),
    "six numbers": np.concatenate([POINTS, COLOR / np.float32(255)], -1),
    "seven numbers": np.concatenate([POINTS, COLOR.astype(np.float32), np.full_like(POINTS[..., :1], 255)], -1),
}


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("way", ["a folder", "a file", "depth", "an array"])
def test_points_in_a_picture_are_depth_camera_and_colours(tmp_path, name, way):
    np.save(tmp_path / "xyz.npy", ARRAYS[name])
    given = {"depth": ARRAYS[name] if way == "an array" else tmp_path / "xyz.npy"}
    source = {"a folder": tmp_path, "a file": tmp_path / "xyz.npy"}.get(way)
    frame, notes = read(source) if source else read(None, **given)
    known = frame.depth > 0
    np.testing.assert_allclose(frame.depth[known], F32[known], rtol=1e-5)
    assert known.mean() == (0.875 if name == "missing" else 1)
    numbers = frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy
    np.testing.assert_allclose(numbers, [FOCAL, FOCAL, 159.5, 119.5], rtol=1e-4)
    assert any("points (x, y, z)" in note for note in notes)
    if "float" in name or "numbers" in name:
        np.testing.assert_allclose(frame.color.astype(int), COLOR, atol=1)
        assert not any("light grey" in note for note in notes)


def test_records_in_a_picture_are_points(tmp_path):
    records = np.zeros((240, 320), [(key, "f4") for key in "xyz"] + [(key, "u1") for key in "rgba"])
    for k, key in enumerate("xyz"):
        records[key], records["rgb"[k]] = POINTS[..., k], COLOR[..., k]
    np.save(tmp_path / "scan.npy", records)
    assert not is_cloud(tmp_path / "scan.npy")
    frame, _ = read(tmp_path / "scan.npy")
    np.testing.assert_array_equal(frame.depth, F32)
    np.testing.assert_array_equal(frame.color, COLOR)


def test_three_channels_that_no_camera_sees_are_refused(tmp_path):
    np.save(tmp_path / "depth.npy", np.random.default_rng(0).random((240, 320, 3), np.float32))
    with pytest.raises(ValueError, match="no pinhole camera sees its points"):
        read(tmp_path)
    frame, _ = read(tmp_path, channel="2", fov=50)
    np.testing.assert_array_equal(frame.depth, np.load(tmp_path / "depth.npy")[..., 2])


@pytest.mark.parametrize("suffix", [".csv", ".txt"])
@pytest.mark.parametrize("between", [",", ";", "\t", " "])
def test_depth_as_text(folder, suffix, between):
    np.savetxt(folder / f"depth{suffix}", F32, "%.6f", between)
    Image.fromarray(COLOR).save(folder / "color.png")
    for source in (folder, folder / f"depth{suffix}"):
        frame, _ = read(source)
        np.testing.assert_allclose(frame.depth, F32, atol=1e-6)
        np.testing.assert_array_equal(frame.color, COLOR)


def test_text_may_have_a_head_and_whole_millimetres(folder):
    np.savetxt(folder / "depth.csv", MM, "%d", ",", header=",".join(f"column {k}" for k in range(320)), comments="")
    np.testing.assert_allclose(read(folder)[0].depth, MM / 1000, rtol=1e-6)


def test_text_whose_rows_differ_is_refused(tmp_path):
    (tmp_path / "depth.csv").write_text("\n".join(",".join("1" * (20 + k)) for k in range(20)))
    with pytest.raises(ValueError, match=r"depth\.csv is no depth as text: .* a line for each row"):
        read(None, depth=tmp_path / "depth.csv", fov=60)


def test_text_that_is_no_table_is_no_depth(folder):
    Image.fromarray(MM).save(folder / "frame.png")
    (folder / "depth_info.txt").write_text("size 320 240\nscale 1000\n")
    assert read(folder)[0].depth.shape == (240, 320)


def gdepth(near, far, form="RangeInverse", split=False, kind="OpticalAxis"):
    """A JPEG's segments with GDepth in XMP."""
    share = (Z - near) / (far - near) if form == "RangeLinear" else (1 / near - 1 / Z) / (1 / near - 1 / far)
    png = encode_png(np.rint(255 * share).astype(np.uint8))
    data = base64.b64encode(png)
    facts = (
        f'GDepth:Format="{form}" GDepth:Near="{near}" GDepth:Far="{far}" GDepth:Units="m" GDepth:MeasureType="{kind}"'
    )
    start, more = b"http://ns.adobe.com/xap/1.0/\0", b"http://ns.adobe.com/xmp/extension/\0"
    if not split:
        parts = [start + facts.encode() + b' GDepth:Data="' + data + b'"']
    else:
        whole = b'<x GDepth:Data="' + data + b'"/>'
        head = more + b"0" * 32 + struct.pack(">I", len(whole))
        parts = [start + facts.encode()]
        parts += [head + struct.pack(">I", k) + whole[k : k + 9000] for k in range(0, len(whole), 9000)]
    return b"".join(b"\xff\xe1" + struct.pack(">H", len(part) + 2) + part for part in parts)


@pytest.mark.parametrize("form", ["RangeInverse", "RangeLinear"])
@pytest.mark.parametrize("split", [False, True])
def test_a_jpeg_with_gdepth_is_a_frame(tmp_path, form, split):
    Image.fromarray(COLOR).save(tmp_path / "plain.jpg", quality=95)
    jpeg = (tmp_path / "plain.jpg").read_bytes()
    (tmp_path / "plain.jpg").unlink()
    path = tmp_path / "IMG_2017.jpg"
    path.write_bytes(jpeg[:2] + gdepth(1.0, 6.0, form, split) + jpeg[2:])
    for source in (path, tmp_path):
        frame, notes = read(source, intrinsics=(FOCAL, FOCAL, 159.5, 119.5))
        np.testing.assert_allclose(frame.depth, Z, rtol=0.015)
        assert np.abs(frame.color.astype(int) - COLOR).mean() < 3
        assert not any("light grey" in note for note in notes)


def test_gdepth_may_be_the_length_of_rays(tmp_path):
    Image.fromarray(COLOR).save(tmp_path / "a.jpg")
    jpeg = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(jpeg[:2] + gdepth(1.0, 6.0, kind="OpticRay") + jpeg[2:])
    frame, _ = read(tmp_path / "a.jpg", intrinsics=(FOCAL, FOCAL, 159.5, 119.5))
    longer = np.sqrt(1 + ((U - 159.5) / FOCAL) ** 2 + ((V - 119.5) / FOCAL) ** 2)
    np.testing.assert_allclose(frame.depth * longer, Z, rtol=0.015)


def test_an_array_of_an_npz_may_be_named(folder):
    np.savez(folder / "scan.npz", first=F32[::-1], second=F32)
    np.testing.assert_array_equal(read(folder / "scan.npz", channel="second")[0].depth, F32)
