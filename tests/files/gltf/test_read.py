"""glTF and GLB files that another program wrote: what the reader makes of them."""

import math
import sys

import numpy as np
import pygltflib
import pytest
from PIL import Image

import pointshade_gl as ps

from ...support.gltf_files import BLOB, CORNERS, data_uri, document, glb, with_arrays, write_gltf

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
PICTURE = np.random.default_rng(3).integers(0, 256, (4, 6, 3), dtype=np.uint8)
LIGHTS = "KHR_lights_punctual"


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def load(folder, data, notes=refuse):
    return ps.load_scene(write_gltf(folder, data), notes=notes)


def only_mesh(scene):
    (placed,) = scene.placed()
    return placed.content


def with_light(node=None, **light):
    return document(
        nodes=[{"name": "lamp", "extensions": {LIGHTS: {"light": 0}}} | (node or {})],
        extensions={LIGHTS: {"lights": [light]}},
        extensionsUsed=[LIGHTS],
    )


def only_light(folder, data, notes=refuse):
    (placed,) = load(folder, data, notes).placed()
    return placed.content


def turn_x(degrees):
    a = math.radians(degrees)
    return np.array([(1, 0, 0), (0, math.cos(a), -math.sin(a)), (0, math.sin(a), math.cos(a))])


def test_a_glb_made_by_hand_opens(tmp_path):
    path = tmp_path / "tiny.bin"  # the content decides, not the suffix
    path.write_bytes(glb(document(buffers=[{"byteLength": 42}]), BLOB))
    scene = ps.load_scene(path, notes=refuse)
    mesh = only_mesh(scene)
    np.testing.assert_array_equal(mesh.positions, CORNERS)
    assert mesh.faces.tolist() == [[0, 1, 2]]
    assert (mesh.normals, mesh.uv, mesh.texture, mesh.color) == (None, None, None, (1, 1, 1))
    assert scene.nodes[0].name == "leaf" and scene.camera is None
    np.testing.assert_array_equal(scene.pose, FLIP)  # glTF looks along -z


