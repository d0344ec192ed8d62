"""What is misspelt gets the near name: options, commands, inputs, files and values, in one sentence each."""

from pathlib import Path

import pytest

import pointshade_gl as ps
from pointshade_gl.notes.words import did_you_mean, listed_beside, near_path


def test_the_nearest_name_or_nothing():
    assert did_you_mean("phng", ("none", "phong")) == " (did you mean phong?)"
    assert did_you_mean("PHONG", ("none", "phong")) == " (did you mean phong?)"
    assert did_you_mean("toon", ("none", "phong")) == did_you_mean(5, ("none",)) == ""


def test_of_a_path_the_wrong_part_is_mended(tmp_path):
    (tmp_path / "frames" / "my_frame").mkdir(parents=True)
    (tmp_path / "frames" / "quite_other").mkdir()
    right = tmp_path / "frames" / "my_frame"
    for wrong in ("frames/my_fram", "frame/my_frame"):
        assert near_path(tmp_path / wrong) == f" (did you mean {right}?)"
    assert near_path(tmp_path / "frame/your_frame") == near_path(tmp_path / "frames" / "x") == ""


def test_another_number_is_another_file(tmp_path):
    for k in range(3):
        (tmp_path / f"depth_{k}.png").touch()
    assert near_path(tmp_path / "depth_7.png") == ""
    assert near_path(tmp_path / "dept_2.png") == f" (did you mean {tmp_path / 'depth_2.png'}?)"


def test_without_a_near_name_the_folder_is_listed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert listed_beside(Path("nix.jpg")) == listed_beside(Path("no/nix.jpg")) == ""
    for k in range(8):
        Path(f"{k}.png").touch()
    Path(".hidden").touch()
    names = "0.png, 1.png, 2.png, 3.png, 4.png, 5.png and 2 more"
    assert listed_beside(Path("nix.jpg")) == f": this folder holds {names}"
    assert listed_beside(tmp_path / "nix.jpg") == f": {tmp_path} holds {names}"


@pytest.fixture
def things(tmp_path):
    """A working folder with some of everything, of which no file is read."""
    (tmp_path / "my_frame").mkdir()
    for name in ("photo.jpg", "room.glb"):
        (tmp_path / name).touch()
    (tmp_path / "pose.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")
    (tmp_path / "notes.txt").write_text("some words\n" * 9)
    return tmp_path


@pytest.mark.usefixtures("things")
@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("render --ligth 1,2,3", "there is no option --ligth (did you mean --light?); `pointshade render --help`"),
        ("render --zzz", "there is no option --zzz; `pointshade render --help` lists the options"),
        (
            "rendr",
            "'rendr' (did you mean render?): known are render, normals, depth, albedo, align, view, info, batch, bench",
        ),
        ("my_frame", "my_frame is not a command: pass `pointshade render my_frame -o out.png` or `pointshade view"),
        ("vase", "vase is not a command: pass `pointshade render vase -o out.png` or `pointshade view vase`"),
        ("render my_fram -o out.png", "there is no folder my_fram (did you mean my_frame?)"),
        ("render vas -o out.png", "there is no folder vas (did you mean vase?)"),
        ("view dmo", "there is no folder dmo (did you mean demo?)"),
        ("render rom.glb -o out.png", "rom.glb does not exist (did you mean room.glb?)"),
        ("render vase --shading phng -o out.png", "unknown --shading 'phng' (did you mean phong?): known are none"),
        ("render --splat rund -o out.png", "unknown --splat 'rund' (did you mean round?): known are"),
        ("normals --normals strr -o out.png", "unknown --normals method 'strr' (did you mean star?): known are auto"),
        ("render --noise kinekt -o out.png", "unknown sensor 'kinekt' for --noise (did you mean kinect?): known are"),
        ("bench --only plane-fit-33", "unknown name 'plane-fit-33' for --only (did you mean plane-fit-3?): known"),
        ("render vase --color nix.jpg -o out.png", "--color: nix.jpg does not exist: this folder holds my_frame, note"),
        ("render vase --color foto.jpg -o out.png", "--color: foto.jpg does not exist (did you mean photo.jpg?)"),
        ("render --depth foto.jpg --fov 50 -o out.png", "--depth: foto.jpg does not exist (did you mean photo.jpg?)"),
        ("render --intrinsics cam.json -o out.png", "--intrinsics: cam.json does not exist: this folder holds"),
        ("render --pose poses.txt -o out.png", "--pose: poses.txt does not exist (did you mean pose.txt?)"),
        (
            "render --depth notes.txt --fov 50 -o out.png",
            "NumPy (.npy, .npz) and EXR: pass depth in one of them as --de",
        ),
        ("render --fov 0 -o out.png", "--fov must lie between 0 and 180 degrees (vertical: from top to bottom), got 0"),
        ("render --fov wide -o out.png", "--fov must be a number, got 'wide' (Vertical field of view"),
        ("normals", "-o is missing: the file to write, such as out.png; it ends with .png, "),
        (
            "normals vase demo -o out.png",
            "there is one INPUT, got also demo: pass files as --depth FILE, --color FILE and",
        ),
        (
            "render vase vase -o out.png",
            "more INPUTs must be folders of frames, clouds or scenes, got vase: pass files as --depth FILE",
        ),
        ("bench demo", "extra argument"),
        ("render --verbose", "there is no option --verbose; `pointshade render --help` lists the options"),
        ("render --rgb a.png", "there is no option --rgb (did you mean --color?)"),
        ("render --scale 5000", "there is no option --scale (did you mean --depth-scale?)"),
        ("render vase -o out.png --depth", "option '--depth' requires an argument"),
        ("render --frames 0 -o out.png", "--frames must be 1 or more, got 0"),
        (
            "render --pose pose.txt --yaw 3 -o out.png",
            "pass --pose or --yaw, not both: only a frame's own pose is moved",
        ),
    ],
)
def test_on_the_command_line_it_is_one_sentence(typed, line, sentence):
    code, output, errors = typed(line)
    *notes, error = errors.splitlines()
    assert code == 2 and not output and error.startswith("pointshade: ") and sentence in error
    assert all(note.startswith("note: ") for note in notes)


def test_without_a_command_all_of_them_are_listed(typed):
    _, output, errors = typed("")
    assert "render" in output and "--install-completion" in output and not errors


@pytest.mark.parametrize("command", ["render", "normals", "view"])
def test_the_help_lists_what_can_be_chosen(typed, command):
    _, output, _ = typed(f"{command} --help-all")
    text = " ".join(output.split())
    for known in ("star-borrow, sparse,", "z, ray, plane, inverse, disparity", "or kinect."):
        assert known in text
    if command != "normals":
        for known in ("none, flat, gouraud, phong, edl", "footprint, round", "attenuation, cone, shadow"):
            assert known in text


def test_in_python_the_names_are_pythons(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("nice.jpg").touch()
    with pytest.raises(FileNotFoundError, match=r"^nixe\.jpg does not exist \(did you mean nice\.jpg\?\)"):
        ps.load_frame("vase", color="nixe.jpg")
    with pytest.raises(FileNotFoundError, match=r"there is no folder vas \(did you mean vase\?\)"):
        ps.render("vas")
    with pytest.raises(ValueError, match=r"unknown shading 'phng' \(did you mean phong\?\): known are none, flat"):
        ps.Appearance(shading="phng")
