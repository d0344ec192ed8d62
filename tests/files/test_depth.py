"""Depth files: every format gives the stored numbers; what is not depth is refused with a reason."""

import sys

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.files.depth.depth_files import one_channel, read_depth

V, U = np.mgrid[0:30, 0:40]
DEEP = (900 + 3 * U + 5 * V).astype(np.uint16)  # a smooth slope
METRES = DEEP.astype(np.float32) / 1000


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def check(path, expected, dtype=None):
    raw = read_depth(path, refuse)
    assert raw.dtype == (dtype or expected.dtype)
    np.testing.assert_array_equal(raw, expected)


@pytest.mark.parametrize("depth", [DEEP, METRES, DEEP.astype(np.int32)], ids=["uint16", "float32", "int32"])
@pytest.mark.parametrize("compression", ["raw", "tiff_deflate", "tiff_lzw"])
def test_tiff(tmp_path, depth, compression):
    Image.fromarray(depth).save(tmp_path / "depth.tif", compression=compression)
    check(tmp_path / "depth.tif", depth)


def test_png_of_16_bits(tmp_path):
    Image.fromarray(DEEP).save(tmp_path / "depth.png")
    check(tmp_path / "depth.png", DEEP)


@pytest.mark.parametrize(("order", "mark"), [("<f4", b"-1.0"), (">f4", b"1.0")], ids=["little", "big"])
def test_pfm_rows_run_upwards_in_either_byte_order(tmp_path, order, mark):
    (tmp_path / "depth.pfm").write_bytes(b"Pf\n40 30\n" + mark + b"\n" + METRES[::-1].astype(order).tobytes())
    check(tmp_path / "depth.pfm", METRES)


@pytest.mark.parametrize("dtype", ["u1", "u2", ">u2", "i4", "i8", "f2", "f4", "f8"])
def test_npy_of_any_number(tmp_path, dtype):
    depth = (DEEP % 251).astype(dtype)
    np.save(tmp_path / "depth.npy", depth)
    check(tmp_path / "depth.npy", depth)


@pytest.mark.parametrize("shape", [(30, 40, 1), (1, 30, 40), (1, 30, 40, 1)])
def test_axes_of_length_1_are_dropped(shape):
    np.testing.assert_array_equal(one_channel(METRES.reshape(shape), "depth"), METRES)


def test_npz_with_one_array_or_one_called_depth(tmp_path):
    np.savez(tmp_path / "one.npz", METRES)
    check(tmp_path / "one.npz", METRES)
    notes = []
    np.savez(tmp_path / "many.npz", confidence=DEEP, depth=METRES)
    np.testing.assert_array_equal(read_depth(tmp_path / "many.npz", notes.append), METRES)
    assert len(notes) == 1 and "depth is taken" in notes[0]


def test_npz_with_several_arrays_is_refused(tmp_path):
    np.savez(tmp_path / "depth.npz", a=DEEP, b=METRES)
    with pytest.raises(ValueError, match="must hold one array or one named depth, got a, b"):
        read_depth(tmp_path / "depth.npz", refuse)


def test_the_content_tells_the_format_not_the_suffix(tmp_path):
    with (tmp_path / "depth.png").open("wb") as file:
        np.save(file, METRES)
    check(tmp_path / "depth.png", METRES)


@pytest.mark.parametrize(
    "header", ["P5\n40 30\n65535\n", "P5 40 30 4095\n", "P5\n# made by a camera\n40 30 # size\n65535\n"]
)
def test_pgm_values_are_not_stretched_to_the_maximum(tmp_path, header):
    (tmp_path / "depth.pgm").write_bytes(header.encode() + DEEP.astype(">u2").tobytes())
    check(tmp_path / "depth.pgm", DEEP)


def test_pgm_of_text_and_of_8_bits(tmp_path):
    (tmp_path / "text.pgm").write_text("P2\n40 30\n4095\n" + "\n".join(" ".join(map(str, row)) for row in DEEP))
    check(tmp_path / "text.pgm", DEEP)
    (tmp_path / "bytes.pgm").write_bytes(b"P5 40 30 200\n" + (DEEP % 200).astype(np.uint8).tobytes())
    check(tmp_path / "bytes.pgm", (DEEP % 200).astype(np.uint8))


def test_pgm_in_the_wrong_byte_order_keeps_its_values_for_the_decoder(tmp_path):
    (tmp_path / "depth.pgm").write_bytes(b"P5 40 30 65535\n" + DEEP.astype("<u2").tobytes())
    check(tmp_path / "depth.pgm", DEEP.byteswap())


