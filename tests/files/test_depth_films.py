"""Films of depth: grey of 8 to 16 bits, hues, colour maps, beside their colours or in a film of their own."""

import json
import subprocess

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import asset
from pointshade_gl.files.pictures.video import read_video_frame

from ..support.painted_room import CAMERA, FOCAL, seen

iio = pytest.importorskip("imageio_ffmpeg")
VIEWS = [seen(0.1 * k) for k in range(3)]
COLORS, DEPTHS = [color for color, _ in VIEWS], [depth for _, depth in VIEWS]
NEAR, FAR = min(map(np.min, DEPTHS)), max(map(np.max, DEPTHS))
EXACT = "ffv1", "gray16le", ()
H264 = "libx264", "yuv420p", ("-crf", "4")


def film(path, pictures, codec="libx264", stored="yuv420p", more=("-crf", "4")):
    """A film of grey pictures of 8 or 16 bits, or of colours."""
    kind = "rgb24" if pictures[0].ndim == 3 else "gray" if pictures[0].dtype == np.uint8 else "gray16le"
    size = pictures[0].shape[1::-1]
    how = {"fps": 10, "pix_fmt_in": kind, "codec": codec, "pix_fmt_out": stored, "quality": None}
    writer = iio.write_frames(str(path), size, macro_block_size=1, output_params=list(more), **how)
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()


def inverse(top):
    """Bright is near, one range for all pictures."""
    shares = [(1 / one - 1 / FAR) / (1 / NEAR - 1 / FAR) for one in DEPTHS]
    return [np.rint(share * top).astype(np.uint8 if top == 255 else "<u2") for share in shares]


def linear(top):
    """Bright is far."""
    return [np.rint((one - NEAR) / (FAR - NEAR) * top).astype(np.uint8 if top == 255 else "<u2") for one in DEPTHS]


def millimetres():
    return [np.rint(one * 1000).astype("<u2") for one in DEPTHS]


def hues(metres):
    """Red at 0 and, around the circle of hues, again at so many metres; what is farther is red."""
    turns = [np.where(one < metres, one / metres, 0) * 6 for one in DEPTHS]
    parts = [np.stack([abs(t - 3) - 1, 2 - abs(t - 2), 2 - abs(t - 4)], -1) for t in turns]
    return [np.rint(np.clip(part, 0, 1) * 255).astype(np.uint8) for part in parts]


def inferno():
    table = np.asarray(Image.open(asset("colormaps.png")).convert("RGB"))[1]
    return [table[one] for one in inverse(255)]


def opened(source, **options):
    notes = []
    found = ps.open_source(source, notes=notes.append, **options)
    return list(found), " / ".join(notes)


def check(frames, kind, pixels=0.995):
    """Depth, or its inverse, is right up to scale and offset, or ("metres") right; colours lie on it."""
    assert len(frames) == len(VIEWS)
    for frame, (color, depth) in zip(frames, VIEWS, strict=True):
        known = frame.depth > 0
        got, true = frame.depth[known].astype(float), depth[known]
        if kind == "metres":
            assert np.median(abs(got - true)) < 0.01
        elif kind == "z":
            assert np.corrcoef(got, true)[0, 1] > pixels
        else:
            assert np.corrcoef(1 / got, 1 / true)[0, 1] > pixels
        assert frame.color.shape == color.shape and np.corrcoef(frame.color.ravel(), color.ravel())[0, 1] > 0.98
        assert frame.camera.fx == FOCAL


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    return tmp_path


@pytest.mark.parametrize("typed", ["", "clip.mp4", "clip_depth.mp4"])
def test_two_films_of_one_name(folder, typed):
    film(folder / "clip.mp4", COLORS)
    film(folder / "clip_depth.mp4", inverse(255))
    frames, notes = opened(folder / typed)
    check(frames, "inverse")
    assert "the depth is clip_depth.mp4, the colours are clip.mp4" in notes and "has 8 bits" in notes


@pytest.mark.parametrize("typed", ["", "rgb/clip.mp4", "depth/clip.mkv"])
def test_two_films_in_folders_of_their_own(folder, typed):
    for name in ("rgb", "depth"):
        (folder / name).mkdir()
    film(folder / "rgb/clip.mp4", COLORS)
    film(folder / "depth/clip.mkv", millimetres(), *EXACT)
    check(opened(folder / typed)[0], "metres")


