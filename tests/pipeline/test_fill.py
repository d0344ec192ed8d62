"""size="fill": the gaps between points of one surface are closed, outlines and dense frames stay as they are."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..gpu.test_sparse import PATTERNS, at_random, ground, kept, scan_lines
from ..reference import gap_filling as gaps
from ..support import frames
from ..support.drivers import need_compute

F = np.float32
SIZE = (24, 18)
K = np.array([30.0, 31.0, 11.5, 8.5], F)
REACH = 6


@pytest.fixture(scope="module", params=["points", "compute"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


@pytest.fixture
def rng():
    return np.random.default_rng(4)


def surface(rng):
    """Two tilted layers, 1.5 m and 2 m away, of which a fifth is known; some marked as rims."""
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    depth = np.where(u + 2 * v < 30, 1.5 + 0.01 * u, 2.0 + 0.01 * v)
    depth = np.where(rng.random(u.shape) < 0.2, depth, 0) * np.where(rng.random(u.shape) < 0.3, -1, 1)
    normal = np.where((u + 2 * v < 30)[..., None], (0.1, 0.1, -0.9), (0, -0.5, -0.8)) + 0.02 * rng.normal(size=3)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.concatenate([np.where(depth[..., None] != 0, normal, 0), depth[..., None]], -1).astype(F)


def every_pixel():
    return np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), -1).reshape(-1, 2)


def test_known_in_row_and_around_agree_with_the_mirror(gpu, rng):
    seen, pixel = surface(rng), every_pixel()
    rows = gaps.known_in_row(seen, pixel, REACH)
    answer = gpu("gap_filling.glsl", f"known_in_row(s_map, ivec2(p), {REACH}), 0, 0", s_map=seen, p=pixel)
    np.testing.assert_array_equal(answer[:, :2], rows)
    row_map = np.zeros((*SIZE[::-1], 4), F)
    row_map[..., :2] = rows.reshape(*SIZE[::-1], 2) / 255
    hits = gaps.known_around(row_map, pixel, REACH)
    assert (hits != 0).any(-1).any(1).all() and not (hits != 0).any(-1).all()


def test_fill_gap_agrees_with_the_mirror(gpu, rng):
    seen, pixel = surface(rng), every_pixel()
    row_map = np.zeros((*SIZE[::-1], 4), F)
    row_map[..., :2] = gaps.known_in_row(seen, pixel, REACH).reshape(*SIZE[::-1], 2) / 255
    expected = gaps.fill_gap(seen, row_map, pixel, REACH, K)
    call = f"fill_gap(s_map, r_map, ivec2(p), {REACH}, k)"
    answer = gpu("gap_filling.glsl", call, s_map=seen, r_map=row_map, p=pixel, k=K[None])
    off = np.abs(answer - expected).max(-1) > 1e-5
    assert off.mean() <= 0.005
    assert 0.3 < (expected[:, 3] > 0).mean() < 0.98


def test_is_left_open_agrees_with_the_mirror(gpu, rng):
    seen, pixel, shape = surface(rng), every_pixel(), SIZE[::-1]
    filled, depth = np.zeros((*shape, 4), F), np.zeros((*shape, 4), F)
    filled[..., 3], depth[..., 0] = rng.random(shape) < 0.3, rng.random(shape) < 0.6
    expected = gaps.is_left_open(seen, filled, depth, pixel, REACH)
    call = f"float(is_left_open(s_map, f_map, d_map, ivec2(p), {REACH})), 0, 0, 0"
    answer = gpu("gap_filling.glsl", call, s_map=seen, f_map=filled, d_map=depth, p=pixel)
    np.testing.assert_array_equal(answer[:, 0] > 0.5, expected)
    assert 0.2 < expected.mean() < 0.99


def test_a_pixel_is_enclosed_by_what_lies_on_all_sides_of_it_only():
    around = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], F)
    one_side = np.array([[-3, -0.5], [0.5, -3], [-3, 1], [0, 0]], F)
    opposite = np.array([[-2, 0], [2, 0], [-2, 0], [2, 0]], F)
    same = np.array([[0, -2], [0, -2], [0, 0], [0, 0]], F)
    for hits, found in ((around, True), (one_side, False), (opposite, True), (same, False)):
        counts = (hits != 0).any(-1)[:, None]
        assert gaps.is_enclosed(hits[:, None], counts)[0] == found
    assert not gaps.is_enclosed(around[:, None], np.array([[True], [True], [False], [False]]))[0]


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_sparse_plane_comes_back_whole(rasterizer, pattern):
    """Between its outermost points, where and as bright as the dense plane."""
    dense, inside = frames.tilted_plane(), np.s_[8:-8, 8:-8]
    sparse = kept(dense, PATTERNS[pattern])
    assert (rasterizer.render(sparse)[inside][..., 3] > 0).mean() < 0.5
    filled = rasterizer.render(sparse, point_size="fill")[inside]
    assert (filled[..., 3] > 0).mean() > 0.99
    off = np.abs(filled.astype(int) - rasterizer.render(dense)[inside])[filled[..., 3] > 0]
    assert np.median(off) <= 1 and (off > 8).mean() < 0.01
    depth = rasterizer.render_depth(sparse, point_size="fill")[inside]
    assert np.median(np.abs(depth / dense.depth[inside] - 1)[depth > 0]) < 1e-4


def test_a_road_is_seen_from_aside(renderer):
    """Points move onto their plane, so that few cracks open between them; a mesh has none."""
    road, _ = ground()
    sparse = kept(road, scan_lines((120, 160)), noise=0.002)
    options = {"yaw": 15, "shading": "none"}
    whole = renderer.render(road, **options)[..., 3] > 0
    splats, mesh = (
        renderer.render(sparse, point_size="fill", splat=one, **options)[..., 3] > 0 for one in ("footprint", "mesh")
    )
    assert (renderer.render(sparse, **options)[..., 3] > 0)[whole].mean() < 0.3
    assert splats[whole].mean() > 0.8 and mesh[whole].mean() > 0.8


@pytest.mark.parametrize(
    "make", [frames.tilted_plane, frames.sphere_before_wall, frames.sphere, frames.step, frames.noisy]
)
@pytest.mark.parametrize("yaw", [0, 20])
def test_a_frame_without_holes_looks_as_with_size_1(rasterizer, make, yaw):
    """Outlines stay where they are, to the bit."""
    np.testing.assert_array_equal(
        rasterizer.render(make(), yaw=yaw, point_size="fill"), rasterizer.render(make(), yaw=yaw)
    )


def test_small_holes_close_and_large_ones_stay(renderer):
    frame = frames.tilted_plane()
    missing = at_random(frame.depth.shape, 0.05)
    missing[40:46, 30:36] = missing[60:100, 80:120] = True
    seen = renderer.render(ps.Frame(frame.color, np.where(missing, 0, frame.depth), frame.camera), point_size="fill")
    assert (seen[40:46, 30:36, 3] > 0).all() and (seen[5:35, 5:-5, 3] > 0).all()
    assert (seen[66:94, 86:114, 3] == 0).all()


@pytest.mark.parametrize("squeezed", [1.0, 1.4, 2.0])
@pytest.mark.parametrize("turned", [0, 30])
def test_a_hole_is_filled_as_a_whole_or_not_at_all(renderer, squeezed, turned):
    """Round and oval holes of every size leave no dots or bars."""
    frame, whole = frames.tilted_plane(), set()
    v, u = np.mgrid[: frame.depth.shape[0], : frame.depth.shape[1]] - np.array([60.3, 80.4])[:, None, None]
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    for radius in np.arange(3, 24, 0.8):
        missing = np.hypot(c * u + s * v, squeezed * (c * v - s * u)) < radius
        seen = renderer.render(
            ps.Frame(frame.color, np.where(missing, 0, frame.depth), frame.camera), point_size="fill"
        )
        share = float((np.asarray(seen)[missing][:, 3] > 0).mean())
        assert share in (0, 1), radius
        whole.add(share)
    assert whole == {0, 1}


def test_pixels_that_the_colours_cut_out_are_not_filled(renderer):
    frame = frames.tilted_plane()
    color = np.full((*frame.depth.shape, 4), 255, np.uint8)
    color[50:54, 50:54, 3] = 0
    seen = renderer.render(ps.Frame(color, frame.depth, frame.camera), point_size="fill")
    assert (seen[50:54, 50:54, 3] == 0).all() and (seen[46:50, 50:54, 3] > 0).all()


def test_a_second_picture_fills_nothing_anew(own_renderer):
    frame = kept(frames.tilted_plane(), PATTERNS["scan lines"])
    for yaw in (0, 10):
        own_renderer.render(frame, yaw=yaw, point_size="fill")
    assert own_renderer.steps.counts["fill"] == 1


@pytest.fixture
def own_renderer(renderer):
    with ps.Renderer() as made:
        yield made


def test_other_words_for_the_size_are_refused(renderer, typed):
    with pytest.raises(ValueError, match="size must be a number of source pixels, or 'fill', got 'full'"):
        renderer.render(frames.sphere(), point_size="full")
    code, _, said = typed("render vase -o a.png --point-size full")
    assert code == 2 and "--point-size must be a number of source pixels, or 'fill', got 'full'" in said
    assert typed("render vase -o a.png --point-size fill")[0] == 0
