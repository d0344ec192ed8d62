"""Points of glTF files are point clouds: read, written, damaged."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.values import linear_to_bytes

from ...support.gltf_files import with_arrays, write_gltf
from .test_read import load, refuse

CHANCE = np.random.default_rng(31)
AT = CHANCE.normal(size=(40, 3)).astype(np.float32)
NORMALS = CHANCE.normal(size=(40, 3)).astype(np.float32)
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLORS = CHANCE.integers(0, 256, (40, 3), dtype=np.uint8)
LINEAR = CHANCE.random((40, 4), np.float32)
ORIGIN = np.array([637_000.0, 4_849_000.0, 120.0])  # metres of a national grid
LOOK = {"material": ps.Material(0.2, 0.7, 0, 8), "splat": "ball", "point_size": "3px", "up": "-z"}


def only_cloud(scene):
    (placed,) = scene.placed()
    assert isinstance(placed.content, ps.PointCloud)
    return placed.content


def points(extra=None, **more):
    arrays = {"POSITION": (AT, {})} | {name: (one, {}) for name, one in (extra or {}).items()}
    return with_arrays(arrays, mode=0, **more)


def in_world(placed):
    """The points of a cloud, world axes."""
    cloud = placed.content
    return cloud.positions @ placed.world[:3, :3].T + (placed.world @ [*cloud.origin, 1])[:3]


def saved(folder, *contents, name="out.glb", **node):
    ps.save_scene(folder / name, ps.Scene((ps.Node(contents, **node),)))
    return ps.load_scene(folder / name, notes=refuse)


def test_points_are_a_cloud_with_up_as_in_gltf(tmp_path):
    cloud = only_cloud(load(tmp_path, points()))
    np.testing.assert_array_equal(cloud.positions, AT)
    assert (cloud.normals, cloud.colors, cloud.sizes) == (None, None, None)
    assert (cloud.up, cloud.shading, cloud.splat, cloud.point_size) == ("y", "phong", "disc", None)


@pytest.mark.parametrize("width", [3, 4])
@pytest.mark.parametrize("largest", [None, 255, 65535], ids=["float", "bytes", "shorts"])
@pytest.mark.parametrize("says_so", [True, False])
def test_colors_are_linear_in_files(tmp_path, width, largest, says_so):
    kind = {None: np.float32, 255: np.uint8, 65535: np.uint16}[largest]
    stored = np.ascontiguousarray(LINEAR[:, :width] if largest is None else np.rint(LINEAR[:, :width] * largest), kind)
    data = with_arrays({"POSITION": (AT, {}), "COLOR_0": (stored, {"normalized": says_so} if largest else {})}, mode=0)
    cloud = only_cloud(load(tmp_path, data))
    np.testing.assert_array_equal(cloud.colors, linear_to_bytes(stored[:, :3] / np.float32(largest or 1)))


def test_the_material_colors_points_and_may_be_unlit(tmp_path):
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 0.25, 1]},
        "extensions": {"KHR_materials_unlit": {}},
    }
    data = points({"NORMAL": NORMALS}, material=0) | {"materials": [material]}
    cloud = only_cloud(load(tmp_path, data))
    assert cloud.shading == "none" and {tuple(c) for c in cloud.colors.tolist()} == {(188, 255, 137)}
    np.testing.assert_array_equal(cloud.normals, NORMALS)


def test_indices_choose_points(tmp_path):
    chosen = np.array([7, 3, 3, 39], np.uint16)
    cloud = only_cloud(load(tmp_path, points({"NORMAL": NORMALS, "COLOR_0": LINEAR, "indices": chosen})))
    np.testing.assert_array_equal(cloud.positions, AT[chosen])
    np.testing.assert_array_equal(cloud.normals, NORMALS[chosen])
    assert len(cloud.colors) == 4


def test_points_and_triangles_of_one_mesh_stand_in_one_node(tmp_path):
    data = points()
    data["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 5})
    kinds = [type(p.content) for p in load(tmp_path, data).placed()]
    assert kinds == [ps.PointCloud, ps.Mesh]


def test_lines_are_left_out(tmp_path):
    told = []
    data = points()
    data["meshes"][0]["primitives"][0]["mode"] = 1
    assert not list(load(tmp_path, data, told.append).placed())
    assert told == ["mesh 0 is left out: it has lines, only triangles and points are drawn"]


def test_the_front_of_a_cloud_comes_back(tmp_path):
    assert only_cloud(saved(tmp_path, ps.PointCloud(AT, front="-z"), name="out.glb")).front == "-z"


@pytest.mark.parametrize("name", ["out.gltf", "out.glb"])
@pytest.mark.parametrize("shading", ["phong", "none", "edl"])
def test_a_cloud_comes_back_as_it_was_written(tmp_path, name, shading):
    each = {"sizes": CHANCE.random(40), "confidence": CHANCE.random(40), "seen_from": AT + 1}
    cloud = ps.PointCloud(AT, NORMALS, COLORS, **each, **LOOK, shading=shading)
    back = only_cloud(saved(tmp_path, cloud, name=name))
    for field in ("positions", "normals", "colors", "sizes", "confidence", "seen_from"):
        np.testing.assert_array_equal(getattr(back, field), getattr(cloud, field), field)
    kept = LOOK | {"shading": shading, "front": None}
    assert {name: getattr(back, name) for name in kept} == kept
    again = saved(tmp_path, back, name="again.glb")
    np.testing.assert_array_equal(only_cloud(again).colors, COLORS)


def test_a_plain_cloud_says_nothing_but_its_points(tmp_path):
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(ps.PointCloud(AT, up="y")),)))
    (mesh,) = json.loads((tmp_path / "out.gltf").read_text())["meshes"]
    assert mesh == {"primitives": [{"mode": 0, "attributes": {"POSITION": 0}}]}


def test_other_programs_do_not_light_what_is_not_lit(tmp_path):
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(ps.PointCloud(AT, shading="edl")),)))
    (material,) = json.loads((tmp_path / "out.gltf").read_text())["materials"]
    assert "KHR_materials_unlit" in material["extensions"]


@pytest.mark.parametrize("inside", [False, True], ids=["origin", "positions"])
def test_georeferenced_points_keep_their_millimetres(tmp_path, inside):
    """Far from zero float32 tells half metres apart: the place is part of the node's transform."""
    cloud = ps.PointCloud(AT + ORIGIN, up="z") if inside else ps.PointCloud(AT, origin=ORIGIN, up="z")
    seen = ps.PointCloud(cloud.positions, origin=cloud.origin, seen_from=cloud.positions[0])
    turn = np.array([[0, -2, 0, 5], [2, 0, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1.0]])
    expected = (AT + ORIGIN) @ turn[:3, :3].T + turn[:3, 3]
    back = saved(tmp_path, seen, name="alone.glb", transform=turn)
    (alone,) = back.placed()
    np.testing.assert_allclose(in_world(alone), expected, rtol=0, atol=1e-5)
    np.testing.assert_allclose(alone.content.seen_from, alone.content.positions[0], atol=1e-5)
    assert not back.nodes[0].children
    board, cloud_below = saved(
        tmp_path, cloud, ps.Mesh(AT[:3], [(0, 1, 2)]), name="beside.glb", transform=turn, shadow=False
    ).placed()
    np.testing.assert_allclose(in_world(cloud_below), expected, rtol=0, atol=1e-5)
    np.testing.assert_allclose(board.world, turn, atol=1e-9)  # what stands beside the cloud is not moved
    assert not cloud_below.node.shadow


