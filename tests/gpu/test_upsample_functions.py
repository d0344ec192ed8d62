"""Compares functions of upsampling and of flying pixels with their mirrors, at random places of small maps."""

import numpy as np
import pytest

from ..reference import flying_pixel_mixing as mixing
from ..reference import flying_pixel_snap as snap
from ..reference import upsample_vote as vote
from ..reference.inverse_depth import pixel_grid

F = np.float32
COUNT, SIZE = 400, (16, 12)
K = np.array([30.0, 31.0, 7.5, 5.5], F)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def surface(rng):
    """Two layers, 1.5 m and 2 m away, each of two faces; with holes."""
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    depth = np.where(u + 2 * v < 18, 1.5, 2.0) + 0.002 * rng.normal(size=u.shape)
    depth[rng.random(u.shape) < 0.05] = 0
    depth[7:10, 3:7] = 0
    normal = np.where((v > 5)[..., None], (0, -0.8, -0.6), (0.1, 0.1, -0.99)) + 0.02 * rng.normal(size=(*u.shape, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.concatenate([np.where(depth[..., None] > 0, normal, 0), depth[..., None]], -1).astype(F)


def guide(rng):
    return rng.uniform(0.3, 0.6, (SIZE[1], SIZE[0], 4)).astype(F)


def places(rng):
    return rng.uniform(-0.49, np.array(SIZE) - 0.51, (COUNT, 2)).astype(F)


def pixels(rng):
    return rng.integers(0, SIZE, (COUNT, 2))


def agree(answer, expected, known=True):
    """Where both are known, up to decisions that fall near their threshold."""
    expected = np.asarray(expected, F).reshape(COUNT, -1)[np.broadcast_to(known, COUNT)]
    answer = answer[np.broadcast_to(known, COUNT), : expected.shape[1]]
    off = np.abs(answer - expected).max(-1) > 1e-5 * np.maximum(np.abs(expected).max(-1), 1)
    assert off.mean() <= 0.005


def around(at):
    return [np.floor(at).astype(int) + np.array([k % 2, k // 2]) for k in range(4)]


def test_mean_color_and_is_cut_out(gpu, rng):
    picture, at, small = rng.random((90, 120, 4)).astype(F), places(rng), np.array(SIZE, F)
    picture[rng.random((90, 120)) < 0.3, 3] = 0
    for span in (1.0, 2.5):
        answer = gpu("upsample_vote.glsl", f"mean_color(p_map, a, s, {span}), 0", p_map=picture, a=at, s=small[None])
        agree(answer, vote.mean_color(picture, at, small, span))
    answer = gpu("upsample_vote.glsl", "is_cut_out(p_map, a, s) ? 1 : 0", p_map=picture, a=at, s=small[None])
    expected = vote.is_cut_out(picture, at, small)
    agree(answer, expected)
    assert 0.2 < expected.mean() < 0.4


def test_gaussian_and_color_likeness(gpu, rng):
    off, a, b = places(rng), rng.random((COUNT, 3)).astype(F), rng.random((COUNT, 3)).astype(F)
    agree(gpu("upsample_vote.glsl", "gaussian(o, 1.5)", o=off), vote.gaussian(off, 1.5))
    agree(gpu("upsample_vote.glsl", "color_likeness(a, b)", a=a, b=a + 0.2 * b), vote.color_likeness(a, a + F(0.2) * b))


def test_facets(gpu, rng):
    surface_map, at = surface(rng), places(rng)
    pixel = rng.integers(-2, np.array(SIZE) + 2, (COUNT, 2))
    maps = {"m_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    facet = vote.facet_at(surface_map, pixel, K)
    agree(gpu("upsample_vote.glsl", "facet_at(m_map, ivec2(p), k).surface", **maps), facet.surface)
    agree(gpu("upsample_vote.glsl", "facet_at(m_map, ivec2(p), k).slope, 0, 0", **maps), facet.slope)
    known = facet.surface[:, 3] > 0
    answer = gpu("upsample_vote.glsl", "facet_reaches(facet_at(m_map, ivec2(p), k), a)", **maps, a=at)
    agree(answer, vote.facet_reaches(facet, at), known)
    answer = gpu("upsample_vote.glsl", "add_facet(vec4(1), 2, facet_at(m_map, ivec2(p), k), a)", **maps, a=at)
    expected = vote.add_facet(np.ones((COUNT, 4), F), np.full(COUNT, F(2)), facet, at)
    agree(answer, expected, known)


def test_layers_and_creases(gpu, rng):
    surface_map, first, second, at = surface(rng), pixels(rng), pixels(rng), places(rng)
    second = np.clip(first + second % 3 - 1, 0, np.array(SIZE) - 1)
    maps = {"m_map": surface_map, "p": first.astype(F), "q": second.astype(F), "k": K[None]}
    pair = "facet_at(m_map, ivec2(p), k), facet_at(m_map, ivec2(q), k)"
    facets = [vote.facet_at(surface_map, pixel, K) for pixel in (first, second)]
    expected = vote.shares_layer(*facets)
    agree(gpu("upsample_vote.glsl", f"shares_layer({pair}) ? 1 : 0", **maps), expected)
    assert 0.2 < expected.mean() < 0.95
    known = (facets[0].surface[:, 3] > 0) & (facets[1].surface[:, 3] > 0)
    expected = np.where(known, vote.is_across_crease(*facets, at), False)
    answer = gpu("upsample_vote.glsl", f"is_across_crease({pair}, a) ? 1 : 0", **maps, a=at)
    agree(answer, expected, known)
    assert 0.05 < expected.mean() < 0.6


def test_calm_samples(gpu, rng):
    surface_map, pixel, at = surface(rng), pixels(rng), places(rng)
    surface_map[:, :, 3] = np.where(np.arange(SIZE[0]) < 10, 1.5, surface_map[..., 3])
    surface_map[:, :10, :3] = 0, 0, -1
    answer = gpu("upsample_vote.glsl", "is_calm(m_map, ivec2(p), k)", m_map=surface_map, p=pixel.astype(F), k=K[None])
    expected = vote.is_calm(surface_map, pixel, K)
    agree(answer, expected)
    assert 0.1 < expected.mean() < 0.9
    calm = rng.random(SIZE[::-1]).astype(F)
    agree(gpu("upsample_vote.glsl", "calm_around(c_map, a)", c_map=calm, a=at), vote.calm_around(calm, at))


def test_mix_facets(gpu, rng):
    surface_map, at = surface(rng), places(rng)
    surface_map[..., 3] = np.maximum(surface_map[..., 3], 1.5)
    surface_map[..., :3] = 0, 0.1, -0.99
    answer = gpu("upsample_vote.glsl", "mix_facets(m_map, a, k)", m_map=surface_map, a=at, k=K[None])
    agree(answer, vote.mix_facets(surface_map, at, K))


def test_votes(gpu, rng):
    surface_map, guide_map, at = surface(rng), guide(rng), places(rng)
    color = rng.uniform(0.3, 0.6, (COUNT, 3)).astype(F)
    maps = {"m_map": surface_map, "g_map": guide_map, "a": at, "k": K[None]}
    expected = vote.vote_surface(surface_map, guide_map, at, color, K)
    agree(gpu("upsample_vote.glsl", "vote_surface(m_map, g_map, a, c, k)", **maps, c=color), expected)
    assert 0.01 < (expected[:, 3] == 0).mean() < 0.3
    facets = [vote.facet_at(surface_map, pixel, K) for pixel in around(at)]
    corner = "facet_at(m_map, ivec2(floor(a)) + ivec2({}, {}), k)"
    four = "Facet[4](" + ", ".join(corner.format(k % 2, k // 2) for k in range(4)) + ")"
    answer = gpu("upsample_vote.glsl", f"win_vote(m_map, g_map, {four}, a, c, k).pixel, 0, 0", **maps, c=color)
    agree(answer, vote.win_vote(surface_map, guide_map, facets, at, color, K).pixel)
    own = vote.closest_of(facets, facets[1], at)
    agree(gpu("upsample_vote.glsl", f"closest_of({four}, {corner.format(1, 0)}, a).pixel, 0, 0", **maps), own.pixel)
    turned = vote.closest_turned(facets, facets[1], facets[2], at)
    call = f"closest_turned({four}, {corner.format(1, 0)}, {corner.format(0, 1)}, a).pixel, 0, 0"
    agree(gpu("upsample_vote.glsl", call, **maps), turned.pixel)
    call = ", ".join(corner.format(*at) for at in ((0, 0), (0, 0), (0, 1)))
    known = (facets[0].surface[:, 3] > 0) & (facets[2].surface[:, 3] > 0)
    answer = gpu("upsample_vote.glsl", f"mix_layer(m_map, {call}, a, k)", **maps)
    expected = vote.mix_layer(surface_map, facets[0], facets[0], facets[2], at, K)
    agree(answer, expected, known)


def test_snap(gpu, rng):
    surface_map, guide_map, pixel = surface(rng), guide(rng), pixels(rng)
    surface_map[:, 11:, :3] = 0.96, 0, -0.28  # seen flatly
    surface_map[rng.random(SIZE[::-1]) < 0.3] = 0
    w = rng.uniform(0.45, 0.7, (COUNT, 1)).astype(F)
    maps = {"m_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    expected = snap.snap_sample(surface_map, guide_map, pixel, w[:, 0], K)
    agree(
        gpu("flying_pixel_snap.glsl", "snap_sample(m_map, g_map, ivec2(p), w, k)", **maps, g_map=guide_map, w=w),
        expected,
    )
    assert (expected[:, 3] > 1.8).any() and (expected[:, 3] < 1.7).any()
    answer = gpu("flying_pixel_snap.glsl", "range_around(m_map, ivec2(p), k), 0, 0", **maps)
    agree(answer, snap.range_around(surface_map, pixel, K))
    mixing_map = (rng.random((*SIZE[::-1], 4)) < 0.1).astype(F)
    expected = snap.needs_snap(surface_map, mixing_map, pixel, K)
    agree(
        gpu("flying_pixel_snap.glsl", "needs_snap(m_map, x_map, ivec2(p), k) ? 1 : 0", **maps, x_map=mixing_map),
        expected,
    )
    steep = snap.is_steep(vote.facet_at(surface_map, pixel, K), K)
    agree(gpu("flying_pixel_snap.glsl", "is_steep(facet_at(m_map, ivec2(p), k), k) ? 1 : 0", **maps), steep)
    assert steep.any() and mixing_map[pixel[:, 1], pixel[:, 0], 0].sum() < expected.sum() < COUNT / 2
    k = np.arange(49, dtype=F)[:, None]
    answer = gpu("flying_pixel_snap.glsl", "vec2(snap_offset(int(n))), 0, 0", n=k)
    assert (answer[:, :2] == [snap.snap_offset(int(n)) for n in k[:, 0]]).all()
    facet, at = vote.facet_at(surface_map, pixel, K), pixel.astype(F)
    known = facet.surface[:, 3] > 0
    one = np.ones(COUNT, F)
    side = snap.add_to_side(snap.Side(np.ones((COUNT, 4), F), one, one), w[:, 0], F(0.5) * one, facet, at)
    call = "add_to_side(Side(vec4(1), 1.0, 1.0), w, 0.5, facet_at(m_map, ivec2(p), k), p)"
    agree(gpu("flying_pixel_snap.glsl", f"{call}.plane", **maps, w=w), side.plane, known)
    answer = gpu("flying_pixel_snap.glsl", f"{call}.total, {call}.alike, mean_likeness({call}), 0", **maps, w=w)
    agree(answer, np.stack([side.total, side.alike, snap.mean_likeness(side)], -1))


def test_mixing(gpu, rng):
    u = np.arange(48)[None] + np.zeros((36, 1))
    step = np.clip((u - 20 + 8 * np.sin(np.arange(36) / 6)[:, None]) / 3, 0, 1)
    depth = (1.5 + 0.7 * step + 0.003 * rng.normal(size=step.shape)).astype(F)
    depth[:, 40:] = 3
    depth[rng.random(depth.shape) < 0.02] = 0
    grid = pixel_grid(depth)
    pixel = np.stack(grid, -1).reshape(-1, 2)
    for call, mirror in (
        ("find_mixing(d_map, ivec2(p)), 0, 0", mixing.find_mixing(depth, grid)),
        ("mixing_along(d_map, ivec2(p), ivec2(1, -1), 2), 0, 0", mixing.mixing_along(depth, grid, (1, -1), 2)),
    ):
        answer = gpu("flying_pixel_mixing.glsl", call, d_map=depth, p=pixel)[:, :2]
        assert (answer != mirror.reshape(-1, 2)).any(-1).mean() <= 0.001
    found = mixing.find_mixing(depth, grid)
    assert found[..., 0].sum() > 40 and found[..., 1].sum() > 40
    block = np.stack(np.meshgrid(np.arange(3), np.arange(3)), -1).reshape(-1, 2)
    maps = {"m_map": np.concatenate([found, 0 * found], -1), "b": block.astype(F)}
    answer = gpu("flying_pixel_mixing.glsl", "count_mixing(m_map, ivec2(b)), 0, 0", **maps)
    np.testing.assert_array_equal(answer[:, :2], mixing.count_mixing(found, block))
    pair = rng.choice(np.array([0, 1.5, 2], F), (20, 2))
    answer = gpu("flying_pixel_mixing.glsl", "known_change(z.x, z.y)", z=pair)
    np.testing.assert_allclose(answer[:, 0], mixing.known_change(*pair.T), rtol=1e-5)
