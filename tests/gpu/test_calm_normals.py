"""Compares shaders/common/calm_normals.glsl with its mirror, and with what calm normals should be."""

import numpy as np
import pytest

from ..reference import calm_normals as mirror
from ..reference.camera import pixel_ray

F = np.float32
K = np.array([60.0, -62.0, 30.0, 20.0], F)
K_GLSL = "vec4(60.0, -62.0, 30.0, 20.0)"
WIDTH, HEIGHT, NOISE = 64, 48, 0.002
MAPS = "surface_map, witness_map"
SIDE = mirror.SIDE
V, U = np.mgrid[:HEIGHT, :WIDTH] / 1.0


def unit(array):
    return (array / np.linalg.norm(array, axis=-1, keepdims=True)).astype(F)


@pytest.fixture(scope="module")
def maps():
    """A bumpy wall with holes and a nearer board, whose normals are noisy; a photograph that shows both."""
    rng = np.random.default_rng(7)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    depth = 2 + 0.05 * np.sin(u / 9) * np.cos(v / 7)
    board = (v > 10) & (v < 30) & (u > 20) & (u < 40)
    depth[board] = 1.4
    depth[rng.random(depth.shape) < 0.05] = 0
    normals = unit(-pixel_ray(np.stack([u, v], -1).astype(F), K) + 0.3 * rng.normal(size=(HEIGHT, WIDTH, 3)))
    normals[0, :5] = 0  # lit already
    surface = np.concatenate([normals, np.where(u % 7 == 0, -depth, depth)[..., None]], -1).astype(F)
    luminance = np.where(board, -0.5, -1.5) + 0.03 * rng.normal(size=depth.shape)
    tilt = np.where(v > 36, mirror.WRONG_TILT, rng.uniform(0.03, 0.3, depth.shape)) * np.where(u > 50, -1, 1)
    chroma = np.where(board[..., None], (0.1, -0.2), 0) + 0.02 * rng.normal(size=(*depth.shape, 2))
    return {"surface_map": surface, "witness_map": witness_of(luminance, tilt, chroma)}


def witness_of(luminance, tilt, chroma=0.0):
    """As witness_map holds them, (h, w, 4)."""
    both = np.stack(np.broadcast_arrays(luminance, tilt), -1)
    return np.concatenate([both, np.broadcast_to(chroma, both.shape)], -1).astype(F)


def some(width=WIDTH, height=HEIGHT, count=300):
    rng = np.random.default_rng(8)
    return np.stack([rng.integers(0, width, count), rng.integers(0, height, count)], -1)


def of_facets(gpu, maps, expression, before="", **inputs):
    p = some()
    both = f"Facet a = facet_at({MAPS}, ivec2(p), 1.0, {K_GLSL}); Facet b = facet_at({MAPS}, ivec2(q), 1.0, {K_GLSL});"
    return gpu("calm_normals.glsl", expression, before=both + before, p=p, q=np.add(p, (1, 2)), **maps, **inputs)


@pytest.fixture
def pair(maps):
    p = some()
    return [mirror.facet_at(*maps.values(), place, 1, K) for place in (p, np.add(p, (1, 2)))]


def close(found, expected, atol=2e-5):
    np.testing.assert_allclose(found[:, : expected.shape[1]], expected, atol=atol, rtol=1e-4)


def test_facets_are_read_as_by_the_mirror(gpu, maps, pair):
    for name, facet in zip("ab", pair, strict=True):
        close(of_facets(gpu, maps, f"{name}.point, 0.0"), facet.point)
        close(of_facets(gpu, maps, f"{name}.color, 0.0"), facet.color)
        there = f"{name}.normal, float({name}.is_blind)"
        close(of_facets(gpu, maps, there), np.concatenate([facet.normal, facet.is_blind], -1).astype(F))
        parts = facet.tilt, mirror.is_facet(facet)
        found = of_facets(gpu, maps, f"{name}.tilt, float(is_facet({name})), 0.0, 0.0")
        close(found, np.concatenate(parts, -1).astype(F))


