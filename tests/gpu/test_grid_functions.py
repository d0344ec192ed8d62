"""Compares the functions of shaders/common/grid.glsl with their mirror, on random arguments."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..reference import grid
from ..reference.camera import pixel_ray
from ..reference.splat import inverse_depth_slope

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
        which = grid.SECOND if code & grid.SECOND else grid.FIRST
        weights = [grid.triangle_weights(which + (code & grid.OTHER_DIAGONAL), at[None])[0] for at in OFFSETS]
        np.testing.assert_array_equal(np.argmax(weights, 1)[np.arange(4) != missing], np.delete(np.arange(4), missing))
        assert [bool(grid.covers_corner(code, k)[0]) for k in range(4)] == [k == 3 - missing for k in range(4)]


@pytest.fixture
def squares():
    """1/z of corners, some a little off a plane; which triangles there are."""
    rng = np.random.default_rng(6)
    w = 0.5 + 0.001 * rng.normal(size=(COUNT, 4)) * rng.choice([0.001, 0.1, 1], (COUNT, 1))
    w[rng.random((COUNT, 4)) < 0.1] = 0
    return w.astype(F), rng.choice([0, 1, 2, 3, 5, 6], COUNT)


def test_planes_pass_through_the_corners_of_their_triangles(gpu, squares):
    w, code = squares
    for is_second in (False, True):
        plane = grid.triangle_plane(w, code, np.full(COUNT, is_second))
        call = f"triangle_plane(w, int(c), {str(is_second).lower()}), 0.0"
        np.testing.assert_allclose(gpu("grid.glsl", call, w=w, c=code[:, None])[:, :3], plane, rtol=1e-6, atol=1e-7)
        triangle = np.where(is_second, 2, 1) + (code & grid.OTHER_DIAGONAL)
        for corner, at in enumerate(OFFSETS):
            its = grid.triangle_weights(triangle, np.broadcast_to(at, (COUNT, 2)))[:, corner] == 1
            there = plane @ np.array((*at, 1), F)
            np.testing.assert_allclose(there[its], w[its, corner], atol=2e-7)


def test_square_planes_and_pieces(gpu, squares):
    w, code = squares
    plane, pieces = grid.square_plane(w), grid.square_pieces(w, code)
    np.testing.assert_allclose(gpu("grid.glsl", "square_plane(w), 0.0", w=w)[:, :3], plane, rtol=1e-6, atol=1e-7)
    assert (gpu("grid.glsl", "float(square_pieces(w, int(c)))", w=w, c=code[:, None])[:, 0] == pieces).all()
    level = grid.is_level(w[:, 0], np.zeros((COUNT, 2), F), plane, F(500))
    call = "is_level(w.x, vec2(0.0), p, 500.0) ? 1.0 : 0.0"
    assert (gpu("grid.glsl", call, w=w, p=plane)[:, 0] == level).mean() > 0.998 and 0.1 < level.mean() < 0.9


def test_codes_give_back_what_they_were_made_of(gpu):
    code, hidden = np.arange(8).repeat(81), np.indices((3, 3, 3, 3)).reshape(4, -1).T
    reach = np.tile(hidden, (8, 1)).astype(F) + F(0.5)
    number = gpu("grid.glsl", "grid_code(int(c), r)", c=code[:, None], r=reach)[:, :1]
    assert (number[:, 0] == grid.grid_code(code, reach)).all()
    assert (gpu("grid.glsl", "code_reach(n)", n=number) == reach).all()
    assert (gpu("grid.glsl", "float(code_triangles(n))", n=number)[:, 0] == code).all()
    assert (grid.code_reach(number[:, 0]) == reach).all() and (grid.code_triangles(number[:, 0]) == code).all()


def turned_view():
    view = np.linalg.inv(ps.orbit_pose(None, (0, 0, 2), 25, 10)).astype(F)
    columns = ", ".join(str(float(x)) for x in view.T.ravel())
    return view, f"mat4({columns})"


def test_pieces_in_a_view(gpu):
    """1/z where they are seen, by a closed formula too: the plane's point on the ray."""
    rng, (view, text) = np.random.default_rng(7), turned_view()
    square = np.floor(rng.uniform(100, 500, (COUNT, 2))).astype(F)
    plane = np.stack([*rng.normal(0, 2e-4, (2, COUNT)), rng.uniform(0.4, 0.6, COUNT)], -1).astype(F)
    place = rng.uniform(-0.4, 1.4, (COUNT, 2)).astype(F)
    carried = grid.carry_plane(plane, square, K, view, K)
    at = (carried @ np.append(place, np.ones((COUNT, 1), F), 1)[..., None])[..., 0]
    q = (at[:, :2] / at[:, 2:]).astype(F)
    piece = grid.plane_piece(plane, np.ones(COUNT, F))
    mirror = grid.piece_inverse_depth(piece, grid.invert_carried(carried), q, 0.01)
    call = f"carry_plane(p, s, k, {text}, k)"
    found = gpu(
        "grid.glsl", f"piece_inverse_depth(plane_piece(p, 1.0), invert_carried({call}), q, 0.01)",
        p=plane, s=square, k=K[None], q=q,
    )[:, 0]  # fmt: skip
    inside, clear = (np.abs(place - 0.5) < 0.5).all(1), (np.abs(np.abs(place - 0.5) - 0.52) > 0.005).all(1)
    np.testing.assert_allclose(found[clear], mirror[clear], rtol=1e-4)
    ray = np.append((square + place - K[2:]) / K[:2], np.ones((COUNT, 1)), 1)
    z = 1 / ((plane[:, :2] * place).sum(1) + plane[:, 2])
    truth = 1 / ((ray * z[:, None]) @ view[2, :3] + view[2, 3])
    np.testing.assert_allclose(found[inside], truth[inside], rtol=1e-4)
    box = grid.piece_pixels(piece, carried, np.array((640, 480)), 0.01)
    calls = f"vec4(piece_pixels(plane_piece(p, 1.0), {call}, ivec2(640, 480), 0.01))"
    on_gpu = gpu("grid.glsl", calls, p=plane, s=square, k=K[None])
    assert (on_gpu == box).all(1).mean() > 0.99
    seen = inside & (box[:, 2] >= box[:, 0])
    assert ((q >= box[:, :2] - 1) & (q <= box[:, 2:] + 1))[seen].all() and seen.sum() > 100


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
