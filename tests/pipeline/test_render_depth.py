"""Depth as drawn: that of the frame at its own camera, and that of the surface from anywhere else."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames
from ..support.drivers import need_compute


@pytest.fixture(params=["compute", "points"])
def drawing(request, renderer):
    """A renderer for each rasteriser."""
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes, frames.step, frames.single_pixel])
def test_at_its_own_camera_it_is_the_depth_of_the_frame(drawing, make):
    frame = make()
    depth = drawing.render_depth(frame)
    assert depth.dtype == np.float32 and depth.shape == frame.depth.shape
    np.testing.assert_array_equal(depth > 0, frame.depth > 0)
    np.testing.assert_allclose(depth, frame.depth, rtol=2e-5)  # splats are merged to within 1e-5


def test_from_another_view_it_is_the_depth_of_the_surface(drawing):
    """A plane n.(P - P0) = 0, whose depth along each ray is known."""
    frame = frames.tilted_plane()
    pose = ps.orbit_pose(None, frame.pivot, yaw=20, pitch=-8, dolly=0.1)
    camera = frame.camera.fitted(200, 100)
    depth = drawing.render_depth(frame, camera, pose)
    assert depth.shape == (100, 200)
    v, u = np.mgrid[0:100, 0:200]
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones((100, 200))], -1)
    normal, place = pose[:3, :3].T @ (0.5, 0.2, -1), pose[:3, :3].T @ ((0, 0, 1.5) - pose[:3, 3])
    truth = normal @ place / (rays @ normal)
    seen = depth > 0
    assert 0.5 < seen.mean() < 1
    assert np.median(np.abs(depth[seen] / truth[seen] - 1)) < 1e-5
    assert np.abs(depth[seen] / truth[seen] - 1).max() < 1e-3  # the normals at the frame's rim are estimates


def test_it_covers_what_the_picture_covers(drawing):
    frame = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, frame.pivot, yaw=25, pitch=10)
    picture, depth = drawing.render(frame, pose=pose), drawing.render_depth(frame, pose=pose)
    np.testing.assert_array_equal(depth > 0, picture[..., 3] > 0)
    np.testing.assert_array_equal(drawing.render(frame, pose=pose), picture)


def test_noisy_depth_is_smoothed_as_it_is_drawn(renderer):
    clean, noisy = frames.sphere_before_wall(), frames.noisy()
    known = clean.depth > 0
    smoothed = np.abs(renderer.render_depth(noisy) - clean.depth)[known].mean()
    assert smoothed < 0.5 * np.abs(noisy.depth - clean.depth)[known].mean()
    raw = renderer.render_depth(noisy, normals="star")
    np.testing.assert_allclose(raw[known], noisy.depth[known], rtol=2e-5)


def test_the_nearest_thing_of_a_scene_is_seen(renderer):
    """A wall of points at 2 m at half its size, that is 1 m away, before a mesh at 1.5 m that is lit at its corners."""
    wall = ps.Frame(None, np.full((40, 40), 2, np.float32), ps.Camera(40, 40, 19.5, 19.5, 40, 40))
    corners = [(-2, -2, 1.5), (2, -2, 1.5), (2, 2, 1.5), (-2, 2, 1.5)]
    mesh = ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=(0.5, 0.5, 0.5), shading="gouraud")
    half = np.diag([0.5, 0.5, 0.5, 1])
    camera = ps.Camera(40, 40, 39.5, 39.5, 80, 80)
    scene = ps.Scene((ps.Node(ps.PointObject(wall), transform=half), ps.Node(mesh)), camera=camera)
    depth = renderer.render_depth(scene, pose=np.eye(4))
    np.testing.assert_allclose(depth[22:58, 22:58], 1, rtol=1e-5)
    np.testing.assert_allclose(depth[:15], 1.5, rtol=1e-5)
    assert ps.render_depth(scene, pose=np.diag([1, -1, -1, 1])).max() == 0


def test_sizes_and_shapes_of_splats_count(renderer):
    frame = frames.single_pixel()
    assert (renderer.render_depth(frame, point_size=9, splat="round") > 0).sum() > 60
    assert not renderer.render_depth(frame, point_size=0).any()


def test_wrong_arguments_are_refused(renderer):
    with pytest.raises(
        TypeError, match="frame must be a Frame, a sequence of frames, a Scene, a PointCloud or a path, got 7"
    ):
        renderer.render_depth(7)
    with pytest.raises(TypeError, match="camera must be a Camera"):
        renderer.render_depth(frames.sphere(), camera=(640, 480))
    scene = ps.Scene((ps.Node(ps.PointObject(frames.sphere())),), frames.CAMERA)
    with pytest.raises(ValueError, match="the objects of a scene have a look of their own: leave out normals"):
        renderer.render_depth(scene, normals="star")


class TestNormals:
    def test_a_plane_has_one_normal_in_the_axes_of_who_looks(self, renderer):
        frame, pose = frames.tilted_plane(), ps.orbit_pose(None, (0, 0, 1.5), 20, 5)
        single = renderer.estimate_normals(frame)[60, 80]
        for content in (ps.PointObject(frame), ps.PointObject([frame, frame])):
            normals = renderer.render_normals(ps.Scene((ps.Node(content),), frame.camera, pose))
            known = np.isfinite(normals).all(-1)
            assert known.mean() > 0.5 and np.abs(normals[known] - single @ pose[:3, :3]).max() < 0.01

    def test_where_nothing_is_to_be_lit_there_is_none(self, renderer):
        node = ps.Node(ps.PointObject(frames.holes(), shading="none"))
        assert np.isnan(renderer.render_normals(ps.Scene((node,)))).all()
        assert np.isnan(renderer.render_normals(ps.Scene())).all()

    def test_of_a_clean_frame_they_are_those_of_its_pixels_and_turn_with_the_view(self, renderer):
        frame = frames.sphere()
        np.testing.assert_allclose(renderer.render_normals(frame), renderer.estimate_normals(frame), atol=1e-3)
        scene = ps.Scene((ps.Node(ps.PointObject(frame)),), frame.camera, ps.orbit_pose(None, frame.pivot, 20))
        np.testing.assert_array_equal(renderer.render_normals(frame, yaw=20), renderer.render_normals(scene))
        small = renderer.render_normals(frame, frame.camera.resized(40, 30), normals="central")
        assert small.shape == (30, 40, 3) and np.nanmax(abs(np.linalg.norm(small, axis=-1) - 1)) < 1e-5
        with pytest.raises(TypeError, match="frame must be a Frame, a sequence of frames, a Scene"):
            renderer.render_normals(7)
