"""What other programs see of a point object: a mesh or points below its node, which `load_scene` leaves out."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.gltf import write_gltf as fallbacks
from pointshade_gl.scene.triangles import frame_surface
from pointshade_gl.scene.values import srgb_to_linear

from ...support.frames import all_missing, sphere, step
from .test_read import refuse
from .test_save import FLIP, assert_same, transform

trimesh = pytest.importorskip("trimesh")
CAMERA = ps.Camera(100, 100, 31.5, 23.5, 64, 48)


def tilted(color=None, **changes):
    """A plane that leans away to the right, before nothing."""
    rays = CAMERA.rays()
    depth = 2 / (rays @ (0.5, 0.2, 1))
    return ps.Frame(color, depth, changes.get("camera", CAMERA), changes.get("pose"))


def checked(height, width):
    """Four colours, one for each quarter."""
    picture = np.zeros((height, width, 3), np.uint8)
    picture[: height // 2, : width // 2] = 250, 20, 20
    picture[: height // 2, width // 2 :] = 20, 250, 20
    picture[height // 2 :, : width // 2] = 20, 20, 250
    picture[height // 2 :, width // 2 :] = 200, 200, 60
    return picture


def opened(path):
    """The positions, in the world, of trimesh's one geometry, and the geometry."""
    scene = trimesh.load_scene(path)
    (name,) = scene.graph.nodes_geometry
    matrix, geometry = scene.graph[name]
    one = scene.geometry[geometry]
    return one.vertices @ matrix[:3, :3].T + matrix[:3, 3], one, matrix


def save(path, frames, name="thing", pose=FLIP, place=None, fallback="mesh", **look):
    points = ps.PointObject(frames, **look)
    scene = ps.Scene((ps.Node(points, name, np.eye(4) if place is None else place),), pose=pose)
    ps.save_scene(path, scene, fallback=fallback)
    return scene


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_a_mesh_stands_where_the_frame_stands_with_its_normals_and_colours(tmp_path, suffix):
    frame = tilted(checked(48, 64), pose=transform(0.4, 1, (1, 2, 3)))
    place = transform(2, 1.5, (0, 1, 0))
    save(tmp_path / f"a{suffix}", frame, place=place)
    positions, mesh, matrix = opened(tmp_path / f"a{suffix}")
    truth = frame.camera.unproject(frame.depth, pose=frame.pose).reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]
    np.testing.assert_allclose(positions, truth, atol=1e-5)
    assert len(mesh.faces) == 2 * 63 * 47
    normals = np.asarray(mesh.vertex_normals) @ matrix[:3, :3].T
    expected = place[:3, :3] @ frame.pose[:3, :3] @ (-0.5, -0.2, -1)
    turned = normals @ expected / np.linalg.norm(normals, axis=1) / np.linalg.norm(expected)
    assert turned.min() > 0.99999
    assert (mesh.face_normals @ matrix[:3, :3].T @ expected).min() > 0  # fronts face the camera
    colors = np.asarray(mesh.visual.to_color().vertex_colors)[:, :3].reshape(48, 64, 3).astype(int)
    for v in (12, 36):
        for u in (16, 48):
            assert np.abs(colors[v, u] - frame.color[v, u]).max() < 12  # a .glb's picture is a JPEG


def test_surfaces_end_where_depth_jumps(tmp_path):
    save(tmp_path / "a.glb", step())
    positions, mesh, _ = opened(tmp_path / "a.glb")
    sides = positions[mesh.faces]
    assert np.linalg.norm(sides - np.roll(sides, 1, 1), axis=-1).max() < 0.1
    assert len(mesh.faces) > 2 * 119 * 157


def test_a_ball_has_a_balls_normals_up_to_its_rim():
    frame = sphere()
    surface = frame_surface(frame, 10**6)
    z = surface.positions[:, 2]
    ball = z > np.sort(z)[len(z) // 20]
    facing = np.abs((surface.normals * surface.positions).sum(1) / np.linalg.norm(surface.positions, axis=1))
    assert len(surface.faces) > 1.8 * len(z) and ball.any()
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-5)
    assert facing.min() >= 0 and (surface.normals * surface.positions).sum(1).max() < 0.05  # towards the camera


def test_normals_of_noisy_depth_are_smooth_and_its_surface_whole():
    chance = np.random.default_rng(1)
    camera = ps.Camera(500, 500, 159.5, 119.5, 320, 240)
    depth = 2 / (camera.rays() @ (0.3, 0.1, 1))
    noisy = depth * (1 + chance.normal(0, 0.004, depth.shape))
    surface = frame_surface(ps.Frame(None, noisy, camera), 10**6)
    truth = np.array((-0.3, 0.1, 1)) / np.linalg.norm((0.3, 0.1, 1))
    angles = np.degrees(np.arccos(np.clip(surface.normals @ truth, -1, 1)))
    assert np.median(angles) < 12  # without smoothing about 50
    assert len(surface.faces) > 0.97 * 2 * 319 * 239


