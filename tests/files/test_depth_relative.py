"""Depth without distances: what networks write, 8 bits, disparity; and depth that is none of it."""

import io

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_coding import decode
from pointshade_gl.files.depth.depth_files import read_depth
from pointshade_gl.files.depth.depth_kinds import DepthHints, to_metres
from pointshade_gl.files.depth.missing_depth import FAR
from pointshade_gl.files.depth.planes import measure_bending

from ..support.rooms import F, room, stretched

Z = room(240, 320)
CAMERA = ps.Camera(2 * F, 2 * F, 159.5, 119.5, 320, 240)


def read(raw, said=DepthHints(), name="depth.npy"):  # noqa: B008 a frozen value
    """What is decoded, and the notes."""
    notes = []
    return decode(np.asarray(raw), name, said, notes.append), notes


def as_jpeg(image, quality=75):
    """A picture after JPEG."""
    file = io.BytesIO()
    Image.fromarray(image).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def frames(shared_data):
    """(name, z, known) of real frames, in metres."""
    paths = [*shared_data.glob("*/depth.png"), *sorted(shared_data.glob("icl_*/depth/*.png"))[::3]]
    for path in [*paths, shared_data / "d435_table_exr_halffloat" / "depth.exr"]:
        raw = read_depth(path, print)
        if raw.ndim == 2:
            z = raw.astype(np.float64) / (5000 if "tum" in str(path) else 1000 if raw.dtype.kind == "u" else 1)
            known = np.isfinite(z) & (z > 0) & (z * 1000 < FAR)
            yield f"{path.parent.name}/{path.stem}", np.where(known, z, 0), known


def test_planes_bend_by_2_in_depth_and_not_in_inverse_depth():
    known = np.ones(Z.shape, bool)
    for noise in (0, 0.005):
        z = room(240, 320, noise)
        depth, inverse = measure_bending(z, known), measure_bending(1 / z, known)
        assert depth is not None and inverse is not None
        assert (depth.along, inverse.along) == pytest.approx((2, 0), abs=0.1)
        assert abs(depth.across) < 0.05 and abs(inverse.across) < 0.05


def test_no_bending_is_measured_where_planes_are_too_few():
    v, u = np.mgrid[:240, :320] / 100
    known = np.ones(Z.shape, bool)
    for picture in (np.full(Z.shape, 2.0), 2 + u, 3 - u + v, np.random.default_rng(1).random(Z.shape)):
        assert measure_bending(picture, known) is None
    assert measure_bending(Z, ~known) is None
    assert measure_bending(Z[:6, :6], known[:6, :6]) is None


@pytest.mark.parametrize(
    "raw",
    [
        1 / Z,
        8 / Z + 3,
        3000 / Z,
        stretched(1 / Z, 65535) / 65535,
        3 / Z - 1.2,
        stretched(1 / room(240, 320, 0.003), 65535),
    ],
    ids=["1/z", "offset", "MiDaS", "0..1", "negative", "16 bits"],
)
def test_a_networks_inverse_depth_is_known_by_its_planes(raw):
    raw = raw if raw.dtype.kind == "u" else raw.astype(np.float32)
    decoded, notes = read(raw)
    assert (decoded.coding.kind, decoded.coding.scale) == ("inverse", None)
    assert len(notes) == 1 and "taken as a network's inverse depth" in notes[0] and "depth_kind='z'" in notes[0]


@pytest.mark.parametrize("raw", [stretched(Z, 65535), np.float32(stretched(Z, 65535)) / 65535], ids=["16 bits", "0..1"])
def test_depth_without_a_scale_that_fills_its_range_is_known_by_its_planes(raw):
    decoded, notes = read(raw)
    assert (decoded.coding.kind, decoded.coding.scale) == ("z", None)
    assert len(notes) == 1 and "pass depth_scale if it has one" in notes[0]
    laid = to_metres(raw, CAMERA, "z", None, None, [].append)
    assert np.corrcoef(laid.ravel(), Z.ravel())[0, 1] > 0.9999 and (laid.min(), laid.max()) == (1, 10)