@pytest.mark.parametrize(
    "depth", [(DEEP % 200) << 8, np.full_like(DEEP, 258)], ids=["8 bits in the high byte", "constant"]
)
def test_pgm_that_could_be_in_either_byte_order_is_read_by_the_rule(tmp_path, depth):
    (tmp_path / "depth.pgm").write_bytes(b"P5 40 30 65535\n" + depth.astype(">u2").tobytes())
    check(tmp_path / "depth.pgm", depth)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"P5 40 30 65535\n" + bytes(999), "is truncated: expected 1200 pixels, got 499"),
        (b"P5 40 thirty 255\n", "a PGM with a broken header"),
        (b"P5 40 0 255\n", "a PGM of 40x0 with maximum 255"),
        (b"P2 2 1 255\n7 x", "expected nothing but whole numbers"),
    ],
)
def test_broken_pgm(tmp_path, content, sentence):
    (tmp_path / "depth.pgm").write_bytes(content)
    with pytest.raises(ValueError, match=sentence):
        read_depth(tmp_path / "depth.pgm", refuse)


def write_exr(path, **channels):
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File({"type": openexr.scanlineimage}, channels) as file:
        file.write(str(path))


OTHER = METRES + 1


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize(
    "names",
    [
        ["Z"],
        ["Y"],
        ["V"],
        ["R", "G", "B"],
        ["ViewLayer.Depth.V", "other:A"],
        ["Z", "other:A", "other:R"],
        ["Z", "other:Y"],
    ],
    ids=" ".join,
)
def test_exr_channels_by_name(tmp_path, dtype, names):
    channels = {
        name.removeprefix("other:"): (OTHER if name.startswith("other:") else METRES).astype(dtype) for name in names
    }
    write_exr(tmp_path / "depth.exr", **channels)
    check(tmp_path / "depth.exr", METRES.astype(dtype))


def test_exr_holes_count_as_equal_in_three_channels(tmp_path):
    holed = METRES.copy()
    holed[3, 4] = np.nan
    write_exr(tmp_path / "depth.exr", R=holed, G=holed, B=holed)
    check(tmp_path / "depth.exr", holed)


@pytest.mark.parametrize("names", ["RGB", "XYZ"])
def test_exr_normals_are_no_depth(tmp_path, names):
    write_exr(tmp_path / "depth.exr", **{name: METRES + i for i, name in enumerate(names)})
    with pytest.raises(ValueError, match=r"has the channels ., ., ., which differ: expected one"):
        read_depth(tmp_path / "depth.exr", refuse)


def test_exr_without_its_package_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "depth.exr").write_bytes(b"\x76\x2f\x31\x01" + bytes(60))
    monkeypatch.setitem(sys.modules, "OpenEXR", None)  # makes the import fail
    with pytest.raises(ValueError, match=r"is an EXR picture: pip install '\.\[exr\]' in the clone"):
        read_depth(tmp_path / "depth.exr", refuse)


def test_truncated_exr(tmp_path):
    write_exr(tmp_path / "depth.exr", Z=METRES)
    data = (tmp_path / "depth.exr").read_bytes()
    (tmp_path / "depth.exr").write_bytes(data[: len(data) // 2])
    with pytest.raises(ValueError, match="is a broken or truncated EXR picture"):
        read_depth(tmp_path / "depth.exr", refuse)


def test_broken_numpy_files(tmp_path):
    np.save(tmp_path / "depth.npy", METRES)
    (tmp_path / "depth.npy").write_bytes((tmp_path / "depth.npy").read_bytes()[:500])
    np.save(tmp_path / "objects.npy", np.array([{}], dtype=object), allow_pickle=True)
    (tmp_path / "depth.npz").write_bytes(b"PK\x03\x04" + bytes(40))
    for name in ("depth.npy", "objects.npy", "depth.npz"):
        with pytest.raises(ValueError, match=f"{name} is a broken NumPy file, or one with Python objects"):
            read_depth(tmp_path / name, refuse)


def test_a_colour_mapped_picture_keeps_its_colours_for_the_decoder(tmp_path):
    ramp = (DEEP % 256).astype(np.uint8)
    colors = np.stack([ramp, 255 - ramp, ramp], axis=2)
    Image.fromarray(colors).save(tmp_path / "depth.png")
    check(tmp_path / "depth.png", colors)


@pytest.mark.parametrize("channels", [3, 4])
def test_equal_channels_are_grey(tmp_path, channels):
    ramp = (DEEP % 256).astype(np.uint8)
    Image.fromarray(np.stack([ramp] * 3 + [np.full_like(ramp, 255)] * (channels - 3), axis=2)).save(
        tmp_path / "depth.png"
    )
    check(tmp_path / "depth.png", ramp)


@pytest.mark.parametrize(
    ("array", "sentence"),
    [
        (np.ones((30, 40, 2)), r"depth must have shape \(h, w\), got \(30, 40, 2\)"),
        (np.ones(30), r"got \(30,\)"),
        (np.ones((0, 40)), r"got \(0, 40\)"),
        (np.ones((30, 40), bool), "must hold integer or floating point depth, got bool"),
        (np.arange(3600).reshape(30, 40, 3), "has 3 channels that differ"),
    ],
)
def test_arrays_that_are_no_depth(array, sentence):
    with pytest.raises(ValueError, match=sentence):
        one_channel(array, "depth")


@pytest.mark.data
def test_several_channels_of_16_bits_that_differ_are_refused(shared_data):
    with pytest.raises(ValueError, match="has 4 channels that differ"):
        read_depth(shared_data / "odd_color_16bit_rgba" / "color.png", refuse)
