"""Pictures of scenes, compared with the CPU mirror and stored ones, for each kind of light with its shadow."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.appearance import SHADINGS
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.visible import looking_distance

from ..reference.render import render as mirror_render
from ..support import frames
from ..support.compare import compare_images

SPOT = ps.Light(position=(-0.5, -0.7, 0), direction=(0.5, 0.8, 1.6), cone=(15, 30), color=(1, 0.8, 0.6), shadow=True)
LIGHTS = {
    "sun": [ps.Light(direction=(0.6, 0.5, 1), shadow=True)],
    "spot": [SPOT],
    "point": [ps.Light(position=(-0.6, -0.5, 0.4), shadow=True)],
    "all": [SPOT, ps.Light(position=(0.5, -0.2, 0), intensity=0.4), ps.Light(direction=(-0.4, 0.3, 1), shadow=True)],
}


def test_a_mesh_covers_the_same_pixels_in_every_shading(renderer):
    corners = np.array([(-0.51, -0.42, 1.2), (0.53, -0.35, 1.3), (0.1, 0.47, 1.1)])
    alpha = {}
    for shading in SHADINGS:
        mesh = ps.Mesh(corners, [(0, 1, 2)], shading=shading)
        alpha[shading] = renderer.render(ps.Scene((ps.Node(mesh),), camera=frames.CAMERA))[..., 3]
        assert (alpha[shading] == alpha["none"]).all() and 0.1 < (alpha[shading] > 0).mean() < 0.9


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.system) if name == "point" else name for name in LIGHTS]
)
def test_a_light_and_its_shadow(renderer, golden, name):
    """The object shades itself; the view is turned, so that objects do not hide their shadows."""
    check_shadow(renderer, golden, name)


def test_a_light_whose_shadow_has_six_small_views(renderer, golden, monkeypatch):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 256)
    check_shadow(renderer, golden, "point", stored=False)


def check_shadow(renderer, golden, name, stored=True):
    """Against the mirror, and the stored picture where there is one."""
    frame = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, frame.pivot, 12, 4)
    content = ps.PointObject(frame, normals="triangles-8", max_depth_step="5%")
    scene = ps.Scene((ps.Node(content),), camera=frames.CAMERA, pose=pose)
    actual = renderer.render(scene, LIGHTS[name])
    normals = np.nan_to_num(renderer.estimate_normals(frame, "triangles-8", max_depth_step="5%"))
    eye = Eye.at_distance(frames.CAMERA, pose, looking_distance(scene, pose))
    kind = "compute" if renderer.context.gl.version_code >= 430 else "points"
    mirror = mirror_render(frame, normals, LIGHTS[name], ps.Appearance(), eye, kind)
    golden(f"shadow_{name}", actual, mirror, stored=stored and kind == "compute")
    unshaded = renderer.render(scene, [ps.Light(**{**vars(light), "shadow": False}) for light in LIGHTS[name]])
    assert compare_images(actual, unshaded)


def test_a_scene_of_one_frame_is_the_frame(renderer):
    """Equal bit for bit, for every shading model that lights pixels, on both ways through the passes."""
    frame = frames.sphere()
    for shading in SHADINGS:
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


@pytest.mark.parametrize("far", [10, 300, 3000])
def test_one_stray_pixel_leaves_the_shadows_where_they_are(renderer, far):
    frame = ps.load_frame("vase")
    depth = frame.depth.copy()
    depth[300, 320] = far
    light = ps.Light(position=(-0.6, -0.7, 0.1), shadow=True)
    pose = ps.orbit_pose(None, frame.pivot, 20, 10)
    plain, spoilt = (
        renderer.render(ps.Frame(frame.color, d, frame.camera), light, pose=pose).astype(int)
        for d in (frame.depth, depth)
    )
    assert (np.abs(plain - spoilt).max(-1) > 16).mean() <= 0.001


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e30, 1e300])
def test_directions_of_any_length_light_the_same(renderer, scale):
    frame = frames.sphere_before_wall()
    for cone in ({}, {"position": (-0.5, -0.5, 0), "cone": (20, 40)}):
        direction = np.array((0.5, 0.5, 1.0))
        usual, extreme = (
            renderer.render(frame, ps.Light(direction=tuple(d), shadow=True, **cone))
            for d in (direction, direction * scale)
        )
        assert usual.any() and np.abs(usual.astype(int) - extreme).max() <= 1


def test_more_lights_than_a_texture_has_rows_are_refused(renderer):
    limit = renderer.context.limits()["largest texture"]
    with pytest.raises(ValueError, match=f"{limit + 1} lights are too many"):
        renderer.render(frames.single_pixel(), [ps.Light(position=(0, 0, 0))] * (limit + 1))
    assert renderer.render(frames.sphere()).any()


def test_a_texture_of_a_mesh_that_is_too_large_is_named(renderer):
    limit = renderer.context.limits()["largest texture"]
    corners = [(-1, -1, 2), (1, -1, 2), (0, 1, 2)]
    texture = np.zeros((1, limit + 1, 3), np.uint8)
    mesh = ps.Mesh(corners, [(0, 1, 2)], uv=[(0, 0), (1, 0), (0, 1)], texture=texture)
    with pytest.raises(ValueError, match="larger than this GPU's textures"):
        renderer.render(ps.Scene((ps.Node(mesh),), camera=frames.CAMERA))
    assert renderer.render(frames.sphere()).any()