def test_a_filled_range_without_planes_is_told():
    _, notes = read(
        np.random.default_rng(1).integers(0, 65536, (200, 300)).cumsum(axis=1).astype(np.uint16) // 2 * 2 + 1
    )
    assert len(notes) == 2 and "fills its whole range" in notes[0] and "pass depth_kind='inverse'" in notes[0]


@pytest.mark.parametrize("shape", ["z", "ramp", "wall", "noise", "ball"])
def test_depth_in_metres_stays_depth(shape):
    v, u = np.mgrid[-1:1:240j, -1.3:1.3:320j]
    pictures = {
        "z": Z,
        "ramp": 2 + u,
        "wall": np.full(Z.shape, 2.0),
        "noise": np.random.default_rng(2).normal(3, 0.3, Z.shape),
        "ball": 3 - np.sqrt((1 - u * u - v * v).clip(0)),
    }
    decoded, notes = read(pictures[shape].astype(np.float32))
    assert (decoded.coding.kind, decoded.coding.scale, notes) == ("z", 1, [])


@pytest.mark.parametrize("grey", [stretched(1 / Z), as_jpeg(stretched(1 / Z)), stretched(1 / Z)[::16, ::16]])
def test_8_bits_are_inverse_depth(grey):
    decoded, notes = read(grey, name="depth.png")
    assert (decoded.coding.kind, decoded.coding.scale) == ("inverse", None)
    assert len(notes) == 1 and "bright is near; pass depth_kind='z' if bright is far" in notes[0]


def test_8_bits_stored_in_16_are_read_as_8():
    for factor in (256, 257):
        decoded, notes = read(factor * stretched(1 / Z).astype(np.uint16), name="depth.png")
        assert decoded.coding.kind == "inverse" and decoded.values.dtype == np.uint8
        assert len(notes) == 1 and "has 8 bits" in notes[0]


def test_8_bits_whose_planes_bend_are_depth_and_0_is_missing_where_it_stands_alone():
    decoded, notes = read(stretched(Z), name="depth.png")
    assert (decoded.coding.kind, decoded.coding.scale) == ("z", None)
    assert len(notes) == 1 and "bright is far" in notes[0] and "pass depth_kind='inverse'" in notes[0]
    grey = np.round(Z * 50).astype(np.uint8)
    grey[100:120, 150:170] = 0
    decoded, _ = read(grey, name="depth.png")
    metres = to_metres(grey, CAMERA, "z", decoded.coding.scale, None, print)
    assert not metres[100:120, 150:170].any()
    known = metres > 0
    assert np.median(metres[known]) == pytest.approx(2, rel=0.01)
    np.testing.assert_allclose(metres[known] / Z[known], 2 / np.median(Z[known]), rtol=0.03)


def test_8_bits_with_a_scale_in_the_cameras_file_are_depth():
    decoded, notes = read(np.round(Z * 50).astype(np.uint8), DepthHints(filed_scale=50.0))
    assert (decoded.coding.kind, decoded.coding.scale, notes) == ("z", 50, [])
    assert read(stretched(1 / Z), DepthHints(filed_scale=1000.0))[0].coding.kind == "inverse"


@pytest.mark.parametrize(
    ("picture", "sentence"),
    [
        (np.kron(np.eye(12, dtype=np.uint8), np.full((20, 20), 255, np.uint8)), "looks like a mask"),
        (np.kron(np.random.default_rng(5).integers(0, 40, (12, 16)), np.ones((20, 20))), "looks like a map of labels"),
        (np.random.default_rng(5).normal(120, 9, (240, 320)), "looks like a photograph"),
    ],
)
def test_8_bit_pictures_of_anything_else_are_refused_with_a_way_out(picture, sentence):
    picture = picture.astype(np.uint8)
    with pytest.raises(ValueError, match=sentence + r".*pass another file, or depth_kind='inverse' or 'z'"):
        read(picture, name="depth.png")
    assert read(picture, DepthHints("inverse"))[0].coding.kind == "inverse"


