"""Compares the functions of trained_splats.glsl with their mirrors, and with what they promise."""

import numpy as np

from ..reference import shadow
from ..reference import trained_splats as mirror

F = np.float32
COUNT = 500


def test_what_a_splat_covers(gpu):
    rng = np.random.default_rng(1)
    opacity, square = (rng.uniform(0, end, (COUNT, 1)).astype(F) for end in (1, 9))
    answer = gpu("trained_splats.glsl", "splat_alpha(o, s), 0, 0, 0", o=opacity, s=square)
    np.testing.assert_allclose(answer[:, :1], mirror.splat_alpha(opacity, square), atol=1e-6)
    assert answer[:, 0].max() <= 0.99


def test_a_splat_that_stands_for_a_surface_is_smaller_and_takes_as_much_light(gpu):
    rng = np.random.default_rng(5)
    opacity, area, most = (rng.uniform(*ends, (COUNT, 1)).astype(F) for ends in ((0, 1), (0.3, 50), (1, 4)))
    answer = gpu("trained_splats.glsl", "density(a, m), dense_opacity(o, m), 0, 0", o=opacity, a=area, m=most)
    np.testing.assert_allclose(answer[:, :1], mirror.density(area, most), rtol=1e-5)
    np.testing.assert_allclose(answer[:, 1:2], mirror.dense_opacity(opacity, most), atol=1e-5)
    assert (answer[:, 0] < most[:, 0] + 1e-5).all()
    faint = opacity[:, 0] < 0.05
    np.testing.assert_allclose(answer[faint, 1], (opacity * most)[faint, 0], rtol=0.1)
    dot = np.array([[0.3]], F)
    np.testing.assert_allclose(gpu("trained_splats.glsl", "density(a, 4.0), 0, 0, 0", a=dot)[0, 0], 1, rtol=1e-5)


def mixtures(rng):
    """Sums of two depths each, which these are, and the share of the nearer."""
    near, apart, share = rng.uniform(-1, 0, COUNT), rng.uniform(0.2, 1, COUNT), rng.uniform(0.1, 0.9, COUNT)
    far, weight = near + apart, rng.uniform(0.1, 1, COUNT)
    powers = [share * near**k + (1 - share) * far**k for k in (1, 2, 3)]
    return (np.stack([*powers, np.ones(COUNT)], -1) * weight[:, None]).astype(F), np.stack([near, far, share], -1)


def test_two_depths_of_a_pixel_are_told_apart(gpu):
    sums, true = mixtures(np.random.default_rng(2))
    answer = gpu("trained_splats.glsl", "two_depths(s), 0", s=sums)[:, :3]
    np.testing.assert_allclose(answer, mirror.two_depths(sums), atol=2e-3)
    np.testing.assert_allclose(answer, true, atol=5e-3)
    alone = np.tile(np.array([[0.5, 0.25, 0.125, 1]], F), (4, 1))
    np.testing.assert_allclose(gpu("trained_splats.glsl", "two_depths(s), 0", s=alone)[:, :3], [[0.5, 0.5, 1]] * 4)


def test_light_ends_behind_what_covers_it(gpu):
    rng = np.random.default_rng(3)
    cover = rng.uniform(0, 1, (COUNT, 1))
    depths = np.sort(rng.uniform(0, 2, (COUNT, 2)), 1)
    seen = np.concatenate([depths, cover * rng.uniform(0, 1, (COUNT, 1)), cover], 1).astype(F)
    depth, thick = rng.uniform(0, 3, (COUNT, 1)).astype(F), rng.uniform(0.01, 0.2, (COUNT, 1)).astype(F)
    answer = gpu("trained_splats.glsl", "share_past_splats(s, d, t), 0, 0, 0", s=seen, d=depth, t=thick)[:, 0]
    np.testing.assert_allclose(answer, mirror.share_past_splats(seen, depth[:, 0], thick[:, 0]), atol=2e-4)
    assert (answer[depth[:, 0] < seen[:, 0]] == 1).all()
    solid = (seen[:, 3] > 0.999) & (depth[:, 0] > seen[:, 1] + 4 * thick[:, 0])
    assert (answer[solid] < 0.02).all()


def test_the_plane_through_inverse_depths(gpu):
    rng = np.random.default_rng(4)
    normal = np.concatenate([rng.uniform(-0.8, 0.8, (COUNT, 2)), -np.ones((COUNT, 1))], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ray, focal = rng.uniform(-0.3, 0.3, (COUNT, 2)), np.full((COUNT, 2), 400.0)
    v, u = np.mgrid[-3:4, -3:4].reshape(2, -1)
    rays = np.stack([ray[:, :1] + u / 400, ray[:, 1:] + v / 400, np.ones((COUNT, 49))], -1)
    own = np.concatenate([ray, np.ones((COUNT, 1))], 1)
    inverse = np.einsum("nkc,nc->nk", rays, normal) / np.einsum("nc,nc->n", own, normal)[:, None]  # 1 in the middle
    places = np.stack([np.ones(49), u, v], -1)
    first = np.tile(places.sum(0), (COUNT, 1))
    second = np.tile([(u * u).sum(), (u * v).sum(), (v * v).sum()], (COUNT, 1))
    inputs = [one.astype(F) for one in (first, second, inverse @ places, ray, focal)]
    call = "fitted_normal(a, b, r, w, f), 0"
    answer = gpu("trained_splats.glsl", call, **dict(zip("abrwf", inputs, strict=True)))[:, :3]
    np.testing.assert_allclose(answer, mirror.fitted_normal(*inputs), atol=2e-3)
    np.testing.assert_allclose(answer, normal, atol=5e-3)


def test_light_beside_splats_is_looked_up_between_pixels(gpu):
    rng = np.random.default_rng(6)
    depths = np.sort(rng.uniform(0, 2, (24, 24, 2)), -1)
    cover = rng.uniform(0.5, 1, (24, 24, 1))
    seen = np.concatenate([depths, cover * rng.uniform(0, 1, (24, 24, 1)), cover], -1).astype(F)
    at = rng.uniform(-2, 18, (COUNT, 2)).astype(F)
    depth, thick = rng.uniform(0, 3, (COUNT, 1)).astype(F), np.full((COUNT, 1), 0.1, F)
    tile = np.array([1, 1, 5, 3], F)
    call = "share_beside_splats(seen_map, t, 16.0, a, d, k), 0, 0, 0"
    answer = gpu("shadow.glsl", call, seen_map=seen, t=tile[None], a=at, d=depth, k=thick, SPLATS=1)[:, 0]
    expected = shadow.share_beside_splats(seen, tile, 16, at, depth[:, 0], thick[:, 0])
    np.testing.assert_allclose(answer, expected, atol=5e-4)
    assert (answer[(at < -1).any(1) | (at > 16).any(1)] > 0.99999).all()
