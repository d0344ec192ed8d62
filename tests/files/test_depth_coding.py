"""What raw depth numbers mean: units, packed bits, kinds; and pictures that must stay what they are."""

import numpy as np
import pytest

from pointshade_gl.files.depth.depth_coding import decode
from pointshade_gl.files.depth.depth_files import read_depth, read_raw
from pointshade_gl.files.depth.depth_kinds import DepthHints

from ..support.rooms import kinect_disparity, room, stretched

MM = np.round(1000 * room()).astype(np.uint16)
SILENT = DepthHints()


def read(raw, said=SILENT, name="depth.png", like=None):
    """What is decoded, and the notes."""
    notes = []
    return decode(np.asarray(raw), name, said, notes.append, like), notes


def rotated(mm):
    mm = mm.astype(np.uint16)
    return (mm << 3) | (mm >> 13)


def with_confidence(mm):
    codes = np.random.default_rng(3).integers(0, 3, mm.shape).astype(np.uint16)
    return mm.astype(np.uint16) | codes << 13


U8, U16, F32 = np.ones((2, 2), np.uint8), np.ones((2, 2), np.uint16), np.ones((2, 2), np.float32)


@pytest.mark.parametrize(
    ("raw", "said", "expected"),
    [
        (MM, DepthHints(scale=5000, filed_scale=1000.0), ("z", 5000)),
        (MM, DepthHints("ray", filed_scale=5000.0), ("ray", 5000)),
        (U8, DepthHints("z", 25.5), ("z", 25.5)),
        (U8, DepthHints(scale=25.5), ("z", 25.5)),
        (F32, DepthHints("plane"), ("plane", 1)),
        (F32, DepthHints(filed_scale=1.0), ("z", 1)),
        (U8, DepthHints("inverse"), ("inverse", None)),
        (F32, DepthHints("inverse", 3), ("inverse", 3)),
        (F32, DepthHints("inverse", filed_scale=1000.0), ("inverse", None)),
        (U8, DepthHints("disparity", 4), ("disparity", 4)),
        (MM, DepthHints(filed_kind="disparity", filed_scale=16.0), ("disparity", 16)),
        (rotated(MM), DepthHints(scale=8000), ("z", 8000)),
        (5 * MM, DepthHints(scale=1000), ("z", 1000)),
        (stretched(1 / room()), DepthHints("z"), ("z", None)),
        (-F32, DepthHints("inverse"), ("inverse", None)),
    ],
)
def test_what_is_said_is_taken_without_a_note(raw, said, expected):
    decoded, notes = read(raw, said)
    assert (decoded.coding.kind, decoded.coding.scale) == expected
    np.testing.assert_array_equal(decoded.values, raw)
    assert notes == []


def with_sky(raw, far, share=0.6):
    return np.where(np.arange(raw.shape[0])[:, None] < share * raw.shape[0], raw.dtype.type(far), raw)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
@pytest.mark.parametrize(
    ("raw", "far", "scale"),
    [
        (np.float32(room()), 1000, 1),
        (np.float32(room()), 1e10, 1),
        (np.float32(room()), 65504, 1),
        (np.float32(MM), 60000, 1000),
        (MM, 65535, 1000),
    ],
)
def test_a_unit_is_that_of_what_stands_before_a_far_plane(raw, far, scale, share):
    decoded, notes = read(with_sky(raw, far, share))
    assert decoded.coding.scale == scale
    assert not any(f"{far:g}" in note or "middle is" in note for note in notes), notes


