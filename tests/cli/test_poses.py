"""--poses, --align and --save-poses: poses of several frames are read, corrected and written."""

import json
import re
import shlex

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.cameras.pose_files import WRITTEN, read_poses

from ..support.posed_views import corner, disturbed, off, views
from ..support.view_sets import write_views

TRUE = views(corner(), 3)
GIVEN = disturbed(TRUE, 0.02, 0.5)
PLAIN = "--samples 1 --shading none"
pytestmark = pytest.mark.usefixtures("renderer")


@pytest.fixture
def draw(typed, tmp_path):
    """draw("walk --views all"): the picture of a line that ends well, and what it prints."""

    def call(line, output="out.png"):
        code, out, errors = typed(f"render {line} -o {output} {PLAIN}")
        assert code == 0, errors
        with Image.open(tmp_path / output) as image:
            return np.asarray(image).astype(int), out

    return call


@pytest.fixture
def walk(tmp_path):
    """A sequence whose poses are off by 2 cm, but the first."""
    return write_views(tmp_path / "walk", GIVEN)


@pytest.fixture
def rig(tmp_path):
    """Three folders with a single frame each and no pose, and a file with their poses, which are off."""
    for name, frame in zip("ABC", GIVEN, strict=True):
        write_views(tmp_path / name, [frame])
        (tmp_path / name / "pose" / "0.txt").unlink()
    poses = {name: frame.pose.tolist() for name, frame in zip("CBA", GIVEN[::-1], strict=True)}
    (tmp_path / "rig.json").write_text(json.dumps(poses))


@pytest.mark.usefixtures("walk")
class TestViews:
    def test_saved_poses_give_the_same_picture_again(self, draw, tmp_path):
        aligned, out = draw("walk --views all --align --save-poses saved.txt")
        assert "saved.txt: 3 poses" in out.splitlines()
        given, _ = draw("walk --views all")
        again, _ = draw("walk --views all --poses saved.txt")
        assert (aligned != given).any() and (np.abs(aligned - again) > 1).mean() < 1e-3
        found = read_poses(tmp_path / "saved.txt")
        for frame, pose, true in zip(GIVEN, found.poses, TRUE, strict=True):
            assert off(frame.at(pose), true) < 0.003
        assert (tmp_path / "saved.txt").read_text().startswith(WRITTEN)

    def test_those_of_some_frames_are_theirs(self, draw, tmp_path):
        aligned, _ = draw("walk --views 2,0 --align --save-poses saved.txt")
        assert read_poses(tmp_path / "saved.txt").numbers == [2, 0]
        for wanted in ("2,0", "all"):
            again, _ = draw(f"walk --views {wanted} --poses saved.txt")
            assert again.shape == aligned.shape
        again, _ = draw("walk --views 2,0 --poses saved.txt")
        assert (np.abs(aligned - again) > 1).mean() < 1e-3

    def test_a_turntable_saves_the_poses_of_its_first_picture(self, typed, tmp_path):
        line = f"render walk --views 2 --align --turntable camera --frames 2 -o %d.png --save-poses saved.txt {PLAIN}"
        code, out, errors = typed(line)
        assert code == 0 and "saved.txt: 2 poses" in out, errors
        assert len(read_poses(tmp_path / "saved.txt").poses) == 2

    @pytest.mark.parametrize("output", ["out.ply", "out.glb --points"])
    def test_their_points_are_one_cloud_at_the_corrected_poses(self, typed, tmp_path, output):
        code, out, errors = typed(f"render walk --views all --align -o {output} --save-poses saved.txt")
        assert code == 0 and "saved.txt: 3 poses" in out, errors
        saved = [frame.at(pose) for frame, pose in zip(GIVEN, read_poses(tmp_path / "saved.txt").poses, strict=True)]
        cloud = ps.render_points(saved, missing="complete")
        (count,) = re.findall(r": (\d+) points", out)
        assert abs(int(count) / len(cloud) - 1) < 0.01 and len(cloud) < 0.7 * sum(one.points_known for one in GIVEN)

    def test_corrections_are_explained_by_the_frames_numbers(self, draw):
        _, out = draw("walk --views 0,2 --align --explain")
        lines = [line for line in out.splitlines() if line.startswith("aligned")]
        assert lines[0] == "aligned: 1 of 1 pose corrected; that of frame 0 stays"
        assert lines[1].startswith("aligned: frame 2 by ") and " mm and " in lines[1]

    def test_info_counts_given_poses(self, typed, tmp_path):
        ps.save_poses(tmp_path / "saved.txt", GIVEN[:2])
        assert "poses     2 from saved.txt" in typed("info walk --poses saved.txt").stdout


