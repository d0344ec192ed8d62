"""completion.glsl and its relatives: each function is compared with its mirror, then the whole pass."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.stereo_shadows import find_shifts, hidden_below
from pointshade_gl.scene.appearance import Appearance

from ..reference import completion, completion_cells, completion_pixels, completion_rays
from ..reference.completion_pass import completed_planes, completed_surface, places
from ..reference.inverse_depth import pixel_grid
from ..reference.normals_star import estimate_star
from ..reference.rim_marks import mark_rim
from ..support import frames
from ..support.pattern_shadow import shadow
from .test_rim_functions import close

F = np.float32
COUNT, SIZE = 400, np.array([46, 35])  # the last cells of rows and columns are cut off
K = np.array([40.0, 41.0, 22.5, 17.0], F)
SAME = {"SAME_SIZE": 1, "HIDDEN": 1}
TIES = 0.005  # share of elections that the last bit of a vote may decide otherwise
MAPS = "n_map, o_map, c_map"


@pytest.fixture
def rng():
    return np.random.default_rng(6)


def surface(rng):
    """Two tilted layers, 1.5 m and 2 m away, with holes of many sizes, also at the border; with rims marked."""
    u, v = np.meshgrid(*map(np.arange, SIZE))
    depth = np.where(u + 2 * v < 60, 1 / (0.66 + 0.002 * u), 1 / (0.5 + 0.001 * v))
    depth[(rng.random(depth.shape) < 0.1) | (np.hypot(u - 20, v - 18) < 9) | (u + v > 66) | (u < 6) & (v < 8)] = 0
    depth[rng.random(depth.shape) < 0.03] *= 1.2
    grid, depth = pixel_grid(depth.astype(F)), depth.astype(F)
    normals = estimate_star(depth, grid, K, 0.0)[..., :3]
    return np.concatenate([normals, mark_rim(depth, grid, K)[..., None]], -1).astype(F)


def picture(rng, size=SIZE):
    """Each layer has its colours, and a corner none; steps of 1/255, so that both sides round alike."""
    u, v = (np.meshgrid(*map(np.arange, size)) + np.array(0.5)) / np.reshape(size, (2, 1, 1)) * SIZE.reshape(2, 1, 1)
    color = np.where((u + 2 * v < 60)[..., None], (0.7, 0.4, 0.2, 1), (0.3, 0.4, 0.6, 1))
    color = color + rng.uniform(-0.1, 0.1, color.shape)
    color[..., 3] = u + v < 76
    return (np.round(255 * color) / 255).astype(F)


def limits(rng):
    """From which 1/z on surfaces would have been seen: nowhere, and in a block."""
    hidden = np.zeros(SIZE[::-1], F)
    hidden[10:30, 12:30] = 0.6 + 0.05 * rng.random((20, 18))
    return hidden


def some_candidates(rng, count=16):
    """Planes near three values of 1/z, with votes or without."""
    candidates = rng.normal(0, 1e-3, (COUNT, count, 4)).astype(F)
    candidates[..., 0] = rng.choice([0.4, 0.5, 0.51, 0.8], (COUNT, count)) * rng.uniform(0.99, 1.01, (COUNT, count))
    candidates[..., 3] = rng.random((COUNT, count)) * (rng.random((COUNT, count)) < 0.6)
    candidates[:3, :, 3] = 0
    return candidates


def with_candidates(gpu, expression, candidates, **inputs):
    before = "for (int k = 0; k < CANDIDATES; ++k) candidates[k] = texelFetch(k_map, ivec2(k, int(row)), 0);"
    inputs |= {"row": np.arange(COUNT)[:, None], "k_map": candidates, "CANDIDATES": candidates.shape[1]}
    return gpu("completion.glsl", expression, before=before, **inputs, **SAME)


def one(gpu, expression, **inputs):
    return gpu("completion.glsl", expression, **inputs, CANDIDATES=1, **SAME)


def test_agrees_and_supporters_of(gpu, rng):
    candidates, w = some_candidates(rng), rng.uniform(0.39, 0.82, (COUNT, 1)).astype(F)
    expected = completion.agrees(candidates[:, 0, 0], w[:, 0])
    close(one(gpu, "agrees(a, w) ? 1 : 0, 0, 0, 0", a=candidates[:, 0, :1], w=w), expected)
    assert 0.02 < expected.mean() < 0.5
    expected = completion.supporters_of(candidates, w[:, 0])
    close(with_candidates(gpu, "supporters_of(w)", candidates, w=w), expected, missed=TIES)
    assert 0.1 < (expected[:, 3] > 0).mean() < 0.9


@pytest.mark.parametrize("count", [1, 16, 64])
def test_elect_and_elected(gpu, rng, count):
    candidates = some_candidates(rng, count)
    w = completion.elect(candidates)
    close(with_candidates(gpu, "elect(), 0, 0, 0", candidates), w, missed=TIES)
    close(with_candidates(gpu, "elected(elect())", candidates), completion.elected(candidates, w), missed=TIES)
    assert (w[:3] == 0).all() and (count == 1 or len(np.unique(np.round(w, 1))) > 3)


def test_most_votes_win_and_not_the_strongest_one():
    planes = [(0.5, 0, 0, 0.5), (0.8, 0, 0, 0.3), (0.805, 0, 0, 0.3), (0.4, 0, 0, 0.4)]
    candidates = np.array([planes], F)
    w = completion.elect(candidates)
    assert w == F(0.8)
    np.testing.assert_allclose(completion.elected(candidates, w), [[0.8025, 0, 0, 0.4]], rtol=1e-6)


def test_planes_and_candidates(gpu, rng):
    cell, plane = rng.integers(0, 50, (COUNT, 2)), some_candidates(rng)[:, 0]
    plane[:50, 0] *= -1
    off, hidden = rng.normal(0, 30, (COUNT, 2)).astype(F), rng.choice([0, 0.45, 0.9], (COUNT, 1)).astype(F)
    close(one(gpu, "cell_middle(ivec2(c)), 0, 0", c=cell), completion.cell_middle(cell))
    close(one(gpu, "moved_plane(p.xyz, o), 0", p=plane, o=off), completion.moved_plane(plane[:, :3], off))
    expected = completion.candidate_of(plane[:, :3], plane[:, 3], hidden[:, 0])
    close(one(gpu, "candidate_of(p.xyz, p.w, h)", p=plane, h=hidden), expected)
    assert (expected[:50, 3] == 0).all() and 0.1 < (expected[:, 3] == plane[:, 3]).mean() < 0.9


def test_the_planes_of_neighbours_meet_where_they_are_moved():
    plane = np.array([[0.5, 0.01, -0.02]], F)
    off = completion.cell_middle(np.array([[3, 5]])) - completion.cell_middle(np.array([[2, 7]]))
    np.testing.assert_array_equal(off, [[completion.SIDE, -2 * completion.SIDE]])
    np.testing.assert_allclose(completion.moved_plane(plane, off), [[0.7, 0.01, -0.02]], rtol=1e-6)


def test_colours(gpu, rng):
    color = rng.random((COUNT, 3)).astype(F)
    color[:2] = [[0, 0, 0], [1, 1, 1]]
    packed = completion.pack_color(color)
    np.testing.assert_array_equal(one(gpu, "pack_color(c), 0, 0, 0", c=color)[:, 0], packed)
    close(one(gpu, "unpack_color(n), 0", n=packed[:, None]), completion.unpack_color(packed), atol=1e-6)
    assert np.abs(completion.unpack_color(packed) - color).max() <= 0.501 / 255
    close(one(gpu, "color_vote(c.r), 0, 0, 0", c=color), completion.color_vote(color[:, 0]))
    close(one(gpu, "proven_share(c.r), 0, 0, 0", c=color), completion.proven_share(color[:, 0]))


@pytest.mark.parametrize("large", [SIZE, 2 * SIZE, SIZE // 2, (101, 61), (1, 1)])
def test_guide_at(gpu, rng, large):
    color, pixel = picture(rng, large), places(SIZE)[::4]
    same = {"SAME_SIZE": int(tuple(large) == tuple(SIZE)), "CANDIDATES": 1}
    answer = gpu("completion.glsl", "guide_at(p_map, ivec2(p), ivec2(s))", p_map=color, p=pixel, s=SIZE[None], **same)
    expected = completion.guide_at(color, pixel, SIZE)
    close(answer, expected)
    assert tuple(large) == (1, 1) or 0 < (expected[:, 3] == 0).mean() < 0.3


def test_hidden_below_at(gpu, rng):
    for hidden, size in ((limits(rng), SIZE), (limits(rng), 3 * SIZE), (np.zeros((1, 1), F), SIZE)):
        pixel = places(size)[:: len(places(size)) // COUNT]
        expected = completion.hidden_below_at(hidden, pixel, size)
        answer = one(gpu, "hidden_below_at(h_map, ivec2(p), ivec2(s)), 0, 0, 0", h_map=hidden, p=pixel, s=size[None])
        close(answer, expected)
        assert hidden.size == 1 or 0.1 < (expected > 0).mean() < 0.9


@pytest.mark.parametrize("large", [SIZE, 2 * SIZE])
def test_join_points(gpu, rng, large):
    surface_map, color_map, cell = surface(rng), picture(rng, large), places(-(-SIZE // completion.SIDE))
    same = {"SAME_SIZE": int(tuple(large) == tuple(SIZE))}
    expected = completion_cells.join_points(surface_map, color_map, cell, K)
    call = "join_points(s_map, p_map, ivec2(c), k)"
    inputs = {"s_map": surface_map, "p_map": color_map, "c": cell, "k": K[None], **same}
    for layer in (0, 1):
        answer = gpu("completion_cells.glsl", f"{call}.planes[{layer}]", **inputs)
        close(answer, expected.planes[layer], missed=TIES)
    answer = gpu("completion_cells.glsl", f"{call}.colors", **inputs)
    np.testing.assert_array_equal(answer[:, 3], expected.colors[:, 3])
    shown = zip(answer[:, :3].T, expected.colors[:, :3].T, strict=True)
    off = [np.abs(completion.unpack_color(a) - completion.unpack_color(b)).max(-1) for a, b in shown]
    assert (np.max(off, 0) > 1.01 / 255).mean() <= TIES  # one step where a mean lies between two
    known = surface_map[..., 3] != 0
    assert 0 < (expected.planes[0][:, 3] == 0).mean() < 0.3 and 0.1 < (expected.planes[1][:, 3] > 0).mean() < 0.9
    assert expected.planes[0][:, 3].sum() + expected.planes[1][:, 3].sum() > 0.95 * known.sum()


def test_ray_direction(gpu):
    rays = np.arange(16)
    directions = np.array([completion_rays.ray_direction(ray) for ray in rays])
    answer = gpu("completion_rays.glsl", "ray_direction(int(r)), 0, 0", r=rays[:, None], **SAME)
    np.testing.assert_array_equal(answer[:, :2], directions)
    angles = np.degrees(np.arctan2(directions[:, 1], directions[:, 0])) % 360
    assert (np.diff(angles) > 15).all() and np.abs(directions).max(1).tolist() == [1] * 16
    np.testing.assert_array_equal(directions[8:], -directions[:8])


def test_cell_hidden_below(gpu, rng):
    surface_map, hidden, cell = surface(rng), limits(rng), places(-(-SIZE // completion.SIDE))
    expected = completion_rays.cell_hidden_below(surface_map, hidden, cell)
    call = "cell_hidden_below(s_map, h_map, ivec2(c)), 0, 0, 0"
    close(gpu("completion_rays.glsl", call, s_map=surface_map, h_map=hidden, c=cell, **SAME), expected)
    assert 0.05 < (expected > 0).mean() < 0.9


def cells_of(rng):
    """The maps of the cells of a surface, as they are kept for the rays."""
    n_map, o_map, c_map, plane_map = completed_planes(surface(rng), picture(rng), K, limits(rng))
    return {"n_map": n_map, "o_map": o_map, "c_map": c_map}, plane_map


def test_has_points(gpu, rng):
    cells = np.where(rng.random((35, 46, 1)) < 0.02, F(1), F(0)) * np.ones(4, F)
    block = places(-(-SIZE // completion_rays.BLOCK))
    expected = completion_rays.has_points(cells, block)
    found = gpu("completion_rays.glsl", "float(has_points(n_map, ivec2(b))), 0, 0, 0", n_map=cells, b=block, **SAME)
    np.testing.assert_array_equal(found[:, 0], expected)
    assert 0.2 < expected.mean() < 0.95


def test_steps_inside(gpu):
    cell = places(np.array([2, 2]) * completion_rays.BLOCK)
    for ray in range(completion_rays.RAYS):
        direction = completion_rays.ray_direction(ray)
        expected = completion_rays.steps_inside(cell, direction)
        call = f"float(steps_inside(ivec2(c), ray_direction({ray}))), 0, 0, 0"
        np.testing.assert_array_equal(gpu("completion_rays.glsl", call, c=cell, **SAME)[:, 0], expected)
        for steps in range(completion_rays.BLOCK):  # all these are in the same block
            there = completion_rays.cell_on_ray(cell, direction, np.full((1, 1), steps, F))
            apart = (there // completion_rays.BLOCK != cell // completion_rays.BLOCK).any(1)
            assert not (apart & (steps <= expected)).any()


@pytest.mark.parametrize(
    ("share", "is_alone"),
    [
        *((1, True), (0.06, False), (0.06, True)),
        pytest.param(1, False, marks=pytest.mark.system),
    ],
)
def test_stops_of(gpu, rng, is_alone, share):
    """Blocks without points are jumped over: what is found is the same."""
    maps, _ = cells_of(rng)
    maps["n_map"][rng.random(maps["n_map"].shape[:2]) > share] = 0
    size = np.array(maps["c_map"].shape[1::-1])
    cell, blocks = places(size), -(-size // completion_rays.BLOCK)
    points = completion_rays.has_points(maps["n_map"], places(blocks)).reshape(*blocks[::-1], 1) * np.ones(4, F)
    for ray in range(completion_rays.RAYS):
        direction = completion_rays.ray_direction(ray)
        expected = completion_rays.stops_of(maps["n_map"], maps["c_map"], cell, direction, is_alone)
        call = f"stops_of(n_map, c_map, b_map, ivec2(c), ray_direction({ray}), {str(is_alone).lower()}), 0, 0"
        inputs = {"n_map": maps["n_map"], "c_map": maps["c_map"], "b_map": points, "c": cell}
        found = gpu("completion_rays.glsl", call, **inputs, **SAME)
        np.testing.assert_array_equal(found[:, :2], expected)
        assert (expected > 0).any()


@pytest.mark.parametrize("is_alone", [False, True])
def test_cast_rays(gpu, rng, is_alone):
    maps, _ = cells_of(rng)
    cell = places(np.array(maps["c_map"].shape[1::-1]))
    hidden = rng.choice([0, 0.6], (len(cell), 1)).astype(F)
    maps["s_map"] = completion_rays.stops_map_of(maps["n_map"], maps["c_map"], is_alone)
    planes, evidence = completion_rays.cast_rays(*maps.values(), cell, hidden[:, 0], is_alone)
    call, before = f"cast_rays({MAPS}, s_map, ivec2(c), h, {str(is_alone).lower()}, e)", "vec2 e;"
    inputs = {**maps, "c": cell, "h": hidden, **SAME}
    close(gpu("completion_rays.glsl", call, before=before, **inputs), planes, missed=2 * TIES)
    before = f"vec2 e; vec4 found = {call};"
    close(gpu("completion_rays.glsl", "e, 0, 0", before=before, **inputs), evidence, missed=2 * TIES)
    assert 0.2 < (planes[:, 3] > 0).mean() < 1 and 0.01 < evidence[:, 1].mean() < 0.99


def test_settle_cell(gpu, rng):
    _, plane_map = cells_of(rng)
    shape, cell = plane_map.shape[:2], places(np.array(plane_map.shape[1::-1]))
    evidence = np.zeros((*shape, 4), F)
    evidence[..., 1] = rng.random(shape) < 0.5
    evidence[..., 0] = np.where(np.arange(shape[1]) < 6, 0.02, 0.3) * rng.random(shape)
    expected = completion_rays.settle_cell(plane_map, evidence, cell)
    inputs = {"s_map": plane_map, "e_map": evidence, "c": cell}
    close(gpu("completion_rays.glsl", "settle_cell(s_map, e_map, ivec2(c))", **inputs, **SAME), expected)
    assert 0 < (expected[:, 3] > 0).sum() < (plane_map[..., 3] > 0).sum()


def test_complete_pixel(gpu, rng):
    maps, plane_map = cells_of(rng)
    pixel, color = places(SIZE)[::3], rng.uniform(0.2, 0.7, (len(places(SIZE)[::3]), 3)).astype(F)
    hidden = rng.choice([0, 0.6], (len(pixel), 1)).astype(F)
    expected = completion_pixels.complete_pixel(*maps.values(), plane_map, pixel, color, hidden[:, 0], K)
    call = f"complete_pixel({MAPS}, s_map, ivec2(p), c, h, k)"
    inputs = {**maps, "s_map": plane_map, "p": pixel, "c": color, "h": hidden, "k": K[None], **SAME}
    close(gpu("completion_pixels.glsl", call, **inputs), expected, missed=2 * TIES)
    some = expected[:, 3] > 0
    assert 0.1 < some.mean() < 0.99
    np.testing.assert_allclose(np.linalg.norm(expected[some, :3], axis=1), 1, rtol=1e-5)


@pytest.mark.parametrize("beyond", [0.0, 9.0])
def test_join_completed(gpu, rng, beyond):
    surface_map, pixel = surface(rng), places(SIZE)
    missing = surface_map[..., 3] == 0
    completed = np.zeros_like(surface_map)
    chosen = missing & (rng.random(missing.shape) < 0.6)
    completed[chosen] = 0, 0, -1, 1.7
    depth = np.where(chosen, F(1.7), np.where(missing, F(beyond), np.abs(surface_map[..., 3])))
    expected = completion_pixels.join_completed(surface_map, completed, pixel, K, beyond)
    call = f"join_completed(s_map, c_map, ivec2(p), k, {beyond})"
    inputs = {"s_map": surface_map, "c_map": completed, "p": pixel, "k": K[None], **SAME}
    close(gpu("completion_pixels.glsl", call, **inputs), expected)
    known = ~missing.ravel()
    np.testing.assert_array_equal(expected[known, :3], surface_map.reshape(-1, 4)[known, :3])
    np.testing.assert_array_equal(np.abs(expected[:, 3]), depth.ravel())


def surfaces(renderer, frame, **look):
    """The surface of a frame's points as measured, and as completed: (h, w, 4) each."""
    with renderer._in_use():
        store = renderer._pipeline.gpu_scene.frames
        (textures,) = store.upload([frame])
        points = store.find_points(textures, frame, Appearance(**look), frame.camera)
        shape = (*frame.depth.shape, 4)
        found = points.surface, store.complete(textures, frame, points).surface
        return [np.frombuffer(one.texture.read(), F).reshape(shape) for one in found]