def test_given_normals_and_depth_steps_are_those_of_the_mesh():
    frame = tilted()
    normals = np.broadcast_to(np.float32((0, 0.6, -0.8)), (48, 64, 3))
    surface = frame_surface(frame, 10**6, normals=normals)
    np.testing.assert_allclose(surface.normals, np.broadcast_to((0, -0.6, 0.8), surface.normals.shape), atol=1e-6)
    assert not len(frame_surface(frame, 10**6, step=(1e-6, 0.0)).faces)
    assert len(frame_surface(step(), 10**6, step=(5.0, 0.0)).faces) == 2 * 119 * 159


def test_a_mirrored_camera_turns_no_triangle_around():
    frame = tilted(camera=ps.Camera(100, -100, 31.5, 23.5, 64, 48))
    surface = frame_surface(frame, 10**6)
    a, b, c = np.moveaxis(surface.positions[surface.faces], 1, 0)
    assert ((np.cross(b - a, c - a) * surface.normals[surface.faces[:, 0]]).sum(1) > 0).all()


def test_points_have_the_colours_at_their_pixels(tmp_path):
    frame = tilted(checked(96, 128))  # colours larger than depth
    save(tmp_path / "a.glb", frame, fallback="points")
    positions, cloud, _ = opened(tmp_path / "a.glb")
    assert isinstance(cloud, trimesh.PointCloud)
    np.testing.assert_allclose(positions, frame.camera.unproject(frame.depth).reshape(-1, 3), atol=1e-5)
    colors = np.asarray(cloud.colors)[:, :3].reshape(48, 64, 3) / 255  # trimesh takes linear ones for its own
    np.testing.assert_allclose(colors[12, 16], srgb_to_linear(frame.color[24, 32] / 255), atol=0.004)
    np.testing.assert_allclose(colors[36, 48], srgb_to_linear(frame.color[72, 96] / 255), atol=0.004)


def test_sparse_depth_becomes_points(tmp_path):
    depth = np.zeros((48, 64))
    depth[::4, ::4] = 2
    save(tmp_path / "a.glb", ps.Frame(None, depth, CAMERA))
    assert isinstance(opened(tmp_path / "a.glb")[1], trimesh.PointCloud)


def test_a_frame_without_colours_is_light_grey(tmp_path):
    save(tmp_path / "a.gltf", tilted())
    (material,) = json.loads((tmp_path / "a.gltf").read_text())["materials"]
    base = material["pbrMetallicRoughness"]
    assert base["baseColorFactor"][:3] == pytest.approx([srgb_to_linear(204 / 255).item()] * 3)
    assert "baseColorTexture" not in base and base["metallicFactor"] == 0


def test_the_highlight_is_as_wide_and_as_bright_as_gltf_can(tmp_path):
    for specular, shininess, share in ((0, 32, 0), (0.05, 10, 0.8333), (0.3, 32, None)):
        save(tmp_path / "a.gltf", tilted(), material=ps.Material(specular=specular, shininess=shininess))
        data = json.loads((tmp_path / "a.gltf").read_text())
        (material,) = data["materials"]
        extension = material.get("extensions", {}).get("KHR_materials_specular", {})
        assert extension.get("specularFactor") == share
        assert ("KHR_materials_specular" in data.get("extensionsUsed", ())) == (share is not None)
        rough = material["pbrMetallicRoughness"]["roughnessFactor"]
        assert rough**4 == pytest.approx(2 / (shininess + 2), abs=1e-3)