def test_a_cloud_that_nodes_share_is_written_once_and_an_empty_one_never(tmp_path):
    cloud, empty = ps.PointCloud(AT), ps.PointCloud(np.zeros((0, 3)))
    ps.save_scene(tmp_path / "out.gltf", ps.Scene((ps.Node(cloud), ps.Node((cloud, empty)), ps.Node(empty, "b"))))
    assert len(json.loads((tmp_path / "out.gltf").read_text())["meshes"]) == 1
    nodes = ps.load_scene(tmp_path / "out.gltf", notes=refuse).nodes
    assert [node.content is None for node in nodes] == [False, False, True]


def test_another_program_opens_what_is_written_and_is_read(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    saved(tmp_path, ps.PointCloud(AT, NORMALS, COLORS))
    (opened,) = trimesh.load_scene(tmp_path / "out.glb").geometry.values()
    np.testing.assert_array_equal(opened.vertices.astype(np.float32), AT)
    trimesh.PointCloud(AT, colors=np.column_stack([COLORS, np.full(40, 255)]).astype(np.uint8)).export(
        tmp_path / "b.glb"
    )
    cloud = only_cloud(ps.load_scene(tmp_path / "b.glb", notes=refuse))
    np.testing.assert_array_equal(cloud.positions, AT)
    np.testing.assert_array_equal(cloud.colors, linear_to_bytes(COLORS / np.float32(255)))


def broken(arrays, extras=None, **more):
    data = points(arrays, **more)
    if extras is not None:
        data["meshes"][0]["primitives"][0]["extras"] = {"pointshade": extras}
    return data


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (broken({"NORMAL": NORMALS[:-1]}), r"normals must have shape \(40, 3\), got \(39, 3\)"),
        (broken({"COLOR_0": LINEAR[:1]}), r"colors must have shape \(40, 3\), got \(1, 3\)"),
        (broken({"COLOR_0": LINEAR[:, :2].copy()}), "VEC2 of component type 5126, expected VEC3 or VEC4"),
        (broken({"indices": np.array([40], np.uint16)}), "its indices must name one of 40 points, got 40"),
        (broken({"NORMAL": NORMALS[:9], "indices": np.array([9], np.uint8)}), "one of 9 points"),
        (broken({"indices": np.array([0], np.float32)}), "its indices must name one of 40 points"),
        (with_arrays({"POSITION": (np.full((3, 3), np.nan, np.float32), {})}, mode=0), "positions must be finite"),
        (broken({}, {"splat": "cube"}), "unknown splat 'cube'"),
        (broken({}, {"size": -1}), "point_size must"),
        (broken({}, {"up": 3}), "unknown up 3"),
        (broken({}, {"seen_from": [1, 2]}), "seen_from must be 3 numbers"),
        (broken({}, {"radius": 2}), "unknown 'radius': known are splat, size, up, front, seen_from"),
        (broken({"_SIZE": -np.ones(40, np.float32)}), "sizes must not be negative"),
    ],
)
def test_damaged_points_are_refused_in_one_sentence(tmp_path, data, complaint):
    path = write_gltf(tmp_path, data)
    with pytest.raises(ValueError, match=complaint) as error:
        ps.load_scene(path)
    assert str(error.value).startswith(f"{path}: node 'leaf': mesh 0") and "\n" not in str(error.value)


def test_a_color_that_is_no_number_is_dark(tmp_path):
    colors = np.full((40, 3), np.nan, np.float32)
    colors[1] = 7, -3, np.inf
    cloud = only_cloud(load(tmp_path, points({"COLOR_0": colors})))
    assert cloud.colors[:2].tolist() == [[0, 0, 0], [255, 0, 255]]