@pytest.mark.parametrize(
    ("pictures", "how", "kind", "says"),
    [
        (lambda: inverse(65535), ("libx265", "gray10le", ("-crf", "4")), "inverse", "has 10 bits"),
        (lambda: linear(65535), ("libx264", "yuv420p10le", ("-crf", "4")), "z", "has 10 bits"),
        (lambda: linear(255), H264, "z", "has 8 bits"),
        (millimetres, EXACT, "metres", "taken as millimetres"),
        (lambda: hues(8.0), ("libx264", "yuv444p", ("-crf", "4")), "z", "in hues, red is near and the unit unknown"),
        (inferno, H264, "inverse", "colour-mapped picture of depth (inferno)"),
    ],
    ids=["10 bits", "10 bits linear", "8 bits linear", "16 bits", "hues", "colour map"],
)  # fmt: skip
def test_forms_of_depth(folder, pictures, how, kind, says):
    film(folder / "rgb.mp4", COLORS)
    film(folder / ("depth.mkv" if how is EXACT else "depth.mp4"), pictures(), *how)
    frames, notes = opened(folder)
    check(frames, kind, 0.99)
    assert says in notes


def test_a_unit_that_is_passed(folder):
    film(folder / "rgb.mp4", COLORS)
    film(folder / "depth.mp4", hues(8.0), stored="yuv444p")
    check(opened(folder, depth_scale=1530 / 8)[0], "metres")


def test_a_kind_that_is_passed(folder):
    film(folder / "rgb.mp4", COLORS)
    film(folder / "depth.mp4", inverse(255))
    shown = opened(folder, depth_kind="z")[0][0].depth
    assert np.corrcoef(shown.ravel(), (1 / DEPTHS[0]).ravel())[0, 1] > 0.999


@pytest.mark.parametrize("axis", [0, 1], ids=["above each other", "beside each other"])
@pytest.mark.parametrize("is_first", [True, False])
def test_depth_and_colours_in_one_film(folder, axis, is_first):
    greys = [np.repeat(one[..., None], 3, axis=2) for one in inverse(255)]
    pairs = zip(*((greys, COLORS) if is_first else (COLORS, greys)), strict=True)
    film(folder / "film.mp4", [np.concatenate(pair, axis) for pair in pairs])
    frames, notes = opened(folder / "film.mp4")
    check(frames, "inverse")
    half = {(0, True): "top", (0, False): "bottom", (1, True): "left", (1, False): "right"}[axis, is_first]
    assert f"the {half} half of film.mp4 is taken as the depth" in notes


def test_record3d_puts_hues_to_three_metres_at_the_left(folder):
    film(folder / "scan.mp4", [np.concatenate(pair, 1) for pair in zip(hues(3.0), COLORS, strict=True)])
    frames, notes = opened(folder)
    check(frames, "metres")
    assert "Record3D's, in hues from 0 to 3 m" in notes
    for frame, depth in zip(frames, DEPTHS, strict=True):
        assert np.mean((frame.depth > 0)[depth > 3.05]) < 0.02 and np.mean((frame.depth > 0)[depth < 2.9]) > 0.98


def test_films_that_are_named_one_by_one(tmp_path):
    film(tmp_path / "a.mp4", COLORS)
    film(tmp_path / "b.mkv", millimetres(), *EXACT)
    (tmp_path / "c.json").write_text(json.dumps(CAMERA))
    given = {"color": tmp_path / "a.mp4", "depth": tmp_path / "b.mkv", "intrinsics": tmp_path / "c.json"}
    frames, _ = opened(None, **given)
    check(frames, "metres")
    notes = []
    frame = ps.load_frame(**given, notes=notes.append)
    np.testing.assert_array_equal(frame.depth, frames[0].depth)
    assert any("is a sequence of 3 frames: picture 0 is taken" in one for one in notes)


