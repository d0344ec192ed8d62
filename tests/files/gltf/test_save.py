"""Scenes written as glTF and GLB: they come back the same, complete or not at all."""

import dataclasses
import json
import math
import struct

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import rotation_of

from ...support.frames import all_missing, single_pixel, step
from .test_read import pygltflib_scene, refuse

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # the pose of a camera in a world whose y points up
CHANCE = np.random.default_rng(9)
RGB = CHANCE.integers(0, 256, (5, 7, 3), dtype=np.uint8)
RGBA = CHANCE.integers(0, 256, (4, 4, 4), dtype=np.uint8)
NORMALS = CHANCE.normal(size=(5, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
FLAT = ps.Mesh(CHANCE.normal(size=(5, 3)), [[0, 1, 2], [2, 3, 4]], color=(0.9, 0.1, 0.3))
SMOOTH = dataclasses.replace(
    FLAT, normals=NORMALS, uv=CHANCE.random((5, 2)), texture=RGB, shading="gouraud",
    material=ps.Material(0.2, 0.7, 0, 8),
)  # fmt: skip
UNLIT = dataclasses.replace(SMOOTH, texture=RGBA, shading="none", material=ps.Material())
EYE_DOME = dataclasses.replace(FLAT, shading="edl")


def transform(angle, scale=1.0, at=(0, 0, 0)):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([(c, -s, 0), (s, c, 0), (0, 0, 1)]) @ np.array([(1, 0, 0), (0, s, c), (0, -c, s)])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * scale, at
    return matrix


def assert_same_content(a, b):
    assert type(a) is type(b)
    for field in dataclasses.fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if field.name == "frame":
            assert x.camera == y.camera
            for name in ("color", "depth", "pose"):
                np.testing.assert_array_equal(getattr(x, name), getattr(y, name))
        elif isinstance(x, np.ndarray):
            assert x.dtype == y.dtype
            np.testing.assert_array_equal(x, y)
        elif isinstance(x, float) or (isinstance(x, tuple) and isinstance(a, ps.Light)):
            assert y == pytest.approx(x, rel=1e-9), field.name  # angles and intensities change their unit
        else:
            assert x == y, field.name


def assert_same_nodes(a, b):
    assert (a.name, a.visible, a.shadow, len(a.children)) == (b.name, b.visible, b.shadow, len(b.children))
    np.testing.assert_allclose(a.transform, b.transform, rtol=0, atol=1e-12)
    contents = [node.content if isinstance(node.content, tuple) else (node.content,) for node in (a, b)]
    assert len(contents[0]) == len(contents[1])
    for x, y in zip(*contents, strict=True):
        if x is not None or y is not None:
            assert_same_content(x, y)
    for x, y in zip(a.children, b.children, strict=True):
        assert_same_nodes(x, y)


def assert_same(a, b):
    assert len(a.nodes) == len(b.nodes) and a.ambient == b.ambient and a.camera == b.camera
    np.testing.assert_allclose(a.pose, b.pose, atol=1e-12)
    for x, y in zip(a.nodes, b.nodes, strict=True):
        assert_same_nodes(x, y)


def everything():
    lamp = {"position": (0, 0, 0), "attenuation": (0, 0, 1)}
    spot = ps.Light(**lamp, direction=(0, 0, -1), cone=(10, 30), color=(1, 0.5, 0), intensity=3, shadow=True)
    points = ps.PointObject(
        step(),
        ps.Material(specular=0.1),
        normals="star",
        shading="flat",
        point_size=2.0,
        splat="round",
        max_depth_step="2%",
        noise="kinect",
        normals_at="target",
        align=True,
    )
    meshes = ps.Node((FLAT, SMOOTH, spot), "meshes", transform(0.3, 2.5, (1, 2, 3)))
    below = (
        meshes,
        ps.Node(UNLIT, "", np.diag([1, 2, -3, 1.0])),  # a mirror: no rotation says it
        ps.Node(
            ps.Light(direction=(0, 0, -1), attenuation=(1, 0.5, 0), angle=0.53), "sun", transform(2), visible=False
        ),
        ps.Node(dataclasses.replace(spot, shadow=False), "off", shadow=False),
        ps.Node(ps.Light(**lamp, radius=0.05), "bulb"),
        ps.Node(ps.Light((0, 0, 0), (0, 0, -1), size=(0.5, 0.25), watts=40, shadow=True), "panel"),
        ps.Node(ps.Light((0, 0, 0), (0, 0, -1), size=(1, 2), falloff="none"), "even panel"),
        ps.Node(ps.Light(), "default"),
        ps.Node((FLAT, EYE_DOME), "again", shadow=False),
    )
    sheared = transform(1)
    sheared[0, 1] += 0.5
    nodes = (ps.Node(points, "Über points/1", transform(4, 0.5)), ps.Node(None, "group", sheared, below))
    camera = ps.Camera(600, -590, 320.25, 200, 640, 480)
    return ps.Scene(nodes, camera, transform(0.7, 1, (4, 5, 6)), (0.5, 0.25, 1))


@pytest.mark.parametrize("name", ["out.gltf", "out.glb", "my scene 1%.gltf"])
def test_a_scene_comes_back_as_it_was_written(tmp_path, name):
    scene = everything()
    ps.save_scene(tmp_path / name, scene)
    assert_same(scene, ps.load_scene(tmp_path / name, notes=lambda text: None))


def test_other_programs_do_not_light_what_has_eye_dome_lighting(tmp_path):
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(EYE_DOME),)))
    (material,) = json.loads((tmp_path / "out.gltf").read_text())["materials"]
    assert "KHR_materials_unlit" in material["extensions"]


