"""Broken scene files: each gives one sentence that names the file and the part."""

import copy
import json
import math
import random
import struct

import numpy as np
import pytest

import pointshade_gl as ps

from ...support.gltf_files import BLOB, data_uri, document, glb, write_gltf


def changed(path, value):
    """The triangle's document with one entry changed: ("nodes", 0, "mesh"), 7."""
    data = document(materials=[{"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])
    data |= {"textures": [{"source": 0}], "images": [{"uri": data_uri(b"")}]}
    data["nodes"].append({"name": "other"})
    at = data
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return data


def complaint_of(path):
    with pytest.raises((ValueError, OSError)) as error:
        ps.load_scene(path)
    text = str(error.value)
    assert text.startswith(f"{path}: ") or str(path) in text
    assert "\n" not in text and len(text) < 600
    return text


NODE, PRIMITIVE, ACCESSOR = ("nodes", 0), ("meshes", 0, "primitives", 0), ("accessors", 0)


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("scenes", 0, "nodes"), [7], "the scene: there is no node 7, the file has 2"),
        (("scene",), 3, "there is no scene 3"),
        ((*NODE, "children"), [9], "node 'leaf': there is no node 9"),
        ((*NODE, "children"), [0], "node 'leaf': its child node 'leaf' is also above it: a scene has no cycles"),
        ((*NODE, "children"), [1, 1], "node 'leaf': its child node 'other' has another parent already"),
        (("scenes", 0, "nodes"), [0, 0], "the scene: its child node 'leaf' has another parent"),
        ((*NODE, "mesh"), 4, "node 'leaf': there is no mesh 4"),
        ((*NODE, "mesh"), -1, "node 'leaf': there is no mesh -1"),
        ((*NODE, "camera"), 0, "node 'leaf': there is no camera 0, the file has 0"),
        ((*NODE, "scale"), [1, 0, 1], "node 'leaf': its transform has a scale of zero"),
        ((*NODE, "name"), None, ""),
        ((*NODE, "translation"), [0, math.nan, 0], "node 'leaf': translation must be finite"),
        ((*NODE, "translation"), [0, 1], "node 'leaf': translation must be 3 numbers"),
        ((*NODE, "rotation"), [0, 0, 0, 0], "node 'leaf': rotation must be a quaternion"),
        ((*NODE, "matrix"), [1.0] * 15, "node 'leaf': matrix must be 16 numbers"),
        ((*NODE, "matrix"), [math.inf] * 16, "node 'leaf': matrix must be finite"),
        ((*NODE, "matrix"), [2.0] * 16, "node 'leaf': the last row of its transform"),
        ((*NODE, "extensions"), {"KHR_lights_punctual": {"light": 0}}, "node 'leaf': there is no light 0"),
        ((*PRIMITIVE, "indices"), 5, "node 'leaf': mesh 0: there is no accessor 5"),
        ((*PRIMITIVE, "indices"), 0, "accessor 0: is VEC3 of component type 5126, expected SCALAR"),
        ((*PRIMITIVE, "material"), 2, "there is no material 2"),
        ((*PRIMITIVE, "material"), 0, "material 'wood': texture 0: image 0: its file is not a picture"),
        ((*ACCESSOR, "count"), 4, "accessor 0: it ends at byte 48 of a buffer view of 36 bytes"),
        ((*ACCESSOR, "count"), 10**18, "accessor 0: it ends at byte"),
        ((*ACCESSOR, "count"), -1, "accessor 0: -1 elements"),
        ((*ACCESSOR, "byteOffset"), -4, "are impossible"),
        ((*ACCESSOR, "componentType"), 5124, "component type 5124"),
        ((*ACCESSOR, "bufferView"), 9, "there is no buffer view 9"),
        ((*ACCESSOR, "bufferView"), None, "accessor 0: a buffer view must be named by its number, got None"),
        (("accessors", 1, "count"), 2, "its triangles have 2 corners"),
        (("bufferViews", 1, "byteLength"), 8, "buffer view 1: 8 bytes at byte 36 do not fit into a buffer of 42"),
        (("bufferViews", 0, "byteStride"), 4, "are impossible"),
        (("buffers", 0, "byteLength"), 43, "buffer 0: has 42 bytes, expected 43"),
        (("buffers", 0, "uri"), "gone.bin", "buffer 0: 'gone.bin' does not exist in"),
        (("buffers", 0, "uri"), "../scene.bin", "buffer 0: '../scene.bin' leaves the scene's folder"),
        (("buffers", 0, "uri"), "%2e%2e/scene.bin", "leaves the scene's folder"),
        (("buffers", 0, "uri"), "/etc/passwd", "is an address or an absolute path"),
        (("buffers", 0, "uri"), "file:///etc/passwd", "is an address or an absolute path"),
        (("buffers", 0, "uri"), "https://example.org/a.bin", "is an address or an absolute path"),
        (("buffers", 0, "uri"), "C:\\a.bin", "is an address or an absolute path"),
        (("buffers", 0, "uri"), ".", "is not a file"),
        (("buffers", 0, "uri"), "a\0b", "buffer 0: "),
        (("buffers", 0, "uri"), None, "buffer 0: has no uri, and the file has no binary chunk"),
        (("buffers", 0, "uri"), "data:x;base64,????", "buffer 0: "),
        (("images", 0), {"uri": "gone.png"}, ""),
        (("extensionsRequired",), ["KHR_draco_mesh_compression"], "requires the extension KHR_draco_mesh_compression"),
        (("asset",), {"version": "1.0"}, "is glTF of version 1.0, expected 2.0"),
        (("asset",), {"version": "2.0", "minVersion": "2.1"}, "minVersion 2.1"),
        (("asset",), {}, "is not glTF: it has no asset.version"),
        (("nodes",), {"leaf": {}}, "is not valid glTF 2.0"),
        (("nodes",), [None, None], "node 0 is null"),
    ],
)  # fmt: skip
def test_a_broken_part_is_named(tmp_path, path, value, complaint):
    data = changed(path, value)
    if not complaint:  # unused parts may be broken
        assert ps.load_scene(write_gltf(tmp_path, data)).nodes
        return
    assert complaint in complaint_of(write_gltf(tmp_path, data))


