"""Pictures of point clouds, compared with the CPU mirror and stored ones; normals and sizes are given."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.clouds.cloud_planes import find_planes
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.visible import looking_distance

from ..reference.cloud_picture import Bordered
from ..reference.cloud_picture import render as mirror_render
from ..support import frames

SUN = ps.Light(direction=(0.6, 0.9, 0.7), shadow=True)
LAMP = ps.Light(position=(-0.4, -0.5, 0.6), color=(1, 0.8, 0.6), shadow=True)


def ball_on_floor(**look):
    """A ball over a floor, of random points; normals of the ball look in and out."""
    rng = np.random.default_rng(44)
    v = rng.normal(size=(500, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    floor = np.stack([rng.uniform(-0.5, 0.5, 400), np.full(400, 0.3), rng.uniform(0.7, 1.5, 400)], -1)
    normals = np.concatenate([v * rng.choice([-1, 1], (500, 1)), np.tile((0.0, -1, 0), (400, 1))])
    sizes = np.concatenate([np.full(500, 0.07), np.full(400, 0.09)]) * rng.uniform(0.9, 1.1, 900)
    positions = np.concatenate([0.22 * v + (0, 0, 1.1), floor])
    return ps.PointCloud(positions, normals, rng.integers(60, 255, (900, 3), np.uint8), sizes, **look)


def both(renderer, cloud, lights, **finish):
    """The picture by the renderer and by the mirror, seen from a little above."""
    pose = ps.orbit_pose(None, (0, 0.1, 1.1), 15, 12)
    scene = ps.Scene((ps.Node(cloud),), camera=frames.CAMERA, pose=pose)
    eye = Eye.at_distance(frames.CAMERA, pose, looking_distance(scene, pose))
    points = Bordered(cloud, borders(renderer, cloud))
    return renderer.render(scene, lights, **finish), mirror_render(points, lights, eye, ps.OutputSettings(**finish))


def borders(renderer, cloud):
    """In which direction the surface goes on at each point, (n, 3), as test_cloud_functions.py holds to its mirror."""
    with renderer.context.in_use():
        found = find_planes(renderer.context.gl, cloud.positions.astype(np.float32), cloud.normals)
    edges = np.zeros((len(cloud), 3), np.float32)
    edges[found.order] = found.details[:, :3].astype(np.float16)
    return edges


@pytest.mark.parametrize(
    ("name", "look", "lights"),
    [
        ("disc", {}, [ps.Light(position=(-1, -1, 0))]),
        ("disc_none", {"shading": "none"}, []),
        pytest.param("disc_shadow", {}, [SUN, LAMP], marks=pytest.mark.system),
        ("ball", {"splat": "ball", "point_size": 0.03}, [ps.Light(position=(-1, -1, 0))]),
        ("ball_shadow", {"splat": "ball", "point_size": "0.6x"}, [SUN]),
    ],
)
def test_a_cloud(renderer, golden, name, look, lights):
    actual, mirror = both(renderer, ball_on_floor(**look), lights)
    golden(f"cloud_{name}", actual, mirror, stored=name in ("disc_shadow", "ball_shadow"))


def test_discs_in_the_light_of_two_lamps_with_small_shadows(renderer, golden, monkeypatch):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 256)
    golden("cloud_disc_small_shadow", *both(renderer, ball_on_floor(), [SUN, LAMP]), stored=False)
