"""Pictures of scenes, compared with the CPU mirror and stored ones, for each kind of light with its shadow."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.camera import Eye
from pointshade_gl.culling import near_plane
from pointshade_gl.reference.render import render as mirror_render

from . import frames
from .compare import compare_images

SPOT = ps.Light(position=(-0.5, -0.7, 0), direction=(0.5, 0.8, 1.6), cone=(15, 30), color=(1, 0.8, 0.6), shadow=True)
LIGHTS = {
    "sun": [ps.Light(direction=(0.6, 0.5, 1), shadow=True)],
    "spot": [SPOT],
    "point": [ps.Light(position=(-0.6, -0.5, 0.4), shadow=True)],
    "all": [SPOT, ps.Light(position=(0.5, -0.2, 0), intensity=0.4), ps.Light(direction=(-0.4, 0.3, 1), shadow=True)],
}


@pytest.mark.parametrize("name", LIGHTS)
def test_a_light_and_its_shadow(renderer, golden, name):
    """The object shades itself; the view is turned, so that objects do not hide their shadows."""
    if renderer.context.gl.version_code < 430:
        pytest.skip("the compute rasteriser needs OpenGL 4.3")
    frame = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, frame.pivot, 12, 4)
    content = ps.PointObject(frame, normals="triangles-8", max_depth_step="5%")
    scene = ps.Scene((ps.Node(content),), camera=frames.CAMERA, pose=pose)
    actual = renderer.render(scene, LIGHTS[name])
    normals = np.nan_to_num(renderer.estimate_normals(frame, "triangles-8", max_depth_step="5%"))
    eye = Eye(frames.CAMERA, pose, near_plane(scene, pose))
    mirror = mirror_render(frame, normals, LIGHTS[name], ps.Look(), eye, "compute")
    golden(f"shadow_{name}", actual, mirror)
    unshaded = renderer.render(scene, [ps.Light(**{**vars(light), "shadow": False}) for light in LIGHTS[name]])
    assert compare_images(actual, unshaded)


def test_a_scene_of_one_frame_is_the_frame(renderer):
    """Equal bit for bit, for every shading model that lights pixels, on both ways through the passes."""
    frame = frames.sphere()
    for shading in ("none", "flat", "gouraud", "phong"):
        content = ps.PointObject(frame, shading=shading, material=ps.Material(specular=0.6))
        scene = ps.Scene((ps.Node(content),), camera=frames.CAMERA, pose=ps.orbit_pose(None, (0, 0, 1), 9))
        alone = renderer.render(frame, material=content.look.material, shading=shading, pose=scene.pose)
        assert np.abs(renderer.render(scene).astype(int) - alone).max() <= 1


def test_scale_and_place_of_a_node_are_those_of_a_scaled_frame(renderer):
    """An object twice as large and twice as far looks the same, if the light moves with it."""
    frame, light = frames.sphere(), ps.Light(position=(-1, -1, 0))
    expected = renderer.render(ps.Scene((ps.Node(ps.PointObject(frame)),), camera=frames.CAMERA), light)
    large = ps.Scene((ps.Node(ps.PointObject(frame), transform=np.diag([2.0, 2, 2, 1])),), camera=frames.CAMERA)
    image = renderer.render(large, ps.Light(position=(-2, -2, 0)))
    assert not compare_images(image, expected)


def test_meshes_and_points_hide_each_other(renderer):
    """A board through the ball: in front of it on one side, behind it on the other."""
    frame = frames.sphere()
    board = ps.Mesh([(-1, -0.05, 0.2), (1, -0.05, 1.8), (1, 0.05, 1.8), (-1, 0.05, 0.2)], [(0, 1, 2), (0, 2, 3)],
                    color=(1, 0, 0), shading="none")  # fmt: skip
    nodes = (ps.Node(ps.PointObject(frame, shading="none")), ps.Node(board))
    image = renderer.render(ps.Scene(nodes, camera=frames.CAMERA))
    row = (image[60, :, 0] == 255) & (image[60, :, 1] == 0)
    known = frame.depth[60] > 0
    u = np.arange(160)
    ray = (u - frames.CAMERA.cx) / frames.CAMERA.fx
    board_z = 1.0 / (1 - 0.8 * ray)  # of the line z = 1 + 0.8 x
    in_front = known & (board_z < frame.depth[60] - 0.01)
    behind = known & (board_z > frame.depth[60] + 0.01)
    assert in_front.sum() > 5 and behind.sum() > 5
    assert row[in_front].all() and not row[behind].any()
