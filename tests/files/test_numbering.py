"""Numbers in names: each way to write them, and names that leave it open."""

from pathlib import Path

import pytest

from pointshade_gl.files.access.known_names import first_of, is_numbered, numbered
from pointshade_gl.files.writing.film import check_series


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("%d.png", "7.png"),
        ("%04d.png", "0007.png"),
        ("a%05d_b.exr", "a00007_b.exr"),
        ("{:04d}.png", "0007.png"),
        ("{:04}.png", "0007.png"),
        ("{:d}.npy", "7.npy"),
        ("p{}.ply", "p7.ply"),
        ("####.png", "0007.png"),
        ("shot.##.exr", "shot.07.exr"),
    ],
)
def test_each_way_to_write_a_number_is_understood(name, made):
    path = Path("out") / name
    assert is_numbered(path) and numbered(path, 7) == Path("out") / made
    assert first_of(path).name == made.replace("7", "0")


@pytest.mark.parametrize("name", ["a.png", "take#1.png", "100%.png", "50%off.png", "{a}.png", "%x.png", "a{:.2f}.png"])
def test_other_names_are_single_files(name):
    assert not is_numbered(Path(name)) and first_of(Path(name)) == Path(name)


def test_a_number_in_a_folders_name_does_not_count():
    assert not is_numbered(Path("%04d/a.png")) and numbered(Path("####/%d.png"), 3) == Path("####/3.png")


@pytest.mark.parametrize("name", ["%04d_%d.png", "####_{:04d}.png", "##.##.png"])
def test_two_numbers_in_a_name_are_refused(tmp_path, name):
    with pytest.raises(ValueError, match=r"must have one place for a number, such as %04d, got \S+, \S+"):
        check_series(tmp_path / name)


def test_a_name_without_a_number_cannot_be_numbered():
    with pytest.raises(ValueError, match="such as %04d, got none"):
        numbered(Path("a.png"), 1)