def test_a_missing_picture_names_the_node_and_the_image(tmp_path):
    data = changed(("images", 0), {"uri": "gone.png", "name": "bark"})
    data["meshes"][0]["primitives"][0]["material"] = 0
    complaint = complaint_of(write_gltf(tmp_path, data))
    assert "node 'leaf': mesh 0: material 'wood': texture 0: image 'bark': 'gone.png' does not exist" in complaint


def test_unnamed_nodes_are_named_by_their_number(tmp_path):
    data = document(nodes=[{"scale": [0, 0, 0], "mesh": 0}])
    assert "scene.gltf: node 0: its transform has a scale of zero" in complaint_of(write_gltf(tmp_path, data))


@pytest.mark.parametrize(
    ("light", "complaint"),
    [
        ({"type": "area"}, "type must be directional, point or spot, got 'area'"),
        ({"type": "point", "intensity": -1}, "intensity must be a number from 0"),
        ({"type": "point", "color": [1, 1]}, "color must be 3 numbers"),
        ({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}}, "light cone must be two half angles"),
        ({"type": "point", "extras": {"pointshade": {"at": "home"}}}, "at must be 'viewer'"),
        ({"type": "point", "extras": {"pointshade": {"angle": 1}}}, "a light with a position has a radius"),
        ({"type": "directional", "extras": {"pointshade": {"radius": -1}}}, "light radius must be a number from 0"),
        ({"type": "point", "extras": {"pointshade": {"shade": False}}}, "unknown 'shade'"),
        (7, "must be an object"),
    ],
)
def test_a_broken_light_names_its_node(tmp_path, light, complaint):
    node = {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}}
    data = document(nodes=[node], extensions={"KHR_lights_punctual": {"lights": [light]}})
    text = complaint_of(write_gltf(tmp_path, data))
    assert "node 'lamp': light 0: " in text and complaint in text


@pytest.mark.parametrize(
    ("camera", "complaint"),
    [
        ({"type": "perspective"}, "has no perspective"),
        ({"type": "perspective", "perspective": {"yfov": 4, "znear": 1}}, "yfov must lie between 0 and pi"),
        ({"type": "perspective", "perspective": {"yfov": 1, "znear": 1, "aspectRatio": 0}}, "aspectRatio be above 0"),
        ({"type": "perspective", "perspective": {"yfov": 1}, "extras": {"pointshade": {"fx": 1}}}, "have no fy, cx"),
    ],
)
def test_a_broken_camera_names_its_node(tmp_path, camera, complaint):
    text = complaint_of(write_gltf(tmp_path, document(nodes=[{"name": "eye", "camera": 0}], cameras=[camera])))
    assert "node 'eye': camera 0: " in text and complaint in text


def test_nodes_that_double_with_every_level_are_refused_at_once(tmp_path):
    nodes = [{"name": f"n{k}", "children": [k + 1, k + 1]} for k in range(60)] + [{"name": "end"}]
    assert "has another parent already" in complaint_of(write_gltf(tmp_path, document(nodes=nodes)))


