"""Point objects in the extras of glTF nodes."""

import json

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ...support.gltf_files import document, write_gltf
from .test_read import FLIP, load

COLOR = np.random.default_rng(5).integers(0, 256, (6, 8, 3), dtype=np.uint8)
DEPTH = (1000 + np.arange(48).reshape(6, 8)).astype(np.uint16)
CAMERA = {"width": 8, "height": 6, "fx": 9, "fy": 9, "cx": 3.5, "cy": 2.5, "depth_scale": 1000}


@pytest.fixture
def folder(tmp_path):
    """The folder of a scene, with a frame in my_frame."""
    frame = tmp_path / "my_frame"
    frame.mkdir()
    Image.fromarray(COLOR).save(frame / "color.png")
    Image.fromarray(DEPTH).save(frame / "depth.png")
    (frame / "intrinsics.json").write_text(json.dumps(CAMERA))
    return tmp_path


def points_of(*said, **more):
    nodes = [{"name": f"vase{k}", "extras": {"pointshade": one}} | more for k, one in enumerate(said)]
    return document(nodes=nodes, scenes=[{"nodes": [*range(len(said))]}])


def only(folder, said, *notes):
    (placed,) = load(folder, points_of(said), *notes).placed()
    return placed.content


@pytest.mark.parametrize("said", [{"frame": "my_frame"}, "my_frame", '{"frame": "my_frame"}', {"frame": "./my_frame/"}])
def test_a_folder_becomes_a_point_object_however_it_is_said(folder, said):
    points = only(folder, said)
    np.testing.assert_array_equal(points.frame.color, COLOR)
    np.testing.assert_allclose(points.frame.depth, DEPTH / 1000, rtol=1e-6)
    assert points.frame.camera == ps.Camera(9, 9, 3.5, 2.5, 8, 6)
    assert (points.look.normals, points.look.shading, points.look.point_size, points.look.material) == (
        "auto",
        "phong",
        None,
        ps.Material(),
    )


def test_the_node_stands_where_the_camera_stood_as_gltf_cameras_do(folder):
    np.testing.assert_array_equal(only(folder, "my_frame").frame.pose, FLIP)
    pose = np.array([(0, -1, 0, 1), (1, 0, 0, 2), (0, 0, 1, 3), (0, 0, 0, 1.0)])
    for said in (pose.tolist(), pose.ravel().tolist()):
        np.testing.assert_array_equal(only(folder, {"frame": "my_frame", "pose": said}).frame.pose, pose)
    np.savetxt(folder / "pose.txt", pose)
    told = []
    ours = only(folder, {"frame": "my_frame", "pose": "pose.txt"}, told.append).frame.pose
    np.testing.assert_array_equal(ours, pose)
    assert len(told) == 1 and "one pose" in told[0]  # whose axes nothing shows


def test_the_built_in_vase_needs_no_file(tmp_path):
    assert only(tmp_path, "vase").frame.points_known == ps.load_frame("vase").points_known


def test_options_of_frames_and_of_objects_are_taken(folder):
    np.save(folder / "sizes.npy", np.full((6, 8), 2.0, np.float32))
    points = only(folder, {
        "frame": "my_frame", "intrinsics": "20,20,4,3", "depth_scale": 500, "normals": "star", "shading": "flat",
        "size": "sizes.npy", "splat": "round", "max_depth_step": "3%", "noise": "kinect", "material": {"specular": 0},
    } | {"intrinsics": "my_frame/intrinsics.json"})  # fmt: skip
    np.testing.assert_allclose(points.frame.depth, DEPTH / 500, rtol=1e-6)
    assert (points.look.normals, points.look.shading, points.look.splat) == ("star", "flat", "round")
    assert (points.look.max_depth_step, points.look.noise, points.look.material) == (
        "3%",
        "kinect",
        ps.Material(specular=0),
    )
    np.testing.assert_array_equal(points.look.point_size, np.full((6, 8), 2))


def test_single_files_become_a_frame(folder):
    said = {"frame": "my_frame/depth.png", "color": "my_frame/color.png", "fov": 50, "depth_scale": 1000}
    frame = only(folder, said).frame
    assert frame.camera == ps.Camera.from_fov(50, 8, 6)
    np.testing.assert_array_equal(frame.color, COLOR)


def test_a_frame_that_several_nodes_show_is_loaded_once(folder):
    a, b, c = load(
        folder,
        points_of(
            "my_frame", {"frame": "my_frame", "shading": "flat"}, {"frame": "my_frame", "fov": 9, "intrinsics": None}
        ),
    ).placed()
    assert a.content.frame is b.content.frame and a.content.frame is not c.content.frame


def test_a_node_may_be_a_mesh_and_a_point_object_and_be_switched_off(folder):
    said = {"frame": "my_frame", "visible": False, "shadow": 0}
    (node,) = load(folder, points_of(said, mesh=0)).nodes
    assert [type(item) for item in node.content] == [ps.PointObject, ps.Mesh]
    assert not node.visible and not node.shadow


@pytest.mark.parametrize(
    ("said", "complaint"),
    [
        ({"frame": "nothing"}, "'nothing' does not exist"),
        ({"frame": "../elsewhere"}, "'../elsewhere' leaves the scene's folder"),
        ({"frame": "/tmp"}, "'/tmp' is an address or an absolute path"),
        ({"frame": "https://example.org/frame"}, "is an address"),
        ({"frame": 5}, "must be named by a text, got 5"),
        ({"frame": "my_frame", "color": "../a.png"}, "leaves the scene's folder"),
        ({"frame": "my_frame", "intrinsics": "cam.json"}, "'cam.json' does not exist"),
        ({"frame": "my_frame", "normal": "star"}, "unknown 'normal': known are frame"),
        ({"frame": "my_frame", "normals": "stars"}, "unknown normals method 'stars'"),
        ({"frame": "my_frame", "shading": 5}, "unknown shading 5"),
        ({"frame": "my_frame", "size": "sizes.npy"}, "'sizes.npy' does not exist"),
        ({"frame": "my_frame", "fov": "wide", "intrinsics": None}, "fov must be a number"),
        ({"frame": "my_frame", "pose": [1, 2]}, "pose must be 16 numbers"),
        ({"frame": "my_frame", "material": {"colour": 1}}, "material must be an object"),
        ({"frame": "my_frame", "visible": "yes"}, "visible must be true or false"),
        ({"normals": "star"}, "have normals, but no frame"),
        ("{", "not valid JSON"),
        ([1], "must be an object"),
    ],
)
def test_what_is_said_wrong_is_told_with_the_node(folder, said, complaint):
    with pytest.raises((ValueError, OSError)) as error:
        load(folder, points_of("my_frame", said))
    text = str(error.value)
    assert text.startswith(f"{folder / 'scene.gltf'}: node 'vase1': ") and complaint in text and "\n" not in text


def test_links_that_leave_the_scenes_folder_are_refused(folder):
    scene = folder / "scene"
    scene.mkdir()
    (scene / "link").symlink_to(folder / "my_frame")
    (scene / "frame").mkdir()
    (scene / "frame" / "depth.png").symlink_to(folder / "my_frame" / "depth.png")
    for name in ("link", "frame"):
        path = write_gltf(scene, points_of({"frame": name}))
        with pytest.raises(ValueError, match=r"node 'vase0': .* leaves the scene's folder"):
            ps.load_scene(path)
