"""`pointshade align` as a user types it: poses of views that have none, in a file that is read again."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.cameras.pose_files import read_poses

from ..support.posed_views import CAMERA, corner, off, plain, two_planes, views

pytestmark = pytest.mark.usefixtures("renderer")
INTRINSICS = {name: getattr(CAMERA, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}


@pytest.fixture
def true(tmp_path):
    """Three views of one thing, in folders left, middle and right, and a sequence of two of them."""
    found = views(corner(plain), 3, 0.0005)
    for name, frame in zip(("left", "middle", "right"), found, strict=True):
        write(tmp_path / name, [frame])
    write(tmp_path / "elsewhere", views(two_planes(plain), 1))
    write(tmp_path / "both", found[::2])
    return found


def write(folder, frames):
    for name in ("color", "depth"):
        (folder / name).mkdir(parents=True)
    for k, frame in enumerate(frames):
        ps.save_image(folder / f"color/{k}.png", frame.color)
        np.save(folder / f"depth/{k}.npy", frame.depth)
    (folder / "intrinsics.json").write_text(json.dumps(INTRINSICS))


def is_right(pose, frame, first):
    """Whether a pose beside that of the first view, which is the identity, is true."""
    return off(frame.at(first.pose @ pose), frame) < 0.003


def test_two_views_get_poses_that_are_read_again(typed, true, tmp_path):
    code, output, _ = typed("align left right -o poses.json")
    lines = output.splitlines()
    assert code == 0 and lines[0] == "left: keeps its pose" and lines[2].startswith("poses.json: 2 poses, ")
    assert lines[1].startswith("right: ") and " degrees from left, overlap " in lines[1]
    found = read_poses(tmp_path / "poses.json")
    assert found.names == ["left", "right"] and np.array_equal(found.poses[0], np.eye(4))
    assert is_right(found.poses[1], true[2], true[0])


def test_a_text_has_the_form_of_tum(typed, true, tmp_path):
    code, *_ = typed("align left right -o poses.txt")
    found = read_poses(tmp_path / "poses.txt")
    assert code == 0 and found.numbers == [0, 1] and is_right(found.poses[1], true[2], true[0])


def test_frames_of_one_sequence_are_named_by_their_numbers(typed, true, tmp_path):
    code, *_ = typed("align both both --frame 0,1 -o poses.json")
    found = read_poses(tmp_path / "poses.json")
    assert code == 0 and found.names == ["both 0", "both 1"] and is_right(found.poses[1], true[2], true[0])


def test_what_is_not_found_is_left_out_and_named(typed, true, tmp_path):
    code, output, errors = typed("align left elsewhere right -o poses.json")
    assert code == 1 and "elsewhere: not found: " in output and "note: not found: elsewhere\n" in errors
    assert read_poses(tmp_path / "poses.json").names == ["left", "right"]


def test_nothing_is_written_if_nothing_is_found(typed, true, tmp_path):
    code, output, errors = typed("align left elsewhere -o poses.json")
    assert code == 1 and "elsewhere: not found: " in output
    assert "note: not found: elsewhere; nothing is written\n" in errors and not (tmp_path / "poses.json").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("left -o poses.json", "poses are found of 2 to 4 INPUTs that show the same, got 1"),
        ("left right left right left -o poses.json", "poses are found of 2 to 4 INPUTs that show the same, got 5"),
        ("left left -o poses.json", "the same view was passed twice: pass others, or --frame with a number for each"),
        ("left right -o poses.ply", "cannot write poses.ply: the suffix of poses must be .json or .txt"),
        ("left right --depth left/depth/0.npy -o poses.json", "pass --depth or --color with one INPUT"),
        ("left right --frame 0,7 -o poses.json", "--frame 7: there are 1 frames, counted from 0"),
    ],
)
def test_what_is_typed_wrongly(typed, true, words, sentence):
    code, _, errors = typed(f"align {words}")
    assert code == 2 and sentence in errors


def test_frames_of_one_sequence_are_drawn_with_the_poses_by_their_numbers(typed, true):
    assert typed("align both both --frame 0,1 -o poses.json")[0] == 0
    code, _, errors = typed("render both both --frame 0,1 --poses poses.json -o out.png --samples 1 --explain")
    assert code == 0, errors