@pytest.mark.parametrize("name", ["copy.gltf", "copy.glb"])
def test_what_was_read_from_a_file_comes_back_the_same(tmp_path, name):
    pygltflib_scene(tmp_path).save_json(tmp_path / "scene.gltf")
    first = ps.load_scene(tmp_path / "scene.gltf", notes=refuse)
    ps.save_scene(tmp_path / name, first)
    assert_same(first, ps.load_scene(tmp_path / name, notes=refuse))


def test_meshes_and_frames_that_nodes_share_are_written_once(tmp_path):
    points = ps.PointObject(step())
    nodes = [ps.Node((mesh, points), "same") for mesh in (SMOOTH, SMOOTH)] + [ps.Node(points, "same")]
    ps.save_scene(tmp_path / "out.gltf", ps.Scene(tuple(nodes)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.bin", "out.gltf", "out_0.png", "out_same"]
    data = json.loads((tmp_path / "out.gltf").read_text())
    assert (len(data["meshes"]), len(data["materials"])) == (2, 2)  # the second of each is the frame's fallback
    assert [image["uri"] for image in data["images"]] == ["out_0.png", "out_same/color.png"]
    a, b, c = ps.load_scene(tmp_path / "out.gltf").nodes
    assert a.content[1] is b.content[1] and a.content[0].frame is c.content.frame


def test_what_one_gltf_node_cannot_hold_stands_below_it(tmp_path):
    light = ps.Light(position=(1, 2, 3), direction=(0, 3, 0), attenuation=(1, 0, 0))
    two = ps.PointObject(step()), ps.PointObject(single_pixel())
    ps.save_scene(tmp_path / "out.glb", ps.Scene((ps.Node((light, *two), "all", transform(1)),)))
    placed = list(ps.load_scene(tmp_path / "out.glb").placed())
    assert [type(p.content) for p in placed] == [ps.PointObject, ps.PointObject, ps.Light]
    lamp = placed[2]
    at, towards = lamp.world @ (0, 0, 0, 1), lamp.world @ (*lamp.content.direction, 0)
    np.testing.assert_allclose(at, transform(1) @ (1, 2, 3, 1))
    np.testing.assert_allclose(towards, transform(1) @ (0, 1, 0, 0), atol=1e-12)


def test_arrays_of_a_point_object_are_kept(tmp_path):
    frame = step()
    normals = np.zeros((120, 160, 3), np.float32) - (0, 0, 1)
    sizes = CHANCE.random((120, 160)).astype(np.float32)
    points = ps.PointObject(frame, normals=normals, point_size=sizes, noise=sizes / 100)
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(points, "wall"),)))
    (back,) = ps.load_scene(tmp_path / "out.gltf", notes=refuse).placed()
    for name in ("normals", "point_size", "noise"):
        np.testing.assert_array_equal(
            getattr(back.content.look, name), np.asarray(getattr(points.look, name), np.float32)
        )


