"""Files of environments: Radiance in each of its packings, EXR, pictures; each defect is one sentence that names it."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.pictures.hdr_files import find_environment, read_radiance, write_exr
from pointshade_gl.files.pictures.picture_files import save_image
from pointshade_gl.notes.notes import taken
from pointshade_gl.scene.values import srgb_to_linear

from ..support.damage import damaged
from ..support.radiance_files import flat, mantissas, radiance_file, repeats, restored, run_lengths

RNG = np.random.default_rng(6)
LIGHT = RNG.random((12, 24, 3)) ** 8 * 40
LIGHT[3:5] = 0.25
LIGHT[5, 4:20], LIGHT[8, 2] = (3, 2, 1), 0
PIXELS = mantissas(LIGHT)


@pytest.mark.parametrize("packed", [flat, repeats, run_lengths])
def test_every_packing_of_radiance_is_read(tmp_path, packed):
    path = tmp_path / "a.hdr"
    path.write_bytes(radiance_file(PIXELS, packed))
    np.testing.assert_array_equal(read_radiance(path), restored(PIXELS))
    np.testing.assert_allclose(read_radiance(path), LIGHT, atol=LIGHT.max() / 128)


def test_long_runs_and_narrow_and_wide_lines(tmp_path):
    path, grey = tmp_path / "a.hdr", np.full((2, 60_000, 3), 0.5)
    path.write_bytes(radiance_file(mantissas(grey), repeats))
    assert (path.stat().st_size < 200) and (read_radiance(path, 1e6) == 0.5).all()
    path.write_bytes(radiance_file(PIXELS[:, :7], flat))  # run lengths begin at 8 columns
    np.testing.assert_array_equal(read_radiance(path), restored(PIXELS[:, :7]))


@pytest.mark.parametrize(
    ("size", "changed"),
    [
        ("-Y 12 +X 24", lambda one: one),
        ("+Y 12 +X 24", lambda one: one[::-1]),
        ("-Y 12 -X 24", lambda one: one[:, ::-1]),
        ("+X 12 -Y 24", lambda one: one.swapaxes(0, 1)),
        ("-X 12 +Y 24", lambda one: one.swapaxes(0, 1)[::-1, ::-1]),
    ],
)
def test_lines_may_go_any_way(tmp_path, size, changed):
    (tmp_path / "a.hdr").write_bytes(radiance_file(PIXELS, size=size))
    np.testing.assert_array_equal(read_radiance(tmp_path / "a.hdr"), changed(restored(PIXELS)))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (radiance_file(PIXELS)[:-5], "is a broken or truncated Radiance picture: line 11 of 12 ends too early"),
        (radiance_file(PIXELS, flat)[:-5], "line 11 of 12 ends too early"),
        (radiance_file(PIXELS)[:50], "its header has no size"),
        (radiance_file(PIXELS, size="-Y 12 +Y 24"), "its header has no size"),
        (radiance_file(PIXELS, size="-Y 0 +X 24"), "it has 0 pixels"),
        (radiance_file(PIXELS, size="-Y 12 +X 23"), "line 0 of 12"),
        (radiance_file(PIXELS, size="-Y 999999999 +X 999999999"), "999999999x999999999 pixels, the limit for a side"),
        (radiance_file(PIXELS, size="-Y 60000 +X 60000"), "has 60000x60000 pixels, the limit is .*max_pixels"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 12 +X 24\n" + b"\0" * 2000, "colours in XYZ, expected RGB"),
        (b"#?RADIANCE\n\n-Y 1 +X 9\n\1\1\1\2" + b"\0" * 99, "line 0 of 1"),
        (b"#?RADIANCE\n\n-Y 1 +X 9\n\0\0\0\2\1\1\1\x99" + b"\0" * 99, "line 0 of 1"),
    ],
)
def test_a_damaged_radiance_picture_is_told_in_one_sentence(tmp_path, data, says):
    path = tmp_path / "a.hdr"
    path.write_bytes(data)
    with pytest.raises(ValueError, match=says) as found:
        ps.load_environment(path)
    assert str(found.value).startswith(f"{path} ") and "\n" not in str(found.value)


@pytest.mark.parametrize("packed", [flat, repeats, run_lengths])
def test_random_damage_never_crashes(tmp_path, packed):
    random, path, whole = np.random.default_rng(9), tmp_path / "a.hdr", radiance_file(PIXELS, packed)
    for _ in range(150):
        path.write_bytes(damaged(whole, random))
        try:
            with taken():
                ps.load_environment(path, max_pixels=1e6)
        except (ValueError, OSError) as error:
            assert str(path) in str(error)


def test_an_environment_is_read_from_radiance_and_exr_alike(tmp_path):
    (tmp_path / "a.hdr").write_bytes(radiance_file(PIXELS))
    pytest.importorskip("OpenEXR")
    light = restored(PIXELS).astype(np.float32)
    write_exr(tmp_path / "b.exr", dict(zip("RGB", np.moveaxis(light, -1, 0), strict=True)))
    write_exr(
        tmp_path / "c.exr",
        {f"View.Combined.{one}": light[..., k] for k, one in enumerate("RGB")} | {"Z": LIGHT[..., 0]},
    )
    write_exr(tmp_path / "d.exr", {"Y": light[..., 0]})
    for name in ("a.hdr", "b.exr", "c.exr"):
        read = ps.load_environment(tmp_path / name)
        np.testing.assert_array_equal(read.picture, light)
        assert read.name == str(tmp_path / name)
    np.testing.assert_array_equal(ps.load_environment(tmp_path / "d.exr").picture, light[..., :1].repeat(3, -1))
    write_exr(tmp_path / "e.exr", {"X": light[..., 0], "Z": light[..., 1]})
    with pytest.raises(ValueError, match="has the channels X, Z: expected R, G and B"):
        ps.load_environment(tmp_path / "e.exr")


def test_numbers_that_are_no_light_are_repaired_with_a_note(tmp_path):
    pytest.importorskip("OpenEXR")
    light = LIGHT.astype(np.float32)
    light[0, 0], light[1, 1, 0], light[2, 2] = np.inf, -0.1, np.nan
    write_exr(tmp_path / "a.exr", dict(zip("RGB", np.moveaxis(light, -1, 0), strict=True)))
    with taken() as notes:
        picture = ps.load_environment(tmp_path / "a.exr").picture
    assert "3 pixels are negative or not finite" in notes[0] and len(notes) == 1
    assert (picture[0, 0] == np.float32(LIGHT.max())).all() and picture[1, 1, 0] == 0 and (picture[2, 2] == 0).all()
    assert (picture[3:] == light[3:]).all()


@pytest.mark.parametrize("kind", ["rgb", "grey", "alpha", "deep"])
def test_pictures_for_the_eye_are_srgb_and_a_note_says_so(tmp_path, kind):
    grey = RNG.integers(0, 256, (6, 12), np.uint8)
    image = {"rgb": np.dstack([grey, 255 - grey, grey]), "grey": grey, "deep": grey.astype(np.uint16) * 257}.get(kind)
    image = np.dstack([grey] * 4) if kind == "alpha" else image
    save_image(tmp_path / "a.png", image)
    with taken() as notes:
        picture = ps.load_environment(tmp_path / "a.png").picture
    np.testing.assert_allclose(picture[..., 0], srgb_to_linear(grey / 255), atol=1e-6)
    assert len(notes) == 1 and "is read as sRGB: its light ends at 1" in notes[0]


def test_a_picture_of_another_shape_and_what_is_no_picture_are_told(tmp_path):
    save_image(tmp_path / "a.png", np.zeros((9, 12, 3), np.uint8))
    with taken(), pytest.raises(ValueError, match=r"has 12x9 pixels: expected a picture of the whole sphere.*twice as"):
        ps.load_environment(tmp_path / "a.png")
    (tmp_path / "b.hdr").write_text("hello")
    with pytest.raises(ValueError, match=r"b\.hdr is not a picture"):
        ps.load_environment(tmp_path / "b.hdr")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        ps.load_environment(tmp_path)
    with pytest.raises(FileNotFoundError, match="does not exist"):
        ps.load_environment(tmp_path / "none.hdr")


def test_a_file_is_read_again_only_when_it_has_changed(tmp_path):
    path = tmp_path / "a.hdr"
    path.write_bytes(radiance_file(PIXELS))
    first = find_environment(str(path))
    assert find_environment(path) is first
    path.write_bytes(radiance_file(mantissas(LIGHT[:10, :20])))
    assert find_environment(path).picture.shape == (10, 20, 3)


def test_the_door_takes_names_files_and_pictures(tmp_path, monkeypatch):
    from pointshade_gl.renderer.requests import RenderRequest

    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.hdr").write_bytes(radiance_file(PIXELS))
    of = lambda value: RenderRequest.of("vase", environment=value).finish.environment  # noqa: E731
    assert of("sky") is ps.Environment.of("sky") and of(None) is None
    for value in ("a.hdr", tmp_path / "a.hdr", restored(PIXELS), ps.Environment(restored(PIXELS))):
        np.testing.assert_array_equal(of(value).picture, restored(PIXELS))
    assert of("a.hdr").name == "a.hdr"
    with pytest.raises(
        FileNotFoundError, match=r"must be sky or studio, or a file such as studio.hdr: 'stduio' does not"
    ):
        of("stduio")
    with pytest.raises(FileNotFoundError, match=r"did you mean a\.hdr"):
        of("aa.hdr")