def pygltflib_scene(folder):
    """Nested transforms, a camera, a picture in a file, three lights, by a library."""
    lib, arrays = pygltflib, (CORNERS, np.array([(0, 0), (1, 0), (0, 1)], np.float32), np.array([0, 1, 2], np.uint8))
    Image.fromarray(PICTURE).save(folder / "wood chips.png")
    gltf = lib.GLTF2(scene=0, scenes=[lib.Scene(nodes=[0, 4])])
    gltf.nodes = [
        lib.Node(name="root", translation=[1, 2, 3], children=[1, 2]),
        lib.Node(name="turned", rotation=[math.sin(math.pi / 4), 0, 0, math.cos(math.pi / 4)], scale=[2, 2, 2], mesh=0),
        lib.Node(name="lamps", matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 9, 1], children=[3, 5, 6]),
        lib.Node(name="sun", extensions={LIGHTS: {"light": 0}}),
        lib.Node(name="eye", translation=[0, 0, 5], camera=0),
        lib.Node(name="bulb", extensions={LIGHTS: {"light": 1}}),
        lib.Node(name="torch", extensions={LIGHTS: {"light": 2}}),
    ]
    gltf.cameras = [lib.Camera(type="perspective", perspective=lib.Perspective(yfov=1.0, aspectRatio=1.5, znear=0.1))]
    gltf.meshes = [
        lib.Mesh(primitives=[lib.Primitive(attributes=lib.Attributes(POSITION=0, TEXCOORD_0=1), indices=2, material=0)])
    ]
    color = lib.PbrMetallicRoughness(baseColorFactor=[1, 0.5, 0.25, 1], baseColorTexture=lib.TextureInfo(index=0))
    gltf.materials = [lib.Material(pbrMetallicRoughness=color)]
    gltf.textures, gltf.images = [lib.Texture(source=0)], [lib.Image(uri="wood%20chips.png")]
    start = 0
    for array, code, kind in zip(
        arrays, (lib.FLOAT, lib.FLOAT, lib.UNSIGNED_BYTE), ("VEC3", "VEC2", "SCALAR"), strict=True
    ):
        gltf.bufferViews.append(lib.BufferView(buffer=0, byteOffset=start, byteLength=array.nbytes))
        gltf.accessors.append(
            lib.Accessor(bufferView=len(gltf.accessors), componentType=code, type=kind, count=len(array))
        )
        start += array.nbytes
    gltf.buffers = [lib.Buffer(byteLength=start)]
    gltf.set_binary_blob(b"".join(array.tobytes() for array in arrays))
    gltf.extensionsUsed = [LIGHTS]
    gltf.extensions = {
        LIGHTS: {
            "lights": [
                {"type": "directional", "intensity": math.pi, "color": [1, 0.5, 0]},
                {"type": "point", "intensity": 2 * math.pi},
                {"type": "spot", "intensity": math.pi, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
            ]
        }
    }
    return gltf


@pytest.mark.parametrize("name", ["scene.gltf", "scene.glb"])
def test_a_librarys_file_is_the_same_scene_as_in_python(tmp_path, name):
    gltf = pygltflib_scene(tmp_path)
    (gltf.save_binary if name.endswith("glb") else gltf.save_json)(tmp_path / name)
    scene = ps.load_scene(tmp_path / name, notes=refuse)
    mesh, sun, bulb, torch = scene.placed()
    assert [p.node.name for p in (mesh, sun, bulb, torch)] == ["turned", "sun", "bulb", "torch"]
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = 2 * turn_x(90), (1, 2, 3)
    np.testing.assert_allclose(mesh.world, expected, atol=1e-12)
    np.testing.assert_array_equal(mesh.content.texture, PICTURE)
    assert mesh.content.uv.tolist() == [[0, 0], [1, 0], [0, 1]] and mesh.content.color == (1, 0.5, 0.25)
    np.testing.assert_array_equal(sun.world[:3, 3], (1, 2, 12))
    down = (0.0, 0.0, -1.0)
    assert sun.content == ps.Light(direction=down, color=(1, 0.5, 0), intensity=1, shadow=True)
    assert bulb.content == ps.Light(position=(0, 0, 0), intensity=2, attenuation=(0, 0, 1), shadow=True)
    assert torch.content.cone == pytest.approx((math.degrees(0.2), math.degrees(0.5)))
    assert (torch.content.position, torch.content.direction, torch.content.attenuation) == ((0, 0, 0), down, (0, 0, 1))
    assert scene.camera == ps.Camera.from_fov(math.degrees(1.0), 720, 480)
    np.testing.assert_allclose(scene.pose, [(1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 5), (0, 0, 0, 1)])


def test_a_file_of_trimesh_opens(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    world = trimesh.Scene()
    quad = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    picture = trimesh.visual.TextureVisuals(
        uv=quad[:, :2], material=trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(PICTURE))
    )
    sheet = trimesh.Trimesh(quad, [(0, 1, 2), (0, 2, 3)], visual=picture, process=False)
    at = trimesh.transformations.rotation_matrix(math.radians(90), (1, 0, 0), (0, 0, 3))
    world.add_geometry(trimesh.creation.icosphere(subdivisions=1), node_name="ball", transform=at)
    world.add_geometry(sheet, node_name="sheet", parent_node_name="ball", transform=np.diag([2, 2, 2, 1.0]))
    (tmp_path / "three.glb").write_bytes(world.export(file_type="glb"))
    placed = {p.node.name: p for p in ps.load_scene(tmp_path / "three.glb", notes=refuse).placed()}
    np.testing.assert_allclose(placed["ball"].world, at, atol=1e-6)
    np.testing.assert_allclose(placed["sheet"].world, at @ np.diag([2, 2, 2, 1]), atol=1e-6)
    assert placed["ball"].content.faces.shape == (80, 3)
    np.testing.assert_array_equal(placed["sheet"].content.texture, PICTURE)
    np.testing.assert_allclose(placed["sheet"].content.uv, np.stack([quad[:, 0], 1 - quad[:, 1]], 1))  # v runs down


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_indices_of_every_type_are_read(tmp_path, dtype):
    arrays = {"POSITION": (CORNERS, {}), "indices": (np.array([2, 1, 0], dtype), {})}
    assert only_mesh(load(tmp_path, with_arrays(arrays))).faces.tolist() == [[2, 1, 0]]


@pytest.mark.parametrize(
    ("mode", "faces"), [(4, [[0, 1, 2], [3, 4, 5]]), (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]),
                        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]])],
)  # fmt: skip
def test_lists_strips_and_fans_become_triangles(tmp_path, mode, faces):
    data = with_arrays({"POSITION": (np.arange(18, dtype=np.float32).reshape(6, 3), {})}, mode=mode)
    assert only_mesh(load(tmp_path, data)).faces.tolist() == faces