def with_shadow():
    """The sphere before its wall with the shadow of a pattern, a few patches, and a corner that colours cut out."""
    frame = frames.sphere_before_wall()
    lost = shadow(frame.depth, 131 * 0.09) | (np.random.default_rng(4).random(frame.depth.shape) < 0.02)
    lost[10:40, 100:130] = lost[100:, :30] = lost[50:70, 75:95] = True
    color = np.concatenate([frame.color, np.full((120, 160, 1), 255, np.uint8)], -1)
    color[110:, :20, 3] = 0
    return ps.Frame(color, np.where(lost, 0, frame.depth), frame.camera)


@pytest.mark.parametrize("size", [1, 2])
def test_the_pass_agrees_with_its_mirror(renderer, size):
    """Up to elections that end otherwise at a tie, of a cell or of a pixel."""
    frame = with_shadow()
    color = frame.color.repeat(size, 0).repeat(size, 1)
    measured, completed = surfaces(renderer, ps.Frame(color, frame.depth, frame.camera))
    shifts = find_shifts(frame.depth, frame.camera.fx)
    assert any(shifts)
    k = np.array(frame.camera.intrinsics, F)
    expected = completed_surface(measured, color.astype(F) / 255, k, hidden_below(frame.depth, shifts))
    missing = measured[..., 3] == 0
    np.testing.assert_array_equal(completed[..., 3] == 0, expected[..., 3] == 0)
    np.testing.assert_array_equal(completed[~missing, :3], measured[~missing, :3])
    np.testing.assert_array_equal(np.abs(completed[~missing, 3]), np.abs(measured[~missing, 3]))
    off = np.abs(np.abs(completed) - np.abs(expected)).max(-1) > 1e-4
    assert off[missing].mean() <= TIES and not off[~missing].any()
    assert (np.sign(completed[..., 3]) != np.sign(expected[..., 3])).mean() <= TIES
    assert 0.8 < (expected[missing, 3] != 0).mean() < 1


@pytest.mark.parametrize("is_alone", [False, True])
def test_an_object_that_was_cut_out_agrees_with_its_mirror(renderer, is_alone):
    frame = frames.sphere() if is_alone else frames.sphere_before_wall()
    lost = np.random.default_rng(4).random(frame.depth.shape) < 0.02
    lost[50:62, 75:90] = lost[:12] = True
    frame = ps.Frame(frame.color, np.where(lost, 0, frame.depth), frame.camera)
    measured, completed = surfaces(renderer, frame)
    k = np.array(frame.camera.intrinsics, F)
    expected = completed_surface(measured, frame.color.astype(F) / 255, k, is_alone=is_alone)
    missing = measured[..., 3] == 0
    off = np.abs(np.abs(completed) - np.abs(expected)).max(-1) > 1e-4
    assert off[missing].mean() <= TIES and not off[~missing].any()
    assert (expected[50:62, 75:90, 3] != 0).all()