def test_labels_of_16_bits_are_told_and_steps_of_depth_are_not():
    labels = np.kron(np.random.default_rng(5).integers(1, 40, (12, 16)), np.ones((20, 20))).astype(np.uint16)
    _, notes = read(100 * labels, name="depth.png")
    assert len(notes) == 2 and "looks like a map of labels" in notes[0]
    for steps in (np.round(Z * 10) * 100, np.full(Z.shape, 2000), np.where(Z > 3, 4000, 2000)):
        assert len(read(steps.astype(np.uint16), name="depth.png")[1]) == 1


@pytest.mark.parametrize("kind", ["ray", "plane"])
def test_256_levels_of_a_distance_need_a_scale(kind):
    with pytest.raises(ValueError, match=rf"too few for distances of kind {kind}: pass depth_scale .*='inverse'"):
        read(stretched(Z), DepthHints(kind))


@pytest.mark.parametrize("name", ["disp0.pfm", "left_disp.npy", "a/disparity.png", "img.Disp.exr"])
def test_disparity_is_known_by_its_name(name):
    disparity = (40 / Z).astype(np.float32)
    decoded, notes = read(disparity, DepthHints(has_baseline=True), name)
    assert (decoded.coding.kind, decoded.coding.scale) == ("disparity", 1)
    assert len(notes) == 1 and "is taken as disparity" in notes[0]
    decoded, notes = read(disparity, name=name)
    assert len(notes) == 1 and "without baseline (metres between the cameras)" in notes[0]
    metres = to_metres(disparity, CAMERA, decoded.coding.kind, decoded.coding.scale, None, print)
    np.testing.assert_allclose(metres, Z * 2 / np.median(Z), rtol=1e-5)


def test_other_names_are_no_disparity_and_a_said_kind_wins():
    for name in ("display.npy", "dispatch/depth.npy", "undisputed.npy"):
        assert read(Z.astype(np.float32), DepthHints(has_baseline=True), name)[0].coding.kind == "z"
    assert read(Z.astype(np.float32), DepthHints("z"), "disp.npy")[0].coding.kind == "z"


def test_kittis_disparity_has_256_values_a_pixel():
    decoded, notes = read((256 * 40 / Z).astype(np.uint16), DepthHints(has_baseline=True), "disp.png")
    assert (decoded.coding.kind, decoded.coding.scale) == ("disparity", 256)
    assert len(notes) == 2 and "divided by 256, as in KITTI" in notes[1]
    assert read((40 / Z).astype(np.uint16), DepthHints("disparity"))[0].coding.scale == 1


@pytest.mark.data
def test_real_frames_as_networks_would_write_them(shared_data):
    """No z is taken for inverse depth; inverse depth is known, or told to be possible."""
    total = found = 0
    for name, z, known in frames(shared_data):
        low, high = np.quantile(z[known], (0.002, 0.998))
        depth = np.where(known, (z - low) / (high - low), np.nan).clip(0, 1)
        inverse = np.where(known, (1 / np.where(known, z, 1) - 1 / high) / (1 / low - 1 / high), np.nan).clip(0, 1)
        for raw in (z.astype(np.float32), depth.astype(np.float32), (0.2 + depth * 20).astype(np.float32)):
            assert read(raw)[0].coding.kind == "z", name
        decoded, notes = read((0.3 + 8 * inverse).astype(np.float32))
        total, found = total + 1, found + (decoded.coding.kind == "inverse")
        decoded, notes = read(np.where(known, np.round(255 * inverse), 0).astype(np.uint8))
        assert decoded.coding.kind == "inverse" and len(notes) == 1, name
    assert total >= 15 and found >= 0.8 * total


@pytest.mark.data
def test_grey_photographs_are_no_depth(shared_data):
    for path in [*shared_data.glob("*/color.jpg"), *shared_data.glob("icl_*/color/*.jpg")]:
        with pytest.raises(ValueError, match="looks like a photograph"):
            read(np.asarray(Image.open(path).convert("L")), name=str(path))


@pytest.mark.parametrize("fill", [np.nan, np.inf, -np.inf, 1e38, -1e38, 0])
def test_hopeless_values_are_no_accident(fill):
    raw = Z.astype(np.float32)
    raw[::2], raw[0, :3] = fill, (np.inf, -np.inf, np.nan)
    assert read(raw)[0].coding.kind == "z"  # a warning would be an error here
    assert read(np.full_like(raw, fill))[0].coding.kind == "z"