def test_normalised_integers_are_fractions(tmp_path):
    arrays = {
        "POSITION": (CORNERS, {}),
        "NORMAL": (np.array([(0, 0, 127), (0, 127, 0), (-128, 0, 0)], np.int8), {"normalized": True}),
        "TEXCOORD_0": (np.array([(0, 65535), (65535, 0), (13107, 0)], np.uint16), {"normalized": True}),
    }
    mesh = only_mesh(load(tmp_path, with_arrays(arrays)))
    assert mesh.normals.tolist() == [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    np.testing.assert_allclose(mesh.uv, [(0, 1), (1, 0), (0.2, 0)])


def test_interleaved_arrays_are_read_by_their_stride(tmp_path):
    rows = np.column_stack([CORNERS, 5 + CORNERS]).astype(np.float32)
    views = [{"buffer": 0, "byteLength": 72, "byteStride": 24}]
    accessors = [
        {"bufferView": 0, "byteOffset": start, "componentType": 5126, "count": 3, "type": "VEC3"} for start in (0, 12)
    ]
    mesh = only_mesh(load(tmp_path, document(
        meshes=[{"primitives": [{"attributes": {"POSITION": 1, "NORMAL": 0}}]}], accessors=accessors,
        bufferViews=views, buffers=[{"byteLength": 72, "uri": data_uri(rows.tobytes())}],
    )))  # fmt: skip
    np.testing.assert_array_equal(mesh.positions, 5 + CORNERS)
    np.testing.assert_array_equal(mesh.normals, CORNERS)


def test_a_sparse_array_is_read_with_its_changes(tmp_path):
    blob = BLOB + bytes(2) + np.array([2], np.uint32).tobytes() + np.array([(7, 8, 9)], np.float32).tobytes()
    data = document(buffers=[{"byteLength": len(blob), "uri": data_uri(blob)}])
    data["bufferViews"] += [
        {"buffer": 0, "byteOffset": 44, "byteLength": 4},
        {"buffer": 0, "byteOffset": 48, "byteLength": 12},
    ]
    data["accessors"][0]["sparse"] = {
        "count": 1, "indices": {"bufferView": 2, "componentType": 5125}, "values": {"bufferView": 3},
    }  # fmt: skip
    assert only_mesh(load(tmp_path, data)).positions.tolist() == [[0, 0, 0], [1, 0, 0], [7, 8, 9]]


def test_each_primitive_is_a_mesh_and_nodes_share_them(tmp_path):
    primitive = document()["meshes"][0]["primitives"][0]
    nodes = [{"name": "a", "mesh": 0, "children": [1]}, {"name": "b", "mesh": 0}]
    (a,) = load(tmp_path, document(meshes=[{"primitives": [primitive, primitive]}], nodes=nodes)).nodes
    b = a.children[0]
    assert len(a.content) == 2 and a.content[0] is b.content[0] and a.content[1] is b.content[1]


def test_what_is_not_drawn_is_left_out_and_told(tmp_path):
    notes = []
    data = document(extensionsUsed=["EXT_fog"], animations=[{"channels": [], "samplers": []}])
    data["meshes"][0] |= {"name": "odd"}
    data["meshes"][0]["primitives"] += [
        {"attributes": {"POSITION": 0}, "mode": 1},
        {"attributes": {"NORMAL": 0}},
        {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]},
    ]
    scene = load(tmp_path, data, notes.append)
    assert len(list(scene.placed())) == 2
    said = [
        "EXT_fog",
        "animations",
        "'odd' primitive 1 is left out",
        "'odd' primitive 2 is left out",
        "morph",
    ]
    assert len(notes) == len(said) and all(word in note for word, note in zip(said, notes, strict=True)), notes


