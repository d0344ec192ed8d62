"""`render` and `estimate_normals` take what the command line takes: paths, built-in names, yaw, pitch and dolly."""

import inspect
import shutil

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.access.known_names import asset
from pointshade_gl.scene.graph import Scene

from ..support import frames
from ..support.gltf_files import write_gltf


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with a frame, a sequence of other frames, and a scene."""
    monkeypatch.chdir(tmp_path)
    c = frames.CAMERA
    numbers = f'"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": {c.width}, "height": {c.height}'
    for name in ("ball", "balls/depth"):
        (tmp_path / name).mkdir(parents=True)
    for place in (tmp_path / "ball", tmp_path / "balls"):
        (place / "intrinsics.json").write_text(f"{{{numbers}}}")
    np.save("ball/depth.npy", frames.sphere().depth)
    for k in range(2):
        np.save(f"balls/depth/{k}.npy", frames.sphere().depth + np.float32(0.1 * k) * (frames.sphere().depth > 0))
    node = {"extras": {"pointshade": {"frame": "ball"}}}
    write_gltf(tmp_path, {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [node]})
    return tmp_path


@pytest.mark.parametrize("name", ["vase", "ball", "balls"])
def test_a_folder_or_name_is_drawn_as_the_frame_that_it_holds(renderer, folder, name):
    frame = ps.load_frame(name)
    np.testing.assert_array_equal(renderer.render(name), renderer.render(frame))
    np.testing.assert_array_equal(ps.estimate_normals(name), renderer.estimate_normals(frame))


@pytest.mark.parametrize("name", ["demo", "scene.gltf"])
def test_a_scene_file_or_name_is_drawn_as_the_scene(renderer, folder, name):
    np.testing.assert_array_equal(renderer.render(name), renderer.render(ps.load_scene(name)))
    with pytest.raises(ValueError, match="the objects of a scene have a look of their own: leave out shading"):
        renderer.render(name, shading="flat")


def test_paths_may_be_paths(renderer, folder):
    np.testing.assert_array_equal(renderer.render(folder / "ball"), renderer.render("ball"))


@pytest.mark.parametrize(
    ("name", "turn"),
    [
        ("vase/front", {"pitch": -10, "dolly": 0.2}),
        ("vase/front", {"yaw": 20, "pitch": 10, "dolly": -0.5}),
        ("demo", {"yaw": 20}),
        ("demo", {"yaw": 20, "pitch": 10, "dolly": -0.5}),
    ],
)
def test_turns_are_those_of_the_command_line(renderer, typed, name, turn):
    options = " ".join(f"--{key} {value}" for key, value in turn.items())
    assert typed(f"render {name} {options} --samples 1 -o out.png")[0] == 0
    with Image.open("out.png") as image:
        np.testing.assert_array_equal(renderer.render(name, **turn), np.asarray(image))


def test_turns_start_at_the_frames_own_pose(renderer):
    pose = ps.orbit_pose(None, (0.3, 0, 1), yaw=40)
    sphere = frames.sphere()
    frame = ps.Frame(sphere.color, sphere.depth, sphere.camera, pose)
    turned = renderer.render(frame, yaw=15, pitch=5)
    np.testing.assert_array_equal(turned, renderer.render(frame, pose=ps.orbit_pose(pose, frame.pivot, 15, 5)))
    assert not np.array_equal(turned, renderer.render(frame))


@pytest.mark.parametrize("source", [frames.sphere(), Scene((ps.Node(ps.PointObject(frames.sphere())),))])
def test_a_pose_is_not_turned(renderer, source):
    with pytest.raises(ValueError, match="pass pose or yaw and dolly, not both"):
        renderer.render(source, pose=np.eye(4), yaw=3, dolly=0.1)
    with pytest.raises(ValueError, match="dolly below 1"):
        renderer.draw(source, dolly=1)
    assert renderer.render(source, pose=np.eye(4), yaw=0).any()


def test_the_new_options_are_keywords_of_all_that_draws():
    for function in (ps.render, ps.Renderer.render, ps.Renderer.draw):
        parameters = inspect.signature(function).parameters
        assert all(parameters[name].kind is inspect.Parameter.KEYWORD_ONLY for name in ("yaw", "pitch", "dolly"))


def test_what_is_not_there_is_said(renderer, folder):
    shutil.copytree(asset("vase"), "my_frame")
    with pytest.raises(FileNotFoundError, match=r"there is no folder my_fram \(did you mean my_frame\?\)"):
        renderer.render("my_fram")
    with pytest.raises(FileNotFoundError, match="there is no folder my_fram"):
        renderer.estimate_normals("my_fram")
    with pytest.raises(FileNotFoundError, match=r"sene\.gltf does not exist \(did you mean scene\.gltf\?\)"):
        renderer.render("sene.gltf")


def test_a_path_that_cannot_be_read_costs_the_renderer_nothing(renderer, folder):
    renderer.render("ball")
    before = renderer._pipeline
    with pytest.raises(FileNotFoundError):
        renderer.render("nowhere")
    assert renderer._pipeline is before