@pytest.mark.parametrize(
    ("raw", "said", "scale", "sentence"),
    [
        (MM, SILENT, 1000, "without depth_scale: taken as millimetres (1000 per metre)"),
        (5 * MM, SILENT, 5000, "taken as 5000 a metre (TUM's)"),
        (10 * MM, SILENT, 1000, "its middle is at 34.5 m; if that is wrong, pass depth_scale"),
        (MM // 100, SILENT, 1000, "its middle is at 0.034 m; if that is wrong"),
        (MM.astype(np.float32), SILENT, 1000, "its middle at 3447: taken as millimetres; pass depth_scale=1"),
        (np.float32(MM // 10), SILENT, 1000, "its middle at 344: taken as millimetres"),
        (np.float32(MM // 50), SILENT, 1000, "its middle at 68: taken as millimetres"),
        (np.float32(0.01 * room()), SILENT, 1, "its middle at 0.0345 m; pass depth_scale"),
        (
            np.float32(MM),
            DepthHints(filed_scale=1.0),
            1000,
            "depth_scale 1, which puts the middle at 3.45e+03 m: taken as 1000",
        ),
        (np.float32(MM), DepthHints(filed_scale=1000.0), 1000, "divided by 1000, as its file or the camera's says"),
        (np.float32(room()), DepthHints(filed_scale=1000.0), 1, "at 0.00345 m: taken as 1 a metre"),
        (
            MM,
            DepthHints(filed_scale=0.001),
            1000,
            "depth_scale 0.001, which puts the middle at 3.45e+06 m: taken as 1000",
        ),
        (5 * MM, DepthHints(filed_scale=0.0002), 5000, "taken as 5000 a metre"),
        (MM, DepthHints(filed_scale=1.0), 1000, "taken as 1000 a metre"),
        (10 * MM, DepthHints(filed_scale=0.1), 10000, "taken as 10000 a metre"),
        (
            5 * MM,
            DepthHints(filed_scale=1000.0),
            1000,
            "spaced like TUM's: pass depth_scale=5000 if all is too far away",
        ),
        (MM, DepthHints(filed_scale=1e6), 1e6, "pass depth_scale (raw values per metre) if that is wrong"),
    ],
)
def test_a_unit_that_is_guessed_is_told(raw, said, scale, sentence):
    decoded, notes = read(raw, said)
    assert (decoded.coding.kind, decoded.coding.scale) == ("z", pytest.approx(scale))
    assert len(notes) == 1 and sentence in notes[0]


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        (MM.byteswap(), "in the wrong byte order, read byte-swapped"),
        (MM.byteswap().astype(np.int32), "in the wrong byte order"),
        (rotated(MM), "taken as SUN RGB-D's millimetres, rotated by 3 bits"),
        (with_confidence(MM), "taken as Android's DEPTH16"),
    ],
    ids=["swapped", "swapped int32", "rotated", "confidence"],
)
def test_packed_bits_become_millimetres(raw, sentence):
    decoded, notes = read(raw)
    np.testing.assert_array_equal(decoded.values, MM)
    assert (decoded.coding.kind, decoded.coding.scale) == ("z", 1000)
    assert sentence in notes[0]


def test_rotated_bits_beyond_8_metres_come_back():
    far = np.round(3000 * room()).astype(np.uint16)
    assert 0.5 < (far > 8191).mean() < 0.9
    decoded, _ = read(rotated(far))
    np.testing.assert_array_equal(decoded.values, far)


def test_confidence_bits_are_dropped_whatever_scale_is_said():
    decoded, notes = read(with_confidence(5 * MM // 4), DepthHints(scale=5000))
    np.testing.assert_array_equal(decoded.values, 5 * MM // 4)
    assert decoded.coding.scale == 5000 and len(notes) == 1


@pytest.mark.parametrize(
    "raw",
    [
        16 * (MM // 2),
        100 * (MM // 100),
        np.full_like(MM, 2048),
        np.full_like(MM, 2050),
        np.random.default_rng(1).integers(0, 65536, MM.shape).astype(np.uint16),
        np.random.default_rng(1).normal(2000, 300, MM.shape).astype(np.uint16),
        MM + np.uint16(6000),
        MM * np.uint16(13),
        (8 * MM) | np.random.default_rng(2).integers(0, 7, MM.shape).astype(np.uint16),
    ],
    ids=["multiples of 16", "decimetres", "a wall", "another", "noise", "noisy wall", "8 m", "wide", "8+"],
)
def test_plain_numbers_stay_as_they_are(raw):
    raw = raw.astype(np.uint16)
    decoded, notes = read(raw)
    np.testing.assert_array_equal(decoded.values, raw)
    assert (decoded.coding.kind, decoded.coding.scale) == ("z", 1000)
    assert len(notes) == 1 and "taken as millimetres" in notes[0]


def test_raw_disparity_of_a_kinect_is_known_by_2047():
    metres = room()
    metres[40:60, 30:50] = 0
    decoded, notes = read(kinect_disparity(metres))
    assert decoded.coding.kind == "kinect"
    assert len(notes) == 1 and "raw disparity of a first Kinect (2047 is missing); pass depth_kind='z'" in notes[0]


def test_near_millimetres_with_a_hole_at_2047_are_no_disparity():
    near = MM // 3
    near[40:60, 30:50] = 2047
    assert ((near > 1090) & (near < 2047)).any()
    assert read(near)[0].coding.kind == "z"


@pytest.mark.parametrize(("scale", "focal"), [(5000, 535), (5000, 580), (5000, 620)])
def test_a_kinects_steps_tell_tums_scale(scale, focal):
    metres = np.kron(room(), np.ones((4, 4)))
    metres = 8 * 0.075 * focal / np.round(8 * 0.075 * focal / metres)
    decoded, notes = read(np.round(scale * metres).astype(np.uint16))
    assert decoded.coding.scale == 5000
    assert len(notes) == 1 and "pass depth_scale=1000 if it is in millimetres" in notes[0]
    assert read(np.round(1000 * metres).astype(np.uint16))[0].coding.scale == 1000
    assert read(np.round(4000 * metres).astype(np.uint16))[0].coding.scale == 1000  # not known; its middle is told


def test_other_steps_tell_no_scale():
    """RealSense measures 1/32 px, and a denoised Kinect measures anything."""
    metres = 3 * np.kron(room(), np.ones((4, 4)))
    for constant in (32 * 0.05 * 617, 32 * 0.095 * 385, 32 * 0.055 * 617):
        stereo = constant / np.round(constant / metres)
        assert read(np.round(1000 * stereo).astype(np.uint16))[0].coding.scale == 1000
    noisy = metres + np.random.default_rng(3).normal(0, 0.02, metres.shape)
    assert read(np.round(5000 * noisy).astype(np.uint16) // 3)[0].coding.scale == 1000


@pytest.mark.parametrize(("dtype", "share"), [(np.float32, "0.5%"), (np.int16, "0.5%")])
def test_negative_values_are_dropped_with_their_share(dtype, share):
    raw = MM.astype(dtype)
    raw[:, :16][:6] = -1
    _, notes = read(raw, DepthHints("z", 1000))
    assert len(notes) == 1 and notes[0].startswith(f"{share} of depth.png is negative, and taken as missing")


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf, "1000"])
def test_depth_scale_is_a_number_above_0(scale):
    error = TypeError if isinstance(scale, str) else ValueError
    with pytest.raises(error, match=f"depth_scale must be a finite number above 0, got {scale!r}"):
        read(U16, DepthHints(scale=scale))


@pytest.mark.parametrize("raw", [rotated(MM), with_confidence(MM), 257 * stretched(room()).astype(np.uint16)])
def test_the_next_frame_is_read_as_the_first_one(raw):
    first, _ = read(raw)
    assert first.coding.repairs
    plane = np.full_like(raw, 2 * int(raw.max() // 2))
    again, notes = read(np.concatenate([raw, plane]), like=first.coding)
    np.testing.assert_array_equal(again.values[: raw.shape[0]], first.values)
    assert (again.coding.kind, again.coding.scale, again.coding.repairs) == (
        first.coding.kind,
        first.coding.scale,
        first.coding.repairs,
    )
    assert notes == []
    with pytest.raises(ValueError, match="depth must be of 16 bits, as the first one is, got float32"):
        read(F32, like=first.coding)


@pytest.mark.parametrize("dtype", ["u1", "<u2", "<u4", "<f4", "<f8"])
def test_a_file_without_a_header_is_read_by_its_size(tmp_path, dtype):
    depth = (MM % 251 if dtype == "u1" else MM).astype(dtype)
    depth.tofile(tmp_path / "depth.bin")
    raw = read_raw(tmp_path / "depth.bin", 160, 120)
    assert raw.dtype == np.dtype(dtype).newbyteorder("=")
    np.testing.assert_array_equal(raw, depth)
    with pytest.raises(ValueError, match=r"expected 1, 2, 4 or 8 for each of 161x120 pixels"):
        read_raw(tmp_path / "depth.bin", 161, 120)


@pytest.mark.data
def test_tums_frame_needs_no_file_that_tells_its_scale(shared_data):
    raw = read_depth(shared_data / "tum_fr3_kinect1" / "depth.png", print)
    decoded, notes = read(raw)
    assert decoded.coding.scale == 5000 and len(notes) == 1
    assert read(np.round(raw / 5).astype(np.uint16))[0].coding.scale == 1000


@pytest.mark.data
def test_androids_raw_file_is_the_picture_that_its_author_made_of_it(shared_data):
    folder = shared_data / "odd_android_depth16"
    decoded, notes = read(read_raw(folder / "depth16.bin", 240, 180), DepthHints(filed_scale=1000.0))
    author = read_depth(folder / "depth16_from_author.png", print)
    np.testing.assert_array_equal(5 * decoded.values, author)
    assert decoded.coding.scale == 1000 and len(notes) == 1
    assert read(author)[0].coding.scale == 5000


@pytest.mark.data
def test_raw_floats_of_the_object_are_read_as_its_array(shared_data):
    folder = shared_data / "d2nt_3f2n_gt_normals"
    raw = read_raw(folder / "depth.bin", 640, 480)
    seen = np.load(folder / "depth.npy") > 0
    np.testing.assert_array_equal(raw[seen], np.load(folder / "depth.npy")[seen])


@pytest.mark.data
def test_no_real_frame_is_taken_for_another_coding(shared_data):
    """Every shared frame, in the unit that it has, with nothing said: only the unit is a guess."""
    paths = [*shared_data.glob("*/depth.png"), *shared_data.glob("icl_*/depth/*.png"), *shared_data.glob("*/depth.exr")]
    checked = 0
    for path in paths:
        raw = read_depth(path, print)
        if raw.ndim == 3 or "tum" in str(path):
            continue
        decoded, notes = read(raw)
        assert (decoded.coding.kind, decoded.coding.repairs) == ("z", ())
        assert decoded.coding.scale == (1 if raw.dtype.kind == "f" else 1000)
        assert len(notes) == (raw.dtype.kind != "f"), (path, notes)
        assert read(raw / 1000 if raw.dtype.kind == "u" else raw)[1] == []  # in metres, as floating point
        checked += 1
    assert checked >= 30


def test_another_word_about_the_next_frame_is_heard():
    first, _ = read(5 * MM)
    assert read(MM, like=first.coding)[0].coding.scale == 5000
    assert read(MM, DepthHints(filed_scale=1000.0), like=first.coding)[0].coding.scale == 1000