def test_pictures_are_read_in_any_order(folder):
    film(folder / "clip.mp4", COLORS)
    film(folder / "clip_depth.mkv", millimetres(), *EXACT)
    sequence = ps.open_source(folder, notes=lambda _: None)
    for k in (2, 0, 1, 1, 0, 2):
        np.testing.assert_allclose(sequence[k].depth, DEPTHS[k], atol=0.00051)


def test_films_of_different_lengths_are_said(folder):
    film(folder / "clip.mp4", COLORS[:2])
    film(folder / "clip_depth.mkv", millimetres(), *EXACT)
    frames, notes = opened(folder)
    assert len(frames) == 2 and "clip_depth.mkv has 3 pictures, clip.mp4 2" in notes


def test_a_film_of_depth_alone(folder):
    film(folder / "depth.mkv", millimetres(), *EXACT)
    frames, notes = opened(folder)
    assert "no film of colours lies beside depth.mkv" in notes
    np.testing.assert_allclose(frames[1].depth, DEPTHS[1], atol=0.00051)


@pytest.mark.parametrize("typed", ["", "clip.mp4"])
def test_a_film_of_photographs_is_no_depth(folder, typed):
    film(folder / "clip.mp4", COLORS)
    with pytest.raises((ValueError, FileNotFoundError), match=r"clip\.mp4 is a video: .* clip_depth\.mp4"):
        ps.open_source(folder / typed)


def test_a_film_of_photographs_that_is_said_to_be_depth(folder):
    film(folder / "clip.mp4", COLORS)
    with pytest.raises(ValueError, match="is a film of photographs, not of depth: pass depth in greys, hues"):
        ps.load_frame(depth=folder / "clip.mp4", color=folder / "clip.mp4")


def test_a_stereo_film_is_no_depth(folder):
    film(folder / "clip.mp4", [np.concatenate([one, one], 1) for one in COLORS])
    with pytest.raises(ValueError, match=r"clip\.mp4 is a video"):
        ps.open_source(folder / "clip.mp4")


def test_a_film_of_a_telephone_is_turned_upright(folder):
    film(folder / "turned.mp4", COLORS)
    how = [
        iio.get_ffmpeg_exe(),
        "-y",
        "-loglevel",
        "error",
        "-display_rotation",
        "90",
        "-i",
        str(folder / "turned.mp4"),
    ]
    subprocess.run([*how, "-c", "copy", str(folder / "clip.mp4")], check=True)
    found = read_video_frame(folder / "clip.mp4", 0)
    assert np.corrcoef(found.ravel(), np.rot90(COLORS[0]).ravel())[0, 1] > 0.98


def test_frames_drawn_of_films(folder, typed):
    film(folder / "clip.mp4", COLORS)
    film(folder / "clip_depth.mkv", millimetres(), *EXACT)
    code, _, errors = typed(f"render {folder} --frame 2 --shading none -o out.png")
    assert code == 0, errors
    drawn = np.asarray(Image.open("out.png").convert("RGB"), float)
    assert np.abs(drawn - COLORS[2]).mean() < 4


@pytest.mark.parametrize(
    "name", ["a.spz", "a.splat", "a.ksplat", "a.obj", "a.stl", "a.fbx", "a.glb", "a.ply", "a.mp4", "a.3mf"]
)
@pytest.mark.parametrize("role", ["depth", "color", "input"])
def test_models_and_splats_are_never_called_no_picture(tmp_path, name, role):
    (tmp_path / name).write_bytes(b"\x00\x00\x00\x18ftypmp42" + bytes(40))
    Image.fromarray(np.full((40, 60), 2000, np.uint16)).save(tmp_path / "depth.png")
    with pytest.raises((ValueError, OSError)) as caught:
        if role == "input":
            ps.open_source(tmp_path / name)
        else:
            ps.load_frame(**{"depth": tmp_path / "depth.png", role: tmp_path / name}, fov=60)
    assert "not a picture" not in str(caught.value) and "HEIC" not in str(caught.value)
    assert name in str(caught.value)


def test_a_film_as_the_input_with_a_film_of_colours_is_one_film(folder):
    film(folder / "a.mkv", millimetres(), *EXACT)
    film(folder / "b.mp4", COLORS)
    frames, _ = opened(folder / "a.mkv", color=folder / "b.mp4", depth_kind="z")
    check(frames, "metres")