@pytest.mark.parametrize("kind", ["data uri", "jpeg file", "buffer view"])
def test_pictures_come_from_everywhere(tmp_path, kind):
    flat = np.full((8, 8, 3), (200, 100, 50), np.uint8)
    Image.fromarray(flat).save(tmp_path / "flat.png")
    Image.fromarray(flat).save(tmp_path / "flat.jpg", quality=100)
    png = (tmp_path / "flat.png").read_bytes()
    data = with_arrays({"POSITION": (CORNERS, {}), "TEXCOORD_1": (CORNERS[:, :2].copy(), {})}, material=0)
    data["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}]
    data["textures"], image = [{"source": 0}], {"uri": data_uri(png, "image/png")}
    if kind == "jpeg file":
        image = {"uri": "flat.jpg"}
    elif kind == "buffer view":
        data["buffers"].append({"byteLength": len(png), "uri": data_uri(png)})
        data["bufferViews"].append({"buffer": 1, "byteLength": len(png)})
        image = {"bufferView": len(data["bufferViews"]) - 1, "mimeType": "image/png"}
    mesh = only_mesh(load(tmp_path, data | {"images": [image]}))
    assert np.abs(mesh.texture.astype(int) - flat).max() <= 2
    np.testing.assert_array_equal(mesh.uv, CORNERS[:, :2])


def test_an_unlit_material_and_our_own_numbers(tmp_path):
    data = document(extensionsRequired=["KHR_materials_unlit"], extensionsUsed=["KHR_materials_unlit"])
    data["meshes"][0]["primitives"] = [data["meshes"][0]["primitives"][0] | {"material": k} for k in (0, 1)]
    data["materials"] = [
        {"extensions": {"KHR_materials_unlit": {}}},
        {"extras": {"pointshade": {"specular": 0, "shading": "flat"}}},
    ]
    unlit, flat = (p.content for p in load(tmp_path, data).placed())
    assert (unlit.shading, flat.shading, flat.material) == ("none", "flat", ps.Material(specular=0))


def test_a_camera_below_a_scale_and_a_mirror_looks_straight(tmp_path):
    nodes = [
        {"name": "root", "scale": [-2, 3, 1], "children": [1]},
        {"name": "eye", "translation": [1, 0, 4], "rotation": [0, math.sin(0.2), 0, math.cos(0.2)], "camera": 0},
    ]
    data = document(nodes=nodes, cameras=[{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 1}}])
    scene = load(tmp_path, data)
    assert scene.camera == ps.Camera.from_fov(math.degrees(0.8), 640, 480)  # 4:3 if the file does not say
    np.testing.assert_allclose(scene.pose[:3, :3].T @ scene.pose[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(scene.pose[:3, :3]) > 0 and scene.pose[:3, 3].tolist() == [-2, 0, 4]
    ahead = np.array([2 * math.sin(0.4), 0, -math.cos(0.4)])
    np.testing.assert_allclose(scene.pose[:3, 2], ahead / np.linalg.norm(ahead))
    assert [node.name for node in scene.nodes] == ["root"] and not scene.nodes[0].children


def test_of_several_cameras_the_first_perspective_one_is_taken(tmp_path):
    nodes = [{"name": f"eye{k}", "camera": k, "translation": [k, 0, 0]} for k in range(3)]
    view = {"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}
    flat = {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 2, "znear": 1}}
    notes = []
    data = document(nodes=nodes, cameras=[flat, view, view], scenes=[{"nodes": [0, 1, 2]}])
    scene = load(tmp_path, data, notes.append)
    assert scene.pose[0, 3] == 1 and [node.name for node in scene.nodes] == ["eye0", "eye2"]
    assert len(notes) == 2 and "eye0" in notes[0] and "eye2" in notes[1]


def test_the_default_scene_is_taken_else_the_first_else_all_roots(tmp_path):
    nodes = [{"name": "a", "children": [2]}, {"name": "b"}, {"name": "c"}]
    data = document(nodes=nodes, scenes=[{"nodes": [0]}, {"nodes": [1]}])
    assert [node.name for node in load(tmp_path, data | {"scene": 1}).nodes] == ["b"]
    del data["scene"]
    assert [node.name for node in load(tmp_path, data).nodes] == ["a"]
    del data["scenes"]
    assert [node.name for node in load(tmp_path, data).nodes] == ["a", "b"]


def test_a_light_casts_shadows_unless_it_or_its_node_is_told_otherwise(tmp_path):
    off = {"extras": {"pointshade": {"shadow": False}}}
    on = {"extras": {"pointshade": {"shadow": 1}}}
    assert only_light(tmp_path, with_light(type="point")).shadow
    assert not only_light(tmp_path, with_light(type="point", **off)).shadow
    assert not only_light(tmp_path, with_light(off, type="point")).shadow
    assert only_light(tmp_path, with_light(off, type="point", **on)).shadow


def test_a_spot_of_half_a_turn_rounded_to_float32_is_one(tmp_path):
    light = only_light(tmp_path, with_light(type="spot", spot={"outerConeAngle": float(np.float32(math.pi / 2))}))
    assert light.cone == (0, 90)


def test_a_range_is_told(tmp_path):
    notes = []
    only_light(tmp_path, with_light(type="point", range=3), notes.append)
    assert len(notes) == 1 and "range" in notes[0]


def test_blenders_lights_are_as_bright_as_there(tmp_path):
    """Its sun of strength pi is 683 pi lux in its files, and lights a white surface white."""
    notes = []
    data = with_light(type="directional", intensity=683 * math.pi)
    data["asset"]["generator"] = "Khronos glTF Blender I/O v4.2.57"
    assert only_light(tmp_path, data, notes.append).intensity == pytest.approx(1)
    assert len(notes) == 1 and "683" in notes[0]
    data["scenes"][0]["extras"] = {"pointshade": {"exposure": 0.5, "ambient": [0, 0, 1]}}
    scene = load(tmp_path, data, notes.append)
    assert next(scene.placed()).content.intensity == pytest.approx(0.5) and scene.ambient == (0, 0, 1)


def test_extras_of_any_type_are_no_error(tmp_path):
    assert (
        load(tmp_path, document(nodes=[{"name": "a", "mesh": 0, "extras": [1, 2]}], extras="free")).nodes[0].name == "a"
    )


def test_nodes_three_thousand_levels_deep_open(tmp_path):
    nodes = [{"children": [k + 1]} for k in range(2999)] + [{"mesh": 0}]
    (placed,) = load(tmp_path, document(nodes=nodes)).placed()
    assert len(placed.path) == 3000


@pytest.mark.parametrize("name", ["out.gltf", "out.glb"])
def test_scenes_need_no_library(tmp_path, monkeypatch, name):
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    scene = ps.load_scene(write_gltf(tmp_path, document()))
    ps.save_scene(tmp_path / name, scene)
    assert ps.load_scene(tmp_path / name).nodes[0].name == "leaf"
