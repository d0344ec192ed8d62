"""Compares the functions of splat_projection.glsl with their mirrors, and these with what `render` projects."""

import numpy as np
import pytest

from pointshade_gl.estimation.splat_projection import SplatView, project_splats
from pointshade_gl.page.parts import rotation_bytes
from pointshade_gl.scene.camera import Eye, rotation_of, view_matrix
from pointshade_gl.scene.gaussians import harmonics_at

from ..reference import splat_projection as mirror
from ..support.trained_splats import ball_over_floor, looking_down

F = np.float32
COUNT = 400
FOCAL, SIZE = np.array([300, -280, 60, 50], F), np.array([120, 90], F)


@pytest.fixture
def rng():
    return np.random.default_rng(4)


def matrix(values, name="s"):
    """The inputs that are columns of matrices, and the matrix in GLSL."""
    return {f"{name}{k}": values[..., k].astype(F) for k in range(3)}, f"mat3({name}0, {name}1, {name}2)"


def test_rotations_are_unpacked(gpu, rng):
    turns = rng.normal(size=(COUNT, 4)).astype(F)
    stored = rotation_bytes(turns).astype(F) / F(255)
    answer = gpu("splat_projection.glsl", "unpack_rotation(s)", s=stored)
    np.testing.assert_allclose(answer, mirror.unpack_rotation(stored), atol=1e-6)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    same = np.abs((answer * turns).sum(1))
    assert np.degrees(2 * np.arccos(same.clip(0, 1))).max() < 0.2


def test_axes_of_quaternions(gpu, rng):
    turns = rng.normal(size=(COUNT, 4)).astype(F)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    expected = mirror.quaternion_axes(turns)
    for k in range(3):
        answer = gpu("splat_projection.glsl", f"quaternion_axes(q)[{k}], 0", q=turns)[:, :3]
        np.testing.assert_allclose(answer, expected[..., k], atol=1e-6)
    np.testing.assert_allclose(expected, rotation_of(turns.astype(float)), atol=1e-5)


def test_ways_of_a_picture(gpu, rng):
    seen = np.concatenate([rng.uniform(-1, 1, (COUNT, 2)), rng.uniform(0.5, 3, (COUNT, 1))], 1).astype(F)
    expected = mirror.picture_ways(seen, FOCAL, SIZE)
    for k in range(3):
        call = f"picture_ways(p, f, s)[{k}], 0"
        answer = gpu("splat_projection.glsl", call, p=seen, f=FOCAL[None], s=SIZE[None])[:, :3]
        np.testing.assert_allclose(answer, expected[..., k], rtol=1e-5, atol=1e-5)


def test_ellipses_and_slopes(gpu, rng):
    spread = rng.normal(0, 3, (COUNT, 3, 3)).astype(F)
    inputs, name = matrix(spread)
    opacity = rng.uniform(0, 1, (COUNT, 1)).astype(F)
    for is_kept in (True, False):
        call = f"seen_ellipse({name}, o, {str(is_kept).lower()})"
        answer = gpu("splat_projection.glsl", call, o=opacity, **inputs)
        np.testing.assert_allclose(answer, mirror.seen_ellipse(spread, opacity[:, 0], is_kept), rtol=2e-3, atol=1e-4)
    answer = gpu("splat_projection.glsl", f"depth_slope({name}), 0, 0", **inputs)[:, :2]
    expected = mirror.depth_slope(spread)
    tame = np.abs(expected).max(1) < 20  # what is seen from its edge has any slope
    assert tame.sum() > 0.9 * COUNT
    np.testing.assert_allclose(answer[tame], expected[tame], rtol=5e-3, atol=1e-3)


def test_normals_face_the_viewer(gpu, rng):
    normal, seen = rng.normal(size=(2, COUNT, 3)).astype(F)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    answer = gpu("splat_projection.glsl", "facing_viewer(n, p), 0", n=normal, p=seen)[:, :3]
    np.testing.assert_allclose(answer, mirror.facing_viewer(normal, seen), atol=1e-6)


@pytest.mark.parametrize("count", [0, 3, 8, 15])
def test_colours_change_with_the_direction(gpu, rng, count):
    stored = (rng.integers(0, 256, (4, 64, 4)) / 255).astype(F)
    way = rng.normal(size=(COUNT, 3))
    way = (way / np.linalg.norm(way, axis=1, keepdims=True)).astype(F)
    first = np.stack([16 * rng.integers(0, 4, COUNT), rng.integers(0, 4, COUNT)], -1)
    call = f"shine_towards(stored_map, ivec2(f + 0.5), {count}, 1.5, w), 0"
    answer = gpu("splat_projection.glsl", call, stored_map=stored, f=first.astype(F), w=way)[:, :3]
    np.testing.assert_allclose(answer, mirror.shine_towards(stored, first, count, 1.5, way), atol=1e-4)
    if count:
        ones = np.full((1, 16, 4), 255 / 255, F)
        found = mirror.shine_towards(ones, np.zeros((COUNT, 2), int), count, 1.0, way)[:, 0]
        np.testing.assert_allclose(found, harmonics_at({3: 1, 8: 2, 15: 3}[count], way.T).sum(0), atol=1e-4)


@pytest.mark.parametrize("antialiased", [False, True])
def test_together_they_are_what_render_projects(antialiased):
    cloud = ball_over_floor(300, antialiased=antialiased)
    camera, pose = looking_down(away=6.0)
    held, view = cloud.gaussians, view_matrix(np.eye(4), pose)
    seen = (cloud.positions @ view[:3, :3].T + view[:3, 3]).astype(F)
    turns = held.rotations / np.linalg.norm(held.rotations, axis=1, keepdims=True)
    arms = view[:3, :3].astype(F) @ (mirror.quaternion_axes(turns) * held.scales[:, None])
    focal = np.array(camera.intrinsics, F)
    ways = mirror.picture_ways(seen, focal, np.array([camera.width, camera.height], F))
    spread = arms.transpose(0, 2, 1) @ ways
    ellipse = mirror.seen_ellipse(spread, held.opacities, np.full(len(cloud), antialiased))
    normals = np.tile(np.array([[0, -1, 0]], F), (len(cloud), 1))
    own = SplatView(cloud, view[:3, :3], view[:3, 3], normals)
    rows = project_splats([own], Eye(camera, pose, 0.01), 0.0)
    shown = np.argsort(-seen[:, 2], kind="stable")
    assert len(rows) == len(cloud)
    np.testing.assert_allclose(rows[:, 2:5], ellipse[shown, :3], rtol=2e-3, atol=1e-3)
    np.testing.assert_allclose(rows[:, 9], ellipse[shown, 3], rtol=2e-3, atol=1e-4)
    facing = mirror.facing_viewer(normals @ view[:3, :3].T.astype(F), seen)
    np.testing.assert_allclose(rows[:, 10:13], facing[shown], atol=1e-5)
    slope = mirror.depth_slope(spread)[shown]
    assert (np.abs(rows[:, 13:] - slope).max(1) < 1e-3 + 0.02 * np.abs(slope).max(1)).mean() > 0.97
