"""Objects of several frames in glTF files: written and read again they are the same, also in pictures."""

import json

import numpy as np
import pytest

import pointshade_gl as ps

from ...support import frames
from ...support.gltf_files import write_gltf
from ...support.view_sets import pose_at, replaced, three_views
from .test_points import folder, points_of  # noqa: F401 - a fixture

BETWEEN = pose_at(6, -2)


def scene_of(views, **look):
    transform = np.diag([2.0, 2, 2, 1])
    node = ps.Node(ps.PointObject(views, **look), name="vase", transform=transform)
    pose = BETWEEN.copy()
    pose[:3, 3] *= 2
    return ps.Scene((node,), camera=frames.CAMERA, pose=pose)


def written_and_read(scene, path):
    ps.save_scene(path, scene)
    return ps.load_scene(path, notes=lambda _: None)


def said_in(path):
    return json.loads(path.read_text())["nodes"][0]["extras"]["pointshade"]


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_a_set_comes_back_and_is_drawn_the_same(renderer, tmp_path, suffix):
    """Frames of two sizes, one without colours, one with negative fy."""
    views = three_views()
    c = views[0].camera
    upside = ps.Camera(c.fx, -c.fy, c.cx, c.height - 1 - c.cy, c.width, c.height)
    views[0] = replaced(views[0], color=views[0].color[::-1], depth=views[0].depth[::-1], camera=upside)
    views[1] = replaced(views[1], color=None)
    scene = scene_of(views, material=ps.Material(specular=0), shading="gouraud")
    again = written_and_read(scene, tmp_path / f"scene{suffix}")
    (node,) = again.nodes
    assert node.content.look == scene.nodes[0].content.look and len(node.content.frames) == 3
    for before, after in zip(views, node.content.frames, strict=True):
        assert before.camera == after.camera
        for name in ("color", "depth", "pose"):
            np.testing.assert_array_equal(getattr(before, name), getattr(after, name))
    assert (renderer.render(scene) == renderer.render(again)).all()


def test_the_command_line_draws_it_as_python_does(typed, tmp_path):
    scene = scene_of(three_views())
    ps.save_scene(tmp_path / "scene.gltf", scene)
    assert typed("render scene.gltf --samples 1 -o out.png")[0] == 0
    from PIL import Image

    with Image.open(tmp_path / "out.png") as image:
        assert (np.asarray(image) == ps.render(scene)).all()


def test_each_frame_has_a_folder_of_its_own_and_is_written_once(tmp_path):
    views = three_views()
    again = written_and_read(scene_of([*views, views[0]]), tmp_path / "room.gltf")
    assert [one["frame"] for one in said_in(tmp_path / "room.gltf")["frames"]] == [
        "room_vase", "room_vase_2", "room_vase_3", "room_vase",
    ]  # fmt: skip
    found = again.nodes[0].content.frames
    assert found[3] is found[0]
    assert written_and_read(again, tmp_path / "copy.gltf").points_known == again.points_known
    assert said_in(tmp_path / "copy.gltf") == said_in(tmp_path / "room.gltf")  # it names the same folders
    assert not list(tmp_path.glob("copy_*"))


def test_names_that_differ_by_case_have_folders_that_do_not(tmp_path):
    """On Windows and macOS room_Vase and room_vase are one folder."""
    named = zip(three_views(), ("Vase", "vase", "VASE"), strict=True)
    nodes = [ps.Node(ps.PointObject(view), name=name) for view, name in named]
    again = written_and_read(ps.Scene(tuple(nodes)), tmp_path / "room.gltf")
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_dir()) == [
        "room_VASE_3",
        "room_Vase",
        "room_vase_2",
    ]
    assert len({node.content.frame.depth.tobytes() for node in again.nodes}) == 3


def test_a_list_of_one_frame_is_the_frame(folder):  # noqa: F811
    several, alone = ps.load_scene(write_gltf(folder, points_of({"frames": ["my_frame"]}, "my_frame"))).nodes
    assert several.content.is_single and several.content.frame is alone.content.frame


def test_frames_of_a_file_may_differ_in_all_that_a_frame_says(folder):  # noqa: F811
    pose = pose_at(20).tolist()
    said = {"frames": ["my_frame", {"frame": "my_frame", "depth_scale": 500, "pose": pose}], "shading": "flat"}
    (node,) = ps.load_scene(write_gltf(folder, points_of(said))).nodes
    one, other = node.content.frames
    np.testing.assert_allclose(other.depth, 2 * one.depth, rtol=1e-6)
    np.testing.assert_array_equal(other.pose, pose)
    assert node.content.look.shading == "flat"


MIRRORED = np.diag([-1.0, 1, 1, 1]).tolist()


@pytest.mark.parametrize(
    ("said", "complaint"),
    [
        ({"frames": []}, "its frames must be a list of 1 to 200, got 0 of them"),
        ({"frames": ["my_frame"] * 201}, "its frames must be a list of 1 to 200, got 201 of them"),
        ({"frames": "my_frame"}, "its frames must be a list of 1 to 200, got 'my_frame'"),
        ({"frames": ["my_frame", "gone"]}, "frame 1 of 2: 'gone' does not exist"),
        ({"frames": ["my_frame", None]}, "frame 1 of 2: it must name a frame, got None"),
        ({"frames": ["my_frame", {"color": "a.png"}]}, "frame 1 of 2: it must name a frame, got {'color'"),
        ({"frames": [5, "my_frame"]}, "frame 0 of 2: its extras 'pointshade' must be an object, got 5"),
        ({"frames": ["my_frame", {"frame": "my_frame", "shading": "flat"}]}, "frame 1 of 2: its extras"),
        ({"frames": ["my_frame", {"frame": "my_frame", "pose": MIRRORED}]}, "frame 1 of 2: pose mirrors"),
        ({"frames": ["my_frame", {"frame": "my_frame", "pose": [[0] * 4] * 4}]}, "frame 1 of 2: pose must be"),
        ({"frames": ["my_frame", {"frame": "my_frame", "pose": [1, 2]}]}, "frame 1 of 2: pose must be 16 numbers"),
        ({"frames": ["my_frame", {"frame": "my_frame", "fov": 5}], "size": [[1, 2]]}, "arrays belong to"),
        ({"frames": ["my_frame"], "frame": "my_frame", "fov": 50}, "have frames, so frame, fov belong into each"),
    ],
)  # fmt: skip
def test_what_is_said_wrong_is_told_with_the_node_and_the_frame(folder, said, complaint):  # noqa: F811
    with pytest.raises((ValueError, OSError)) as error:
        ps.load_scene(write_gltf(folder, points_of("my_frame", said)))
    text = str(error.value)
    assert text.startswith(f"{folder / 'scene.gltf'}: node 'vase1': ") and complaint in text and "\n" not in text


def test_a_frame_without_a_point_cannot_be_written_and_nothing_is(tmp_path):
    views = three_views()
    views[1] = replaced(views[1], depth=np.zeros_like(views[1].depth))
    with pytest.raises(ValueError, match="node 'vase': frame 1 of 3: its frame has no known depth"):
        ps.save_scene(tmp_path / "scene.gltf", scene_of(views))
    assert not list(tmp_path.iterdir())