def test_strangeness_agrees_with_the_mirror(gpu, maps, pair):
    found = of_facets(gpu, maps, f"strangeness(a, b, {NOISE}, {K_GLSL}), 0, 0, 0")
    known = mirror.is_facet(pair[0])
    close(np.where(known, found[:, :1], 0), np.where(known, mirror.strangeness(*pair, NOISE, K), 0))


def test_a_witness_knows_darkness_and_doubt(gpu):
    rng = np.random.default_rng(3)
    color, certainty = rng.random((200, 3)).astype(F), rng.random((200, 1)).astype(F)
    measured = rng.integers(0, 2, (200, 1)).astype(F)
    color[:5] = 0
    found = gpu("calm_normals.glsl", "witness_of(c, t, m > 0.5)", c=color, t=certainty, m=measured)
    close(found, mirror.witness_of(color, certainty, measured > 0))


def test_cells_agree_with_the_mirror(gpu, maps):
    cells = some(-(-WIDTH // SIDE), -(-HEIGHT // SIDE))
    surface, joined = mirror.join_facets(*maps.values(), cells, NOISE, K)
    made = f"vec4 joined; vec4 facet = join_facets({MAPS}, ivec2(p), {NOISE}, {K_GLSL}, joined);"
    close(gpu("calm_normals.glsl", "facet", before=made, p=cells, **maps), surface, 1e-4)
    found = gpu("calm_normals.glsl", "joined", before=made, p=cells, **maps)
    known = surface[:, 3] > 0
    close(found[known], joined[known], 1e-4)


def test_a_cell_of_one_brightness_is_blind(maps):
    witness = maps["witness_map"].copy()
    witness[:SIDE, :SIDE] = -1.5, 0.1, 0, 0
    _, joined = mirror.join_facets(maps["surface_map"], witness, np.array([(0, 0), (2, 2)]), NOISE, K)
    assert joined[0, 1] < 0 < joined[1, 1]
    witness[:SIDE, :SIDE, 0] = mirror.witness_of(np.ones((1, 3), F), np.ones((1, 1), F), np.ones((1, 1), bool))[0, 0]
    assert mirror.join_facets(maps["surface_map"], witness, np.array([(0, 0)]), NOISE, K)[1][0, 1] > 0  # burnt


@pytest.mark.parametrize("is_shared", [True, False])
def test_levels_agree_with_the_mirror(gpu, maps, is_shared):
    cells = some()
    surface, left = mirror.calm_facet(*maps.values(), cells, 2, NOISE, K, is_shared)
    made = (
        f"vec4 left; vec4 facet = calm_facet({MAPS}, ivec2(p), 2, {NOISE}, {K_GLSL}, {str(is_shared).lower()}, left);"
    )
    close(gpu("calm_normals.glsl", "facet", before=made, p=cells, **maps), surface, 2e-4)
    close(gpu("calm_normals.glsl", "left", before=made, p=cells, **maps), left, 2e-4)


def test_normals_of_pixels_agree_with_the_mirror(gpu, maps):
    every = np.stack(np.meshgrid(np.arange(-(-WIDTH // SIDE)), np.arange(-(-HEIGHT // SIDE))), -1)
    cells = mirror.join_facets(*maps.values(), every.reshape(-1, 2), NOISE, K)
    others = [cell.reshape(*every.shape[:2], -1).astype(F) for cell in cells]
    p = some()
    expected = mirror.calm_normal(*maps.values(), *others, p, NOISE, 0.1, 0.2, K)
    call = f"calm_normal({MAPS}, other_map, joined_map, ivec2(p), {NOISE}, 0.1, 0.2, {K_GLSL}), 0"
    both = maps | {"other_map": others[0], "joined_map": others[1]}
    close(gpu("calm_normals.glsl", call, p=p, **both), expected, 1e-4)


def test_wrong_depth_takes_the_normals_beside_it_and_alone_stays_unsure():
    surface = np.broadcast_to(F([0, 0, -1, 2]), (HEIGHT, WIDTH, 4)).copy()
    surface[:, 32:] = [0.6, 0, -0.8, 3]  # another surface, farther away
    witness = witness_of(0 * V, np.where(np.arange(WIDTH) < 32, 0.02, 0.7))
    cells = np.array([(32, 20), (31, 20), (48, 20)])
    facets, left = mirror.calm_facet(surface, witness, cells, 1, NOISE, K, is_shared=False)
    np.testing.assert_allclose(facets[:2, :3], [[0, 0, -1]] * 2, atol=0.05)
    assert left[0, 1] < 0.1 and left[1, 1] < 0.03 and left[2, 1] > mirror.LEAST_WRONG


def patches(seed, *patterns):
    """A surface and a witness of cells (48, 64) that look alike; patterns: of the slopes of normals, radians."""
    rng = np.random.default_rng(seed)
    slopes = np.stack([*patterns, np.zeros((HEIGHT, WIDTH))], -1)
    normals = unit(np.array([0, 0, -1]) + slopes + 0.01 * rng.normal(size=slopes.shape))
    witness = witness_of(0.02 * rng.normal(size=(HEIGHT, WIDTH)), 0.06)
    return np.concatenate([normals, np.full((HEIGHT, WIDTH, 1), 2)], -1).astype(F), witness


def doubts_of(surface, witness):
    every = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).reshape(-1, 2)
    scatter = np.concatenate([mirror.scatter_at(surface, witness, every), mirror.behind_at(surface, every)], -1)
    scatter = scatter.reshape(HEIGHT, WIDTH, 2)
    return scatter, mirror.doubted_witness(witness, scatter, every).reshape(HEIGHT, WIDTH, 4)


def test_wide_areas_whose_normals_scatter_are_doubted_and_no_others():
    wild = np.random.default_rng(3).normal(0, 0.4, (2, HEIGHT, WIDTH)) * (U > 32)
    surface, witness = patches(1, *wild)
    tilt = doubts_of(surface, witness)[1][..., 1]
    assert (tilt[:, 40:] > 0.6).mean() > 0.95 and (tilt[:, :24] == witness[0, 0, 1]).all()
    witness[..., 1] = 0.01  # it is surely so
    assert (doubts_of(surface, witness)[1] == witness).all()


@pytest.mark.parametrize("slopes", [(U / 30, V / 30), (0.7 * (U > 30), 0 * V), (0.7 * (abs(U - 30) < 3), 0 * V)])
def test_bends_creases_and_thin_things_are_not_doubted(slopes):
    surface, witness = patches(2, *slopes)
    assert (doubts_of(surface, witness)[1] == witness).all()


def test_only_what_lies_behind_an_edge_is_behind_something():
    """Not the nearer side, not a slanted plane, however steep."""
    cells = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).reshape(-1, 2)
    inner = (abs(cells - (WIDTH / 2, HEIGHT / 2)) < (WIDTH / 2 - 4, HEIGHT / 2 - 4)).all(-1)
    board, slant = np.where(U < 30, 1.4, 2.0), 1 / (0.2 + 0.01 * U)
    behind, even = (mirror.behind_at(z[..., None].astype(F).repeat(4, -1), cells)[:, 0] for z in (board, slant))
    near = (cells[:, 0] >= 30) & (cells[:, 0] < 30 + mirror.BEHIND)
    assert (behind[inner & near] == 1).all() and (behind[inner & ~near] == 0).all() and (even[inner] == 0).all()


def test_colours_as_bright_as_each_other_are_told_apart():
    red, green, grey = (1, 0.2, 0.2), (0.2, 0.575, 0.2), (0.495, 0.495, 0.495)
    seen = [mirror.witness_of(F([color]), np.ones((1, 1), F), np.ones((1, 1), bool)) for color in (red, green, grey)]
    facets = [mirror.facet_at(F([[[0, 0, -1, 2]]]), one[None], np.zeros((1, 2), int), 1, K) for one in seen]
    assert all(abs(one[0, 0] - seen[2][0, 0]) < 0.05 for one in seen)
    assert all(mirror.strangeness(facets[2], facet, NOISE, K) > 3 for facet in facets[:2])


def test_what_looks_like_many_things_may_be_many():
    surface, witness = patches(4, *np.random.default_rng(3).normal(0, 0.4, (2, HEIGHT, WIDTH)))
    witness[..., 0] = np.random.default_rng(5).uniform(-3, 0, (HEIGHT, WIDTH))
    assert (doubts_of(surface, witness)[1][..., 1] > 0.6).mean() < 0.01


def test_doubts_agree_with_the_mirror(gpu):
    surface, witness = patches(6, *np.random.default_rng(3).normal(0, 0.4, (2, HEIGHT, WIDTH)) * (U > 20))
    surface[4:9, 30:40, 3] = 0
    surface[30:, 10:30, 3] = 1.8
    witness[20:, 40:] *= (1, -1, 1, 1)
    scatter, doubted = doubts_of(surface, witness)
    cells = some()
    maps = {"surface_map": surface, "witness_map": witness}
    call = f"scatter_at({MAPS}, ivec2(p)), behind_at(surface_map, ivec2(p)), 0, 0"
    close(gpu("calm_normals.glsl", call, p=cells, **maps), mirror.texel(scatter, cells), 1e-4)
    maps = {"witness_map": witness, "scatter_map": scatter}
    found = gpu("calm_normals.glsl", "doubted_witness(witness_map, scatter_map, ivec2(p))", p=cells, **maps)
    close(found, mirror.texel(doubted, cells), 1e-4)


def test_highlights_of_doubted_places_agree_with_the_mirror(gpu):
    rng = np.random.default_rng(9)
    surface, witness = patches(6, *rng.normal(0, 0.2, (2, HEIGHT, WIDTH)) * (U > 20))
    surface[4:9, 30:40, 3] = 0
    surface[20:, 40:, 3] *= 1.2
    doubts = witness_of(0.0, rng.uniform(-1.4, 1.4, (HEIGHT, WIDTH)))
    witness[..., 1] = rng.uniform(-0.3, 0.3, (HEIGHT, WIDTH))
    expected = mirror.doubted_certainty(surface, witness, doubts, some())
    maps = {"surface_map": surface, "witness_map": witness, "doubt_map": doubts}
    call = f"doubted_certainty({MAPS}, doubt_map, ivec2(p)), 0, 0, 0"
    close(gpu("calm_normals.glsl", call, p=some(), **maps), expected, 1e-4)


@pytest.mark.parametrize(
    ("slopes", "tilt", "is_dim"),
    [
        ((U / 30, V / 30), 0.06, False),
        ((0.7 * (U > 30), 0 * V), 0.06, True),
        ((0.7 * (abs(U - 30) < 2), 0 * V), 0.06, True),
        ((0.7 * (U > 30), 0 * V), 0.01, False),  # a sure crease
    ],
)
def test_highlights_are_dim_where_unsure_cells_of_several_surfaces_meet(slopes, tilt, is_dim):
    surface, witness = patches(2, *slopes)
    cells = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).reshape(-1, 2)
    doubts = np.full((HEIGHT, WIDTH, 4), tilt, F)
    certainty = mirror.doubted_certainty(surface, 0.02 * witness, doubts, cells)[:, 0]
    is_near = abs(cells[:, 0] - 30) < 4
    assert certainty[~is_near].min() > 0.99
    assert (certainty[is_near].min() < 0.98) == is_dim  # at .96 a highlight is a sixth as bright
