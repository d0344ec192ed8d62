"""Colour-mapped pictures of depth: which map it is, and the levels that come back."""

import io

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.files.access.known_names import asset
from pointshade_gl.files.depth.depth_coding import decode
from pointshade_gl.files.depth.depth_files import MAPS, read_depth, read_levels
from pointshade_gl.files.depth.depth_kinds import DepthHints
from pointshade_gl.files.frames.frame_parts import ReadOptions
from pointshade_gl.files.frames.sequences import open_frames

from ..support.rooms import room, stretched

TABLES = dict(zip(MAPS, np.asarray(Image.open(asset("colormaps.png"))), strict=True))
Z = room(240, 320)
NEAR, DEEP = stretched(1 / Z), stretched(Z)


def as_jpeg(image, quality):
    """A picture after JPEG."""
    file = io.BytesIO()
    Image.fromarray(image).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def read(image, said=DepthHints()):  # noqa: B008 a frozen value
    """What is decoded, and the notes."""
    notes = []
    return decode(image, "depth.png", said, notes.append), notes


def levels_of(image):
    """Levels, checked to be there."""
    levels = read_levels(image)
    assert levels is not None
    return levels


@pytest.mark.parametrize("name", MAPS)
def test_tables_are_matplotlibs(name):
    matplotlib = pytest.importorskip("matplotlib")
    np.testing.assert_array_equal(TABLES[name], matplotlib.colormaps[name](np.arange(256), bytes=True)[:, :3])


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("channels", [3, 4])
def test_levels_come_back_exactly(name, channels):
    image = np.full((*NEAR.shape, channels), 255, np.uint8)
    image[..., :3] = TABLES[name][NEAR]
    levels = levels_of(image)
    assert levels.name == name
    np.testing.assert_array_equal(TABLES[name][levels.values.astype(int)], image[..., :3])
    assert (levels.values == NEAR).mean() > 0.95  # a few neighbours in jet and viridis are equal


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("quality", [90, 75])
def test_levels_come_back_from_jpeg(name, quality):
    levels = levels_of(as_jpeg(TABLES[name][NEAR], quality))
    error = np.abs(levels.values - NEAR)
    assert levels.name == name
    assert np.nanmean(error) < 2 and np.isnan(error).mean() < 0.03


def test_transparent_pixels_and_other_colours_are_holes():
    image = np.full((*NEAR.shape, 4), 255, np.uint8)
    image[..., :3] = TABLES["viridis"][NEAR]
    image[:20, :, 3] = 0
    image[20:30] = 0, 0, 0, 255
    image[30:40] = 255
    holes = np.isnan(levels_of(image).values)
    assert holes[:40].all() and not holes[40:].any()


@pytest.mark.parametrize(("name", "end"), MAPS.items())
def test_inverse_depth_is_near_at_the_maps_upper_end(name, end):
    decoded, notes = read(TABLES[name][NEAR])
    assert (decoded.coding.kind, decoded.coding.scale) == ("inverse", None)
    assert len(notes) == 1 and f"({name}), read back in 256 steps as inverse depth: {end} is taken as near" in notes[0]
    assert "pass depth_kind='z' if it is far" in notes[0]


@pytest.mark.parametrize("name", ["jet", "magma", "Spectral_r"])
def test_depth_is_known_by_its_planes_either_way_round(name):
    for image, where in ((TABLES[name][DEEP], "far"), (TABLES[name][255 - DEEP], "near")):
        decoded, notes = read(image)
        assert (decoded.coding.kind, decoded.coding.scale) == ("z", None)
        assert len(notes) == 1 and f"{MAPS[name]} is {where}" in notes[0]
        assert np.corrcoef(decoded.values.ravel(), Z.ravel())[0, 1] > 0.999
        again = decode(image, "next.png", DepthHints(), print, decoded.coding)
        np.testing.assert_array_equal(again.values, decoded.values)


def test_a_sequence_is_read_like_its_first_frame(tmp_path):
    v, u = np.mgrid[-1:1:240j, -1.3:1.3:320j]
    waves = TABLES["jet"][np.round(100 + 60 * np.sin(3 * u) * np.cos(3 * v)).astype(np.uint8)]  # no plane in it
    assert read(waves)[0].coding.kind == "inverse"
    (tmp_path / "depth").mkdir()
    for index, image in enumerate((TABLES["jet"][DEEP], waves)):
        Image.fromarray(image).save(tmp_path / "depth" / f"{index}.png")
    notes = []
    frames = open_frames(tmp_path, False, ReadOptions(fov=50), notes.append)
    assert [frames.assembled(k).coding.kind for k in (0, 1)] == ["z", "z"]
    assert sum("colour-mapped" in note for note in notes) == 1


def test_a_said_kind_or_scale_wins():
    image = TABLES["turbo"][DEEP]
    decoded, notes = read(image, DepthHints("inverse"))
    assert (decoded.coding.kind, decoded.coding.scale) == ("inverse", None)
    assert len(notes) == 1 and "(turbo), read back in 256 steps, red is the highest" in notes[0]
    assert read(image, DepthHints("z"))[0].coding.kind == "z"
    assert read(image, DepthHints(scale=50))[0].coding.scale == 50


def test_colours_of_no_map_are_refused():
    hue = np.stack([NEAR, 255 - NEAR, NEAR // 2 + 60], axis=2)
    ramp = np.stack([np.linspace(0, 255, 320)[None].repeat(240, 0)] * 3, axis=2).astype(np.uint8)
    noise = np.random.default_rng(1).integers(0, 256, (240, 320, 3)).astype(np.uint8)
    labels = TABLES["turbo"][np.random.default_rng(1).integers(0, 256, (240, 320))]
    for image in (hue, ramp, noise, labels, noise[:2, :2]):
        assert read_levels(image) is None
    with pytest.raises(
        ValueError,
        match=r"is a colour picture, not depth, nor depth colour-mapped by Spectral_r, .* jet: pass depth \(16-bit",
    ):
        read(hue)


@pytest.mark.data
def test_photographs_and_normals_are_no_colour_mapped_depth(shared_data):
    paths = [
        *shared_data.glob("*/color.*"),
        *shared_data.glob("icl_*/color/*.jpg"),
        *shared_data.glob("*/normal_gt.png"),
    ]
    for path in paths:
        image = Image.open(path)
        assert read_levels(np.asarray(image.convert("RGB"))) is None, path


@pytest.mark.data
def test_the_colour_mapped_frame_comes_back(shared_data):
    folder = shared_data / "odd_colorised_depth_png"
    decoded, notes = read(read_depth(folder / "depth.png", print))
    truth = np.asarray(Image.open(folder / "depth_true.png")).astype(float)
    assert decoded.coding.kind == "z" and len(notes) == 1 and "(jet)" in notes[0] and "red is far" in notes[0]
    np.testing.assert_array_equal(decoded.values == 0, truth == 0)
    inside = (truth > 0) & (decoded.values < 255)  # the map's end is as far as it goes
    slope, offset = np.polyfit(decoded.values[inside], truth[inside], 1)
    assert slope == pytest.approx(19.5, abs=0.1) and abs(offset) < 1.1 * slope  # millimetres: one level at most
    assert np.abs(slope * decoded.values[inside] + offset - truth[inside]).mean() < slope / 2
