"""hidden_planes.glsl: each function is compared with its mirror, and its planes with those that were hidden."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import grey
from pointshade_gl.bench.tracing import as_frame, patch, plane, sphere, trace

from ..reference import hidden_planes as bridge
from ..reference.inverse_depth import pixel_grid
from ..reference.normals_star import estimate_star
from ..support import frames
from ..truth.measures import occluder
from .test_rim_functions import K, close

F = np.float32
BALL = sphere((0.03, 0, 1.2), 0.2, grey)
WALL, FLOOR = ((0.5, 0.2, -1), (0, 0, 2)), ((0, -1, -0.3), (0, 0.3, 2))  # normal, point


def surface_of(*things):
    """(h, w, 4) normals and depth; (n, 2) the pixels that the first thing covers."""
    hits = trace(things, frames.CAMERA)
    depth = hits.depth.astype(F)
    normals = estimate_star(depth, pixel_grid(depth), K, 0.0)[..., :3]
    return np.concatenate([normals, depth[..., None]], -1).astype(F), np.argwhere(hits.surface == 0)[:, ::-1]


def on_plane(normal, point, pixel):
    """The depth of a plane at pixels (n, 2)."""
    ray = np.column_stack([(pixel - K[2:]) / K[:2], np.ones(len(pixel))])
    return np.dot(point, normal) / (ray @ normal)


@pytest.fixture(scope="module")
def scene():
    """A ball before a slanted wall and a floor; pixels of the ball, and others."""
    surface_map, pixel = surface_of(BALL, plane(*WALL, grey), plane(*FLOOR, grey))
    others = np.random.default_rng(1).integers(0, surface_map.shape[1::-1], (200, 2))
    return surface_map, np.concatenate([pixel[::3], others])


@pytest.mark.parametrize("stride", [1, 2])
def test_find_sides(gpu, scene, stride):
    surface_map, pixel = scene
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    for x, y in ((-1, 0), (0, 1)):
        sides = bridge.find_sides(surface_map, pixel, np.array((x, y)), stride, K)
        call = f"find_sides(surface_map, ivec2(p), ivec2({x}, {y}), {stride}, k)"
        for layer, side in enumerate(sides):
            answer = gpu("hidden_planes.glsl", f"{call}[{layer}].inverse_depth, {call}[{layer}].normal", **inputs)
            close(answer, np.column_stack(side[:2]), missed=0.005, atol=1e-3)
            close(gpu("hidden_planes.glsl", f"{call}[{layer}].places, 0, 0, 0", **inputs), side.places, missed=0.005)
        assert 0.1 < (sides[0].places > 0).mean() < 0.95


def test_between(gpu):
    rng = np.random.default_rng(2)
    one, other = (
        bridge.Side(
            (rng.choice([0, 0.5, 0.505, 0.7], 300) * rng.uniform(0.999, 1.001, 300)).astype(F),
            bridge.normalize(rng.normal((0, 0, -2), 0.3, (300, 3)).astype(F)),
            rng.integers(1, 90, 300).astype(F),
        )
        for _ in range(2)
    )
    seen = rng.choice([0.52, 0.9], 300).astype(F)
    inputs = {"a": np.column_stack(one[:2]), "b": np.column_stack(other[:2]), "w": seen[:, None]}
    inputs["n"] = np.column_stack([one.places, other.places])
    found = bridge.between(one, other, seen)
    call = "between(Side(a.x, a.yzw, n.x), Side(b.x, b.yzw, n.y), w)"
    close(gpu("hidden_planes.glsl", call, **inputs), found, missed=0.005)
    assert 0.1 < (found[:, 3] > 0).mean() < 0.9


def test_bridge(gpu, scene):
    surface_map, pixel = scene
    found = bridge.bridge(surface_map, pixel, 2, K)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    close(gpu("hidden_planes.glsl", "bridge(surface_map, ivec2(p), 2, k)", **inputs), found, missed=0.01, atol=1e-3)
    assert 0.1 < (found[:, 3] > 0).mean() < 0.9


def test_hidden_at(gpu):
    surface_map, pixel = surface_of(BALL, plane((0, -1, -0.3), (0, 0.3, 1.4), grey))
    found = bridge.hidden_at(surface_map, pixel, 3, K)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    close(gpu("hidden_planes.glsl", "hidden_at(surface_map, ivec2(p), 3, k)", **inputs), found, missed=0.01, atol=1e-3)
    for way in ((1, 0), (0, -1)):
        outline = bridge.find_outline(surface_map, pixel, np.array(way), 3, K)
        answer = gpu("hidden_planes.glsl", f"find_outline(surface_map, ivec2(p), ivec2{way}, 3, k), 0", **inputs)
        close(answer[:, :3], outline, missed=0.01, atol=1e-3)
        assert 0.1 < (outline[:, 0] > 0).mean() <= 1


def test_a_ball_has_a_back_as_round_as_its_front():
    surface_map, pixel = surface_of(BALL)
    found = bridge.hidden_at(surface_map, pixel, 2, K)
    ray = np.column_stack([(pixel - K[2:]) / K[:2], np.ones(len(pixel))])
    has = found[:, 3] > 0
    off = np.abs(np.linalg.norm(ray * found[:, 3:] - (0.03, 0, 1.2), axis=-1) - 0.2)[has]
    assert has.mean() > 0.9 and np.quantile(off, 0.9) < 0.06 and off.max() < 0.12  # a pixel is .011 wide


def test_what_ends_sharply_has_no_back():
    surface_map, pixel = surface_of(patch((0, 0, 1.2), (0.2, 0, 0.1), (0, 0.2, 0), grey))
    assert not bridge.hidden_at(surface_map, pixel, 2, K).any()


@pytest.mark.parametrize("stride", [1, 3])
def test_the_plane_behind_a_ball_goes_on_where_its_formula_says(stride):
    surface_map, pixel = surface_of(BALL, plane(*WALL, grey))
    found = bridge.bridge(surface_map, pixel, stride, K)
    assert found[:, 3] == pytest.approx(on_plane(*WALL, pixel), rel=1e-3)
    normal = np.array(WALL[0]) / np.linalg.norm(WALL[0])
    assert (found[:, :3] @ normal > 0.9999).all()


def test_nothing_is_bridged_between_two_planes():
    """A near wall ends at a diagonal behind the ball: in the middle nothing is known; elsewhere it is what is there."""
    surface_map, pixel = surface_of(BALL, plane((0, 0, -1), (0, 0, 2.2), grey))
    v, u = np.indices(surface_map.shape[:2])
    middle = np.round(pixel.mean(0)).astype(int)
    is_far = (u - middle[0] + v - middle[1] > 0) & (surface_map[..., 3] > 2)
    surface_map[is_far, 3] = 3
    found = bridge.bridge(surface_map, pixel, 1, K)[:, 3]
    off = pixel - middle
    assert not found[np.abs(off).sum(-1) < np.abs(off).max() / 2].any()
    known, there = found > 0, np.where(off.sum(-1) > 0, 3, 2.2)
    assert known.mean() > 0.1 and found[known] == pytest.approx(there[known], rel=1e-3)


def test_nothing_is_bridged_where_nothing_is_hidden():
    surface_map, _ = surface_of(plane(*WALL, grey))
    pixel = np.stack(np.nonzero(surface_map[..., 3])[::-1], -1)
    assert not bridge.bridge(surface_map, pixel, 1, K).any()


@pytest.mark.parametrize("kind", ["auto", "points"])
def test_what_a_ball_hides_of_a_board_casts_its_shadow(kind):
    """The board's shadow on the wall has no hole where the ball stands before the board."""
    ball, board = sphere((0.1, 0, 1.2), 0.1, grey), patch((0, 0, 2), (0.5, 0, 0), (0, 0.4, 0), grey)
    hits = trace([ball, board, plane((0, 0, -1), (0, 0, 3), grey)], frames.CAMERA)
    sun = ps.Light(direction=(0.9, 0, 1), shadow=True)
    with ps.Renderer(rasterizer=kind) as made:
        lit = made.render(as_frame(hits, frames.CAMERA), light=sun)[..., 0] > 100
    shaded, by = occluder(hits, sun, [board])
    hidden = np.linalg.norm(by[..., :2] / by[..., 2:] - (0.1 / 1.2, 0), axis=-1) < 0.09 / 1.2
    on_wall = hits.surface == 2
    assert (shaded & hidden & on_wall).sum() > 30
    assert not lit[shaded & hidden & on_wall].any() and lit[~shaded & on_wall].mean() > 0.9