def test_frames_are_named_where_they_are_if_the_file_can_name_them(tmp_path):
    ps.save_scene(tmp_path / "a.gltf", ps.Scene((ps.Node(ps.PointObject(step()), "wall"),)))
    read = ps.load_scene(tmp_path / "a.gltf")
    ps.save_scene(tmp_path / "b.gltf", read)
    assert json.loads((tmp_path / "b.gltf").read_text())["nodes"][0]["extras"]["pointshade"]["frame"] == "a_wall"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.bin", "a.gltf", "a_wall", "b.bin", "b.gltf"]
    (image,) = json.loads((tmp_path / "b.gltf").read_text())["images"]  # of the fallback
    assert image["uri"] == "a_wall/color.png"
    other = tmp_path / "other"
    other.mkdir()
    ps.save_scene(other / "c.gltf", read)
    assert sorted(path.name for path in other.iterdir()) == ["c.bin", "c.gltf", "c_wall"]
    assert_same(read, ps.load_scene(other / "c.gltf"))


def test_a_color_above_one_keeps_its_light(tmp_path):
    bright = ps.Light(direction=(0, 0, -1), color=(2, 4, 0), intensity=0.5)
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(bright),)))
    (back,) = ps.load_scene(tmp_path / "out.gltf").placed()
    assert back.content.color == (0.5, 1, 0) and back.content.intensity == pytest.approx(2)


def test_a_scene_without_camera_keeps_its_pose(tmp_path):
    for scene in (ps.Scene(), ps.Scene(pose=transform(1))):
        ps.save_scene(tmp_path / "out.gltf", scene)
        assert_same(scene, ps.load_scene(tmp_path / "out.gltf"))


def test_a_camera_shows_as_much_in_other_programs(tmp_path):
    """Whose pixels need not be square."""
    camera = ps.Camera(100, 60, 40, 30, 81, 61)
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(FLAT),), camera=camera))
    (written,) = json.loads((tmp_path / "out.gltf").read_text())["cameras"]
    across, upright = 81 / 100, 61 / 60
    assert written["perspective"]["aspectRatio"] == pytest.approx(across / upright)
    assert written["perspective"]["yfov"] == pytest.approx(2 * math.atan(upright / 2))


def test_a_mesh_without_triangles_is_left_out(tmp_path):
    empty = ps.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    ps.save_scene(tmp_path / "out.glb", ps.Scene((ps.Node((empty, FLAT), "a"), ps.Node(empty, "b"))))
    assert [node.content is None for node in ps.load_scene(tmp_path / "out.glb").nodes] == [False, True]


def test_normals_are_written_with_unit_length(tmp_path):
    long = dataclasses.replace(FLAT, normals=3 * NORMALS)
    ps.save_scene(tmp_path / "out.glb", ps.Scene((ps.Node(long),)))
    (back,) = ps.load_scene(tmp_path / "out.glb").placed()
    np.testing.assert_allclose(back.content.normals, NORMALS, atol=1e-6)


def test_a_glb_of_an_empty_scene_has_no_bytes(tmp_path):
    ps.save_scene(tmp_path / "out.glb", ps.Scene())
    data = (tmp_path / "out.glb").read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    assert len(data) == 20 + size and b"buffers" not in data


def test_a_glb_is_aligned_as_its_specification_asks(tmp_path):
    ps.save_scene(tmp_path / "out.glb", everything())
    data = (tmp_path / "out.glb").read_bytes()
    magic, version, length, size, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, size % 4, kind) == (b"glTF", 2, len(data), 0, b"JSON")
    size, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert size % 4 == 0 and kind == b"BIN\0"
    assert not list(tmp_path.glob("*.png"))


