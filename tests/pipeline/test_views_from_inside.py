"""Views from inside a room, some of them a hand's breadth from a wall: pictures against ray-traced truth."""

from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, encode, plane, trace

from ..benchmarks.traced_light import co_visible
from ..support.drivers import need_compute

SOURCE = ps.Camera(262, 262, 159.5, 119.5, 320, 240)
CAMERA = ps.Camera(131, 131, 79.5, 59.5, 160, 120)
LOW, HIGH = np.array((-2.0, -1.3, -1.0)), np.array((2.0, 1.3, 6.0))  # of the room, metres
CLOSEST = 0.05  # to a wall
STEPS = 24  # of 255 by which a colour may be off: colours change by 100 steps a metre at most


def paint(points):
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return 0.5 + 0.3 * np.stack([np.sin(2 * x + 1.1 * z), np.sin(2.2 * y - 1.7 * x), np.cos(1.9 * z - 1.3 * y)], -1)


def room():
    """Its six walls; the camera stands inside, and sees the farther part."""
    return [plane(sign * axis, wall, paint) for sign, wall in ((1, LOW), (-1, HIGH)) for axis in np.eye(3)]


def random_pose(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose = np.eye(4)
    pose[:3, :3] = turn * np.sign(np.linalg.det(turn))
    pose[:3, 3] = rng.uniform(LOW + CLOSEST, HIGH - CLOSEST)
    return pose


@pytest.fixture(scope="module")
def source():
    return trace(room(), SOURCE)


@cache
def views(each):
    """2 * each: the pose, the colours there (h, w, 3), and the pixels that show what the frame's camera saw."""
    made, source = [], trace(room(), SOURCE)
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        for _ in range(each):
            pose = random_pose(rng)
            hits = trace(room(), CAMERA, pose)
            made.append((pose, encode(hits.albedo), co_visible(hits, source, SOURCE, np.eye(4))))
    return made


@pytest.mark.parametrize("each", [20, pytest.param(100, marks=pytest.mark.system)])
@pytest.mark.parametrize("rasterizer", ["compute", "points"])
def test_views_from_inside_a_room_show_the_room(renderer, rasterizer, source, each):
    """What is drawn has the colour of the wall that is there, and what the camera saw is drawn."""
    if rasterizer == "compute":
        need_compute(renderer)
    frame, wrong = as_frame(source, SOURCE), []
    with ps.Renderer(rasterizer=rasterizer) as made:
        for pose, colors, seen in views(each):
            image = made.render(frame, pose=pose, camera=CAMERA, shading="none")
            drawn = image[..., 3] > 0
            off = np.abs(image[..., :3] - colors).max(-1) > STEPS
            wrong.append(((drawn & off) | (seen & ~drawn)).mean())
    assert (np.array(wrong) > 0.01).mean() <= 0.01
    assert max(wrong) <= 0.04


def test_a_splat_that_fills_a_large_view_is_drawn_whole(renderer):
    """One pixel of the frame covers 600x400 of the view: more than one thread may walk through."""
    frame = ps.Frame(np.full((3, 3, 3), 200, np.uint8), np.ones((3, 3)), ps.Camera(2, 2, 1, 1, 3, 3))
    view = ps.Camera(1200, 1200, 399.5, 299.5, 800, 600)
    image = renderer.render(frame, camera=view, shading="none", normals=np.full((3, 3, 3), (0, 0, -1.0)))
    assert (image[100:500, 100:700, 3] == 255).all()
