"""Compares the functions of shaders/common/grid.glsl with their mirror, on random arguments."""

import numpy as np
import pytest

from pointshade_gl.reference import grid
from pointshade_gl.reference.camera import pixel_ray
from pointshade_gl.reference.splat import inverse_depth_slope

F = np.float32
COUNT = 500
K = np.array([520.0, -480.0, 310.0, 250.0], F)
OFFSETS = np.array([(0, 0), (1, 0), (0, 1), (1, 1)], F)
STEPS = [(0.0, 0.0), (0.02, 0.0), (0.0, 0.01)]


@pytest.fixture
def corners():
    """Pixels, and four surfaces at each: on a plane, some a little off it, some far, some missing."""
    rng = np.random.default_rng(5)
    pixel = np.floor(rng.uniform(20, 600, (COUNT, 2))).astype(F)
    ray = pixel_ray(pixel, K)
    normal = rng.normal(size=(COUNT, 3)).astype(F) - ray
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    z = rng.uniform(0.5, 3, COUNT).astype(F)
    slope = inverse_depth_slope(normal, ray, z, K)
    off = rng.choice([0, 0.01, 0.05, 0.5], (4, COUNT), p=[0.5, 0.2, 0.2, 0.1]) * rng.normal(size=(4, COUNT))
    found = []
    for shift, share in zip(OFFSETS, off, strict=True):
        depth = 1 / np.maximum((1 / z + slope @ shift) * (1 + share), 0.05)
        depth[rng.random(COUNT) < 0.1] = 0
        found.append(np.concatenate([normal, depth[:, None]], -1).astype(F))
    return pixel, found


def step_of(step):
    return f"vec2({step[0]}, {step[1]})", np.array(step, F)


@pytest.mark.parametrize("step", STEPS)
def test_is_joined(gpu, corners, step):
    (pixel, (a, b, *_)), (text, values) = corners, step_of(step)
    call = f"is_joined(a, b, p, vec2(1.0, 0.0), k, {text}) ? 1.0 : 0.0"
    answer = gpu("grid.glsl", call, a=a, b=b, p=pixel, k=K[None])[:, 0] > 0
    mirror = grid.is_joined(a, b, pixel, OFFSETS[1], K, values)
    assert (answer == mirror).all() and 0.2 < mirror.mean() < 0.9


@pytest.mark.parametrize("step", STEPS)
def test_square_triangles(gpu, corners, step):
    (pixel, (a, b, c, d)), (text, values) = corners, step_of(step)
    call = f"float(square_triangles(a, b, c, d, p, k, {text}))"
    answer = gpu("grid.glsl", call, a=a, b=b, c=c, d=d, p=pixel, k=K[None])[:, 0]
    mirror = grid.square_triangles(a, b, c, d, pixel, K, values)
    assert (answer == mirror).all()
    assert {0, 1, 2, 3, 5, 6} <= set(mirror) <= {0, 1, 2, 3, 5, 6, 7}


def test_a_square_without_one_corner_is_the_triangle_of_the_others():
    facing = np.array((0, 0, -1, 2), F)
    for missing in range(4):
        corners = [np.where(k == missing, 0, facing)[None].astype(F) for k in range(4)]
        code = grid.square_triangles(*corners, np.full((1, 2), 300, F), np.abs(K), np.zeros(2, F))
        triangles = [[tuple(grid.vertex_corner(code, k)[0]) for k in order] for order in ((0, 1, 2), (3, 2, 1))]
        (whole,) = [set(corners) for corners in triangles if len(set(corners)) == 3]  # the other one has no area
        assert whole == {tuple(OFFSETS[k]) for k in range(4) if k != missing}


def test_vertex_corner(gpu):
    code, vertex = (x.ravel().astype(F)[:, None] for x in np.meshgrid(np.arange(8), np.arange(4)))
    answer = gpu("grid.glsl", "vec2(vertex_corner(int(c), int(n))), 0.0, 0.0", c=code, n=vertex)
    mirror = grid.vertex_corner(code[:, 0].astype(int), vertex[:, 0].astype(int))
    assert (answer[:, :2] == mirror).all()


def test_triangle_normal(gpu):
    rng = np.random.default_rng(8)
    p, q, r = (rng.normal((0, 0, 2), 0.2, (COUNT, 3)).astype(F) for _ in range(3))
    q[::10], r[::20] = p[::10], p[::20]  # without area
    mirror = grid.triangle_normal(p, q, r)
    np.testing.assert_allclose(
        gpu("grid.glsl", "triangle_normal(p, q, r), 0.0", p=p, q=q, r=r)[:, :3], mirror, atol=2e-5
    )
    assert ((mirror * p).sum(-1) <= 1e-6).all()
    np.testing.assert_allclose(np.linalg.norm(mirror, axis=1), 1, rtol=1e-5)


def test_triangle_position(gpu):
    at, whole = np.random.default_rng(9).uniform(0, 40, (COUNT, 2)).astype(F), np.arange(COUNT) % 2 == 0
    answer = gpu("grid.glsl", "triangle_position(p, h > 0.5), 0.0, 0.0", p=at, h=whole[:, None])
    assert (answer[:, :2] == grid.triangle_position(at, whole)).all()