def test_a_link_that_leaves_the_folder_is_refused(tmp_path):
    (tmp_path / "scene").mkdir()
    (tmp_path / "secret.bin").write_bytes(BLOB)
    (tmp_path / "scene" / "link.bin").symlink_to(tmp_path / "secret.bin")
    path = write_gltf(tmp_path / "scene", document(buffers=[{"byteLength": 42, "uri": "link.bin"}]))
    assert "buffer 0: 'link.bin' leaves the scene's folder" in complaint_of(path)


def test_postscript_is_not_run_as_a_picture(tmp_path):
    data = changed(("images", 0), {"uri": data_uri(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "image/png")})
    data["meshes"][0]["primitives"][0]["material"] = 0
    assert "is PostScript" in complaint_of(write_gltf(tmp_path, data))


WHOLE = glb(document(buffers=[{"byteLength": 42}]), BLOB)


@pytest.mark.parametrize("length", [4, 12, 19, 40, len(WHOLE) - 1])
def test_a_truncated_glb_is_told(tmp_path, length):
    path = tmp_path / "cut.glb"
    path.write_bytes(WHOLE[:length])
    assert "is a truncated GLB" in complaint_of(path)


@pytest.mark.parametrize(
    ("start", "value", "complaint"),
    [
        (4, 1, "version 1, expected 2"),
        (12, 10**9, "reaches beyond its end"),
        (16, 5, "without a JSON chunk"),
        (20, 0xFFFFFFFF, "is a GLB whose JSON is not text"),
    ],
)
def test_a_broken_glb_is_told(tmp_path, start, value, complaint):
    path = tmp_path / "broken.glb"
    path.write_bytes(WHOLE[:start] + struct.pack("<I", value) + WHOLE[start + 4 :])
    assert complaint in complaint_of(path)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"{", "is not valid JSON"),
        (b"[" * 100_000, "is not valid JSON"),
        (b"[1, 2]", "is not glTF"),
        (b"\x89PNG\r\n\x1a\n" + bytes(90), "neither glTF nor GLB"),
        (b"", "is empty"),
        (b"version https://git-lfs.github.com/spec/v1\n", "git-LFS pointer"),
    ],
)
def test_what_is_no_gltf_is_told(tmp_path, content, complaint):
    path = tmp_path / "scene.gltf"
    path.write_bytes(content)
    assert complaint in complaint_of(path)


def test_what_is_no_file_is_told(tmp_path):
    assert "does not exist" in complaint_of(tmp_path / "gone.gltf")
    assert "is a folder" in complaint_of(tmp_path)


@pytest.mark.system
def test_files_changed_at_random_raise_nothing_but_sentences(tmp_path):
    """Entries replaced by others of all types, anywhere in a file that uses everything."""
    chance = random.Random(20)
    picture = np.zeros((2, 2, 3), np.uint8)
    uv = np.zeros((3, 2), np.float32)
    whole = ps.Mesh(np.eye(3), [[0, 1, 2]], normals=np.eye(3), uv=uv, texture=picture, shading="flat")
    frame = ps.Frame(picture, np.ones((2, 2)), ps.Camera(2, 2, 0.5, 0.5, 2, 2))
    spot = ps.Light(position=(0, 0, 0), direction=(0, 0, -1))
    nodes = (ps.Node((whole, spot), "a", children=(ps.Node(ps.PointObject(frame), "b"), ps.Node(ps.Light(), "c"))),)
    ps.save_scene(tmp_path / "all.gltf", ps.Scene(nodes, frame.camera, ambient=(0.5, 1, 1)))
    good = json.loads((tmp_path / "all.gltf").read_text())
    values = [None, -1, 0, 1, 2.5, 1e300, math.nan, True, "", "x", [], [1], {}, {"a": 1}, [[]], [None], "../x", 10**30]
    refused = 0
    for _ in range(400):
        data = copy.deepcopy(good)
        at = data
        while True:
            key = chance.choice(list(at) if isinstance(at, dict) else range(len(at)))
            if not (isinstance(at[key], dict | list) and at[key]) or chance.random() < 0.15:
                break
            at = at[key]
        at[key] = chance.choice(values)
        path = write_gltf(tmp_path, data, "changed.gltf")
        try:
            ps.load_scene(path, notes=lambda text: None)
        except (ValueError, OSError) as error:
            refused += 1
            assert str(error).startswith(f"{path}: "), (key, at[key], error)
    assert refused > 80