@pytest.mark.usefixtures("rig")
class TestSeveralInputs:
    def test_single_frames_without_poses_merge_by_those_of_a_file(self, draw, walk):
        merged, _ = draw("A B C --poses rig.json")
        assert (np.abs(merged - draw(f"{walk.name} --views all")[0]) > 1).mean() < 1e-3
        assert (merged != draw("A B C")[0]).any()

    def test_the_order_of_names_in_the_file_does_not_matter_nor_how_inputs_are_typed(self, draw, tmp_path):
        expected, _ = draw("C A --poses rig.json")
        folder = shlex.quote(str(tmp_path))
        assert (draw(f"./C/ {folder}/A --poses rig.json")[0] == expected).all()

    def test_one_of_them_alone_has_its_pose(self, typed):
        found = json.loads(typed("info B --poses rig.json --json").stdout)
        assert found["poses"] == {"count": 1, "from": "rig.json"}

    def test_they_are_aligned_saved_and_explained_by_their_names(self, draw, tmp_path):
        aligned, out = draw("A B C --poses rig.json --align --save-poses saved.txt --explain")
        assert "aligned: frame B by " in out and "aligned: frame C by " in out
        assert read_poses(tmp_path / "saved.txt").numbers == [0, 1, 2]
        again, _ = draw("A B C --poses saved.txt")
        assert (np.abs(aligned - again) > 1).mean() < 1e-3

    def test_a_page_has_the_corrected_poses(self, typed, tmp_path, monkeypatch):
        from pointshade_gl.page import parts

        axes, usual = [], parts.surface_part
        monkeypatch.setattr(parts, "surface_part", lambda one, how: (axes.append(one.axes), usual(one, how))[1])
        code, _, errors = typed("render A B C --poses rig.json --align --save-poses saved.txt -o out.html")
        assert code == 0, errors
        saved = read_poses(tmp_path / "saved.txt").poses
        np.testing.assert_allclose(np.stack(axes), saved, atol=1e-9)
        assert np.abs(np.stack(axes)[1:] - [one.pose for one in GIVEN[1:]]).max() > 1e-3


@pytest.mark.usefixtures("rig", "walk")
@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("render A -o out.png --align", "here is a single one: pass --views N or several INPUTs, or write the frames"),
        ("render walk -o out.ply --align", "here is a single one"),
        ("render walk -o out.mp4 --turntable light --align", "here is a single one"),
        ("render walk -o out.png --unlight-all --align", "here is a single one"),
        ("render demo -o out.png --align", "the objects of a scene have a look of their own: leave out --align"),
        ("view A --align", "here is a single one"),
        ("view demo --align", "the objects of a scene have a look of their own: leave out --align"),
        ("batch walk -o out --align", "each picture is drawn alone: add --to mp4 or --to gif, or leave it out"),
        ("batch walk -o out --poses rig.json", "there is no option --poses"),
        ("render walk -o %d.ply --align --save-poses out.txt", "holds one thing: leave it out"),
        ("batch walk -o out --to mp4 --turntable light --align", "--turntable shows one: leave one out"),
        ("render A B -o out.png --save-poses out.txt", "--save-poses writes the poses that --align finds: add it"),
        ("render A -o out.png --save-poses out.txt", "--save-poses writes the poses that --align finds: add it"),
        ("render A B -o out.png --align --save-poses out.json", "cannot write out.json: the suffix of poses must be"),
        ("render A B -o out.png --align --save-poses none/out.txt", "cannot write none/out.txt: there is no"),
        ("render A B -o out.png --poses none.json", "--poses: none.json does not exist"),
        ("render A none -o out.png --poses rig.json", "pointshade: none does not exist"),
        ("render A walc -o out.png --poses rig.json", "walc does not exist (did you mean walk?)"),
        ("render A rig.json -o out.png", "more INPUTs must be folders of frames, clouds or scenes, got rig.json"),
        ("render walk ./walk -o out.png", "./walk is given twice: pass folders that differ, or --views N"),
        ("render walk walk -o out.png --frame 1,1", "walk is given twice"),
        ("view walk walk", "walk is given twice"),
        ("render A walk -o out.png --poses rig.json", "holds 3 poses (C, B, A), expected one for each of 2 INPUTs"),
        ("render walk -o out.png --poses A/intrinsics.txt", "holds no poses"),
        ("render A -o out.png --depth A/depth/0.png --poses rig.json", "--poses is about the frames of a folder"),
        ("render demo -o out.png --poses rig.json", "which names the files of its frames: leave out --poses"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_sentence_and_nothing_is_written(typed, tmp_path, line, sentence):
    before = sorted(tmp_path.rglob("*"))
    code, _, errors = typed(line)
    assert code == 2 and sentence in errors, errors
    assert sum(not one.startswith("note: ") for one in errors.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("command", ["render", "view"])
def test_the_help_lists_them(typed, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "200")
    text = typed(f"{command} --help-all").stdout
    views = text.partition("\nSeveral views as one:\n")[2].partition("\n\n")[0]
    (line,) = (one for one in views.splitlines() if "Correct the poses of several frames of one thing" in one)
    assert "--align" in line
    assert ("--save-poses" in views) == (command == "render")
    assert "--poses" in text.partition("\nReading files:\n")[2].partition("\n\n")[0]
