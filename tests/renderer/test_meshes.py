"""The surface of frames as textured meshes: the same picture, cut at depth edges, in files that others read."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.triangles import frame_surface

from ..support import frames
from ..support.posed_views import corner, views

trimesh = pytest.importorskip("trimesh")
LIGHT = ps.Light(direction=(0.5, 0.5, 0.7))
LONG = 0.5  # metres: no triangle of the frames here has such a side, and all depth edges are larger


def decibels(a, b):
    return 10 * np.log10(255**2 / np.square(a.astype(float) - b).mean())


def sides(positions, faces):
    corners = np.asarray(positions)[np.asarray(faces)]
    return np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1)


@pytest.mark.parametrize("shading", ["phong", "none"])
def test_from_the_frames_camera_the_mesh_is_the_picture_of_the_frame(renderer, shading):
    frame = frames.sphere_before_wall()
    lit = renderer.render(frame, LIGHT, shading=shading)
    seen = renderer.render(renderer.render_mesh(frame, LIGHT, shading=shading))
    assert ((seen[..., 3] > 0) == (lit[..., 3] > 0)).all()  # each pixel keeps its whole square
    assert decibels(seen, lit) > 50


def test_from_beside_it_is_near_the_picture_of_the_frame(renderer):
    frame = frames.sphere_before_wall()
    pose = ps.orbit_pose(frame.pose, frame.pivot, 10)
    mesh = renderer.render_mesh(frame, LIGHT, ps.Material(specular=0))
    seen, expected = renderer.render(mesh, pose=pose), renderer.render(frame, LIGHT, ps.Material(specular=0), pose=pose)
    both = (seen[..., 3] > 0) & (expected[..., 3] > 0)
    assert both.mean() > 0.95 * (expected[..., 3] > 0).mean()
    assert decibels(seen[both], expected[both]) > 30


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_others_and_we_read_a_mesh_with_a_texture_and_no_triangle_across_an_edge(renderer, tmp_path, suffix):
    frame = frames.sphere_before_wall()
    made = renderer.render_mesh(frame, LIGHT)
    ps.save_scene(tmp_path / f"a{suffix}", made)
    (mesh,) = trimesh.load_scene(tmp_path / f"a{suffix}").geometry.values()
    assert len(mesh.faces) == len(made.nodes[0].content.faces) > 1.9 * frame.points_known
    assert sides(mesh.vertices, mesh.faces).max() < LONG
    assert mesh.visual.material.baseColorTexture.size == (frame.camera.width, frame.camera.height)
    back = ps.load_scene(tmp_path / f"a{suffix}")
    assert isinstance(back.instances[0].content, ps.Mesh)
    np.testing.assert_array_equal(renderer.render(back), renderer.render(made))


def test_a_frame_that_stands_elsewhere_is_a_mesh_in_the_world_that_faces_its_camera(renderer):
    frame = frames.sphere().at(ps.orbit_pose(None, (1, 0, 5), 30, 20))
    mesh = renderer.render_mesh(frame).nodes[0].content
    cloud = renderer.render_points(frame)
    assert np.abs(mesh.positions.mean(0) - cloud.positions.mean(0)).max() < 0.05
    a, b, c = np.moveaxis(mesh.positions[mesh.faces].astype(float), 1, 0)
    outward = np.cross(b - a, c - a)
    assert ((outward * (a - frame.pose[:3, 3])).sum(1) < 0).mean() > 0.99
    assert ((outward * mesh.normals[mesh.faces[:, 0]]).sum(1) > 0).mean() > 0.99


def test_colours_larger_than_the_depth_stay_as_fine(renderer):
    depth = np.full((24, 32), 2, np.float32)
    color = np.random.default_rng(1).integers(0, 255, (96, 128, 3), np.uint8)
    frame = ps.Frame(color, depth, ps.Camera(30, 30, 15.5, 11.5, 32, 24))
    (node,) = renderer.render_mesh(frame, shading="none").nodes
    np.testing.assert_array_equal(node.content.texture, color)


def test_each_of_several_frames_has_a_mesh_of_what_it_shows_best(renderer):
    several = views(corner(), 3)
    alone, merged = (renderer.render_mesh(one, shading="none") for one in (several[0], several))
    count = sum(len(node.content.faces) for node in merged.nodes)
    assert len(merged.nodes) == 3 and count < 2 * len(alone.nodes[0].content.faces)
    seen, expected = (renderer.render(one, pose=several[1].pose) for one in (merged, several))
    assert (seen[..., 3] > 0).mean() > 0.97 * (expected[..., 3] > 0).mean()  # no seam gapes


def test_lone_pixels_are_squares_and_nothing_is_no_mesh(renderer, tmp_path):
    depth = np.zeros((6, 8), np.float32)
    depth[2, 3] = depth[4, 6] = 2
    frame = ps.Frame(None, depth, ps.Camera(10, 10, 3.5, 2.5, 8, 6))
    surface = frame_surface(frame, 10**6, whole=True)
    assert len(surface.faces) == 2 * 2 * 4 and not len(frame_surface(frame, 10**6).faces)
    ps.save_scene(tmp_path / "a.glb", renderer.render_mesh(frames.all_missing()))
    assert not ps.load_scene(tmp_path / "a.glb").instances


def test_the_squares_of_pixels_go_on_as_their_surface_does():
    camera = ps.Camera(100, 100, 31.5, 23.5, 64, 48)
    depth = 2 / (camera.rays() @ (0.5, 0.2, 1))
    depth[20:30, 20:40] = 0
    surface = frame_surface(ps.Frame(None, depth, camera), 10**6, whole=True)
    x, y, z = surface.positions.T.astype(float)
    np.testing.assert_allclose(0.5 * x - 0.2 * y - z, 2, atol=1e-4)  # the axes of a glTF camera
    assert surface.uv.min() == 0 and surface.uv.max() == 1  # up to the borders of the picture
    a, b, c = np.moveaxis(surface.uv[surface.faces].astype(float) * (64, 48), 1, 0)
    areas = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert areas.sum() == pytest.approx(64 * 48 - 200, rel=1e-4)  # pixels: none twice, none left out