def test_several_frames_have_a_mesh_each_and_share_the_vertices_that_an_object_may_have(tmp_path, monkeypatch):
    monkeypatch.setattr(fallbacks, "MOST_POINTS", 48 * 64 // 2)
    frames = [tilted(checked(48, 64)), tilted(checked(48, 64), pose=transform(0.2, 1, (1, 0, 0)))]
    save(tmp_path / "a.glb", frames)
    scene = trimesh.load_scene(tmp_path / "a.glb")
    parts = [geometry.vertices.shape[0] for geometry in scene.geometry.values()]
    assert parts == [24 * 32, 24 * 32]
    centres = [scene.graph[name][0][:3, 3] for name in scene.graph.nodes_geometry]
    assert sorted(round(float(x), 6) for x, *_ in centres) == [0, 1]


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
@pytest.mark.parametrize("fallback", ["mesh", "points", None])
@pytest.mark.parametrize("pose", [FLIP, np.eye(4)], ids=["y up", "y down"])
def test_what_is_for_other_programs_is_left_out_when_it_is_read(tmp_path, suffix, fallback, pose):
    frames = [tilted(checked(48, 64)), tilted(checked(48, 64), pose=transform(0.2))]
    scene = save(tmp_path / f"a{suffix}", frames, pose=pose, fallback=fallback)
    again = ps.load_scene(tmp_path / f"a{suffix}", notes=refuse)
    assert [node.name for node in again.nodes] == ["thing"] and not again.nodes[0].children
    assert len(again.nodes[0].content.frames) == 2
    if fallback is None:
        assert not (tmp_path / "a.bin").exists()
    ps.save_scene(tmp_path / f"b{suffix}", ps.Scene((ps.Node(ps.PointObject(frames[0]), "one"),), pose=pose))
    one = ps.load_scene(tmp_path / f"b{suffix}", notes=refuse)
    assert_same(one, ps.Scene((ps.Node(ps.PointObject(frames[0]), "one"),), pose=pose))
    assert scene.points_known == again.points_known


def test_pictures_of_a_fallback_are_not_opened_by_us(tmp_path):
    save(tmp_path / "a.gltf", ps.load_frame("vase"))
    (tmp_path / "a.bin").unlink()
    (placed,) = ps.load_scene(tmp_path / "a.gltf", notes=refuse).placed()
    assert placed.content.points_known == 93_207


def test_a_fallback_whose_object_is_gone_is_a_mesh(tmp_path):
    """Another program, or a person, may take the property away."""
    save(tmp_path / "a.gltf", tilted(checked(48, 64)))
    data = json.loads((tmp_path / "a.gltf").read_text())
    del data["nodes"][0]["extras"]
    (tmp_path / "a.gltf").write_text(json.dumps(data))
    (placed,) = ps.load_scene(tmp_path / "a.gltf", notes=refuse).placed()
    assert isinstance(placed.content, ps.Mesh) and len(placed.content.positions) == 48 * 64


def test_a_fallback_is_drawn_where_the_objects_files_are_missing(tmp_path):
    """A .glb is sent alone, without the folders beside it."""
    save(tmp_path / "a.glb", tilted(checked(48, 64)), fallback="mesh")
    (tmp_path / "b").mkdir()
    (tmp_path / "a.glb").rename(tmp_path / "b" / "a.glb")
    notes = []
    (placed,) = ps.load_scene(tmp_path / "b" / "a.glb", notes=notes.append).placed()
    assert isinstance(placed.content, ps.Mesh) and placed.content.texture is not None
    (note,) = notes
    assert note.startswith("node 'thing': 'a_glb_thing' does not exist in ") and "other programs see" in note
    save(tmp_path / "c.glb", tilted(), fallback=None)
    (tmp_path / "c_glb_thing" / "depth.npy").unlink()
    with pytest.raises(OSError, match="thing"):
        ps.load_scene(tmp_path / "c.glb")


def test_hidden_objects_have_no_fallback(tmp_path):
    hidden = ps.Node(None, "group", children=(ps.Node(ps.PointObject(tilted()), "in it"),), visible=False)
    alone = ps.Node(ps.PointObject(tilted()), "alone", visible=False)
    ps.save_scene(tmp_path / "a.gltf", ps.Scene((hidden, alone)))
    assert "meshes" not in json.loads((tmp_path / "a.gltf").read_text())


def test_a_picture_of_colours_is_written_once(tmp_path):
    frame = tilted(checked(48, 64))
    nodes = [ps.Node(ps.PointObject(frame), "a"), ps.Node(ps.PointObject(frame.at(transform(1))), "b")]
    ps.save_scene(tmp_path / "a.gltf", ps.Scene(tuple(nodes)))
    data = json.loads((tmp_path / "a.gltf").read_text())
    assert data["images"] == [{"uri": "a_a/color.png"}] and len(data["meshes"]) == 1


@pytest.mark.parametrize("value", ["triangles", 3, True])
def test_an_unknown_fallback_is_refused(tmp_path, value):
    with pytest.raises((ValueError, TypeError), match="fallback"):
        ps.save_scene(tmp_path / "a.glb", ps.Scene(), fallback=value)


def test_a_frame_without_depth_is_still_refused(tmp_path):
    with pytest.raises(ValueError, match="no known depth"):
        save(tmp_path / "a.glb", all_missing())