def test_other_tools_open_what_is_written(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    ps.save_scene(tmp_path / "out.glb", ps.Scene((ps.Node((FLAT, SMOOTH), "a", transform(1)),), pose=FLIP))
    opened = trimesh.load_scene(tmp_path / "out.glb")
    corners = (transform(1) @ np.column_stack([FLAT.positions, np.ones(5)]).T)[:3]
    np.testing.assert_allclose(opened.bounds, [corners.min(1), corners.max(1)], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "scene", "complaint"),
    [
        ("out.obj", ps.Scene(), "suffix must be .gltf or .glb"),
        ("gone/out.glb", ps.Scene(), "there is no folder"),
        ("out.gltf", ps.Scene((ps.Node(FLAT), ps.Node(ps.PointObject(all_missing()), "void"))), "node 'void': .*depth"),
    ],
)
def test_what_cannot_be_written_leaves_nothing_behind(tmp_path, name, scene, complaint):
    with pytest.raises((ValueError, OSError), match=complaint):
        ps.save_scene(tmp_path / name, scene)
    assert not list(tmp_path.iterdir())


def test_files_in_the_way_are_kept(tmp_path):
    scene = ps.Scene((ps.Node(ps.PointObject(step()), "wall"), ps.Node(FLAT)))
    (tmp_path / "out.gltf").write_text("old")
    (tmp_path / "out_wall").mkdir()
    (tmp_path / "out_wall" / "depth.exr").write_text("measured")
    with pytest.raises(FileExistsError, match=r"out_wall holds depth\.exr"):
        ps.save_scene(tmp_path / "out.gltf", scene)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.gltf", "out_wall"]
    assert (tmp_path / "out.gltf").read_text() == "old"
    (tmp_path / "out_wall" / "depth.exr").unlink()
    ps.save_scene(tmp_path / "out.gltf", scene)
    ps.save_scene(tmp_path / "out.gltf", scene)  # over its own files
    assert_same(scene, ps.load_scene(tmp_path / "out.gltf"))


def test_scenes_of_the_same_name_do_not_share_their_frames(tmp_path):
    for suffix, frame in ((".gltf", step()), (".glb", single_pixel())):
        ps.save_scene(tmp_path / f"room{suffix}", ps.Scene((ps.Node(ps.PointObject(frame), "vase"),)))
    for suffix, frame in ((".gltf", step()), (".glb", single_pixel())):
        (placed,) = ps.load_scene(tmp_path / f"room{suffix}").placed()
        np.testing.assert_array_equal(placed.content.frame.depth, frame.depth)


def test_a_saved_scene_looks_the_same_to_the_bit(tmp_path, renderer):
    """Also where the shadow of a lamp is looked up, whose direction comes back an ulp off."""
    floor = ps.Mesh([(-2, 0.6, -1), (2, 0.6, -1), (2, 0.6, 4), (-2, 0.6, 4)], [(0, 1, 2), (0, 2, 3)])
    lamp = ps.Light(position=(-1, -1, 0), direction=(1, 1, 1), cone=(20, 32), shadow=True)
    frame = step()
    nodes = ps.Node(ps.PointObject(frame)), ps.Node(floor), ps.Node(lamp)
    scene = ps.Scene(nodes, camera=frame.camera)
    ps.save_scene(tmp_path / "room.gltf", scene)
    assert (renderer.render(ps.load_scene(tmp_path / "room.gltf")) == renderer.render(scene)).all()


@pytest.mark.parametrize("kind", ["mesh", "frame"])
def test_what_is_known_to_be_up_is_up_in_other_programs_and_comes_back_as_it_was(renderer, tmp_path, kind):
    """A camera that looked down does not make what it saw lean."""
    z = np.full((12, 16), 1.5, np.float32)
    up = np.array([0, -0.8, -0.6])
    frame = ps.Frame(None, z, ps.Camera(20, 20, 7.5, 5.5, 16, 12)).with_up(up)
    scene = renderer.render_mesh(frame) if kind == "mesh" else ps.Scene((ps.Node(ps.PointObject(frame)),))
    ps.save_scene(tmp_path / "a.gltf", scene)
    document = json.loads((tmp_path / "a.gltf").read_text())
    (top,) = (node for node in document["nodes"] if node.get("name") == "y up")
    turn = rotation_of(np.array([top["rotation"]]))[0]
    np.testing.assert_allclose(turn @ up, (0, 1, 0), atol=1e-7)
    back = ps.load_scene(tmp_path / "a.gltf")
    corners = [np.sort(one.extent.corners, 0) for one in (scene, back)]
    np.testing.assert_allclose(*corners, atol=1e-6)
    if kind == "mesh":
        np.testing.assert_allclose(scene.upright, up, atol=1e-9)
