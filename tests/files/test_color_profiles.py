"""Photographs in other colour spaces are converted to sRGB, and a note says so: from profiles, gAMA, cHRM and cICP."""

import struct

import numpy as np
import pytest
from PIL import Image, ImageCms

import pointshade_gl as ps
from pointshade_gl.files.frames.assembly import read_color

from ..support.color_profiles import ADOBE_RGB, SRGB, add_chunks, icc
from ..support.heic_files import heic

# from linear Display P3 to linear sRGB, as CSS Color 4 has it
P3_TO_SRGB = np.array([[1.2249401, -0.2249404, 0], [-0.0420569, 1.0420571, 0], [-0.0196376, -0.0786361, 1.0982735]])
WRITTEN = {
    ".png": {},
    ".jpg": {"quality": 100, "subsampling": 0},
    ".tif": {},
    ".webp": {"lossless": True},
    ".heic": {"quality": -1, "chroma": 444},
}
P3_NUMBERS = 31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000


def _p3_to_srgb(color, gamma=None):
    levels = np.array(color) / 255
    light = levels**gamma if gamma else np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    light = np.clip(P3_TO_SRGB @ light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def _save(path, color=(200, 40, 40), mode="RGB", **options):
    if path.suffix == ".heic":
        pytest.importorskip("pillow_heif").register_heif_opener()
    Image.new(mode, (8, 6), color).save(path, **WRITTEN[path.suffix], **options)
    return path


def _read(path):
    notes = []
    colors = read_color(path, to_srgb=notes.append)
    assert (colors == colors[0, 0]).all()
    return colors[0, 0].tolist(), notes


@pytest.mark.parametrize("suffix", WRITTEN)
def test_display_p3_becomes_srgb_with_a_note(suffix, tmp_path):
    path = _save(tmp_path / f"photo{suffix}", icc_profile=icc())
    color, notes = _read(path)
    assert np.abs(np.array(color) - _p3_to_srgb((200, 40, 40))).max() < 1.5, color
    assert notes == [f"{path} has colours of Display P3: they are converted to sRGB"]
    assert _read(_save(tmp_path / f"plain{suffix}")) == ([200, 40, 40], [])


def test_a_profile_with_a_plain_gamma_is_read_as_it_says(tmp_path):
    color, _ = _read(_save(tmp_path / "photo.png", icc_profile=icc(gamma=2.2)))
    assert color == [220, 0, 17]
    assert np.abs(np.array(color) - _p3_to_srgb((200, 40, 40), 2.2)).max() < 1
    for other in ((10, 200, 90), (128, 128, 128), (255, 255, 255), (0, 0, 0)):
        color, _ = _read(_save(tmp_path / "photo.png", other, icc_profile=icc(gamma=2.2)))
        assert np.abs(np.array(color) - _p3_to_srgb(other, 2.2)).max() < 1.5


def test_other_profiles(tmp_path):
    color, notes = _read(_save(tmp_path / "a.jpg", icc_profile=icc(ADOBE_RGB, "Adobe RGB (1998)", 563 / 256)))
    assert abs(color[0] - 233) < 2 and "Adobe RGB (1998)" in notes[0]
    grey, notes = _read(
        _save(tmp_path / "g.png", 128, "L", icc_profile=icc(name="Gamma 1.8", gamma=1.8, space=b"GRAY"))
    )
    assert grey[0] == grey[1] == grey[2] and abs(grey[0] - 146) < 2 and "Gamma 1.8" in notes[0]
    color, _ = _read(_save(tmp_path / "alpha.png", (200, 40, 40, 77), "RGBA", icc_profile=icc()))
    assert color == [218, 0, 26, 77]


def test_a_profile_of_srgb_changes_nothing_and_says_nothing(tmp_path):
    for k, profile in enumerate(
        (icc(SRGB, "anything"), ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    ):
        path = tmp_path / f"{k}.png"
        picture = np.random.default_rng(1).integers(0, 256, (40, 30, 3), np.uint8)
        Image.fromarray(picture).save(path, icc_profile=profile)
        notes = []
        assert np.array_equal(read_color(path, to_srgb=notes.append), picture) and not notes


@pytest.mark.parametrize("broken", [b"nonsense" * 40, icc()[:200], b"\0" * 128])
def test_a_broken_profile_gives_a_note_and_the_colours_as_they_are(broken, tmp_path):
    color, notes = _read(_save(tmp_path / "photo.png", icc_profile=broken))
    assert color == [200, 40, 40] and len(notes) == 1 and "cannot be used" in notes[0]


def test_a_profile_for_other_inks_gives_a_note(tmp_path):
    path = tmp_path / "ink.jpg"
    Image.new("CMYK", (8, 6), (0, 200, 200, 50)).save(path, quality=100, icc_profile=icc())
    _, notes = _read(path)
    assert len(notes) == 1 and "it is for RGB" in notes[0]


@pytest.mark.parametrize(
    "chunks, expected, said",
    [
        ({b"cICP": bytes([12, 13, 0, 1])}, [218, 0, 26], "Display P3"),
        ({b"cICP": bytes([1, 13, 0, 1])}, [200, 40, 40], ""),
        ({b"cICP": bytes([2, 2, 0, 1])}, [200, 40, 40], ""),
        ({b"cICP": bytes([9, 16, 0, 1])}, [200, 40, 40], "PQ (HDR), which cannot be converted"),
        ({b"cICP": bytes([77, 13, 0, 1])}, [200, 40, 40], "cannot be converted"),
        ({b"gAMA": struct.pack(">I", 45455)}, [200, 40, 40], ""),
        ({b"gAMA": struct.pack(">I", 100000)}, [229, 110, 110], "gamma 1"),  # linear light
        ({b"gAMA": struct.pack(">I", 55556)}, [210, 53, 53], "gamma 1.8"),
        ({b"gAMA": struct.pack(">I", 45455), b"cHRM": struct.pack(">8I", *P3_NUMBERS)}, [218, 0, 26], "primaries"),
        ({b"gAMA": struct.pack(">I", 45455), b"cHRM": bytes(32)}, [200, 40, 40], "primaries that cannot be"),
        ({b"sRGB": b"\0", b"gAMA": struct.pack(">I", 100000)}, [200, 40, 40], ""),
        ({b"gAMA": bytes(4)}, [200, 40, 40], ""),
    ],
)
def test_chunks_of_a_png(chunks, expected, said, tmp_path):
    path = _save(tmp_path / "photo.png")
    add_chunks(path, *chunks.items())
    color, notes = _read(path)
    assert color == expected
    assert (said in notes[0] and len(notes) == 1) if said else not notes


def test_numbers_come_before_a_profile(tmp_path):
    path = _save(tmp_path / "photo.png", icc_profile=icc(ADOBE_RGB, "Adobe RGB", 563 / 256))
    add_chunks(path, (b"cICP", bytes([12, 13, 0, 1])))
    assert _read(path)[0] == [218, 0, 26]


@pytest.mark.parametrize(
    "mode, color, expected",
    [
        ("P", (200, 40, 40), [218, 0, 26]),
        ("RGB", (200, 40, 40), [218, 0, 26]),
        ("L", 128, None),
    ],
)
def test_transparency_without_a_channel_is_kept(mode, color, expected, tmp_path):
    path = tmp_path / "cut.png"
    image = Image.new("RGB" if mode == "P" else mode, (8, 6), color)
    image = image.quantize(4) if mode == "P" else image
    transparent = {"P": 0, "RGB": (200, 40, 40), "L": 128}[mode]
    image.save(path, transparency=transparent, icc_profile=icc() if expected else None)
    if not expected:
        add_chunks(path, (b"gAMA", struct.pack(">I", 55556)))
    color, notes = _read(path)
    assert len(color) == 4 and color[3] == 0 and len(notes) == 1
    assert expected is None or np.abs(np.array(color[:3]) - expected).max() <= 1


def test_deep_grey_is_converted_in_8_bits(tmp_path):
    path = tmp_path / "deep.png"
    Image.fromarray(np.full((6, 8), 40000, np.uint16)).save(path)
    assert _read(path) == ([156, 156, 156], [])
    add_chunks(path, (b"gAMA", struct.pack(">I", 100000)))  # linear light
    assert _read(path)[0] == [205, 205, 205]
    Image.fromarray(np.full((6, 8), 40000, np.uint16)).save(path)
    add_chunks(path, (b"cICP", bytes([12, 13, 0, 1])))  # grey is grey in any primaries of this white
    assert _read(path)[0] == [156, 156, 156]


def test_a_large_profile_and_a_short_chunk_do_not_spoil_a_picture(tmp_path):
    path = _save(tmp_path / "large.png", icc_profile=icc() + bytes(2_000_000))
    color, _ = _read(path)
    assert color in ([218, 0, 26], [200, 40, 40])
    path = _save(tmp_path / "short.png")
    add_chunks(path, (b"cICP", b""))
    assert _read(path) == ([200, 40, 40], [])


def _frame_of(folder, color, **options):
    folder.mkdir()
    Image.fromarray(np.full((6, 8), 1500, np.uint16)).save(folder / "depth.png", icc_profile=icc())
    Image.new("RGB", (8, 6), color).save(folder / "color.png", **options)
    return folder


def test_frames_are_converted_depth_is_not(tmp_path, capsys):
    frame = ps.load_frame(_frame_of(tmp_path / "frame", (200, 40, 40), icc_profile=icc()), fov=50)
    assert frame.color[2, 2].tolist() == [218, 0, 26]
    assert (frame.depth == 1.5).all()
    assert capsys.readouterr().err.count("Display P3") == 1


DEPTHS = np.linspace(20, 200, 32 * 24).reshape(32, 24).astype(np.uint8)


def test_a_phones_photograph_with_depth_is_converted(tmp_path, capsys):
    pytest.importorskip("pillow_heif")
    data = heic(np.full((64, 48, 3), (200, 40, 40), np.uint8), DEPTHS, icc_profile=icc())
    (tmp_path / "photo.heic").write_bytes(data)
    frame = ps.load_frame(tmp_path / "photo.heic", fov=50)
    assert np.abs(frame.color[2, 2, :3].astype(int) - (218, 0, 26)).max() <= 2
    assert "Display P3" in capsys.readouterr().err


def test_an_environment_is_converted_a_texture_is_not(tmp_path, capsys):
    """glTF 2.0 wants the colour spaces of its pictures to be ignored (3.8.2)."""
    path = tmp_path / "sky.png"
    Image.new("RGB", (64, 32), (200, 40, 40)).save(path, icc_profile=icc())
    red, green, blue = ps.load_environment(path).picture[9, 9]
    assert green == 0 and abs(blue - 0.0103) < 0.001 and abs(red - 0.70) < 0.01
    assert "Display P3" in capsys.readouterr().err
    assert read_color(path)[0, 0].tolist() == [200, 40, 40]
