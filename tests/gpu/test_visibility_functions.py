"""Compares shaders/common/visibility.glsl and surroundings.glsl with their mirrors, and with closed formulas."""

import numpy as np
import pytest

from pointshade_gl.gpu.shading.occlusion import plane_shift, plane_turn

from ..reference import surroundings, visibility
from ..reference.camera import pixel_ray

F = np.float32
K = np.array([60.0, -62.0, 30.0, 20.0], F)
K_GLSL = "vec4(60.0, -62.0, 30.0, 20.0)"
TURNED = 0.03  # half circles
WIDTH, HEIGHT = 64, 48


def unit(array):
    return (array / np.linalg.norm(array, axis=-1, keepdims=True)).astype(F)


@pytest.fixture
def surfaces():
    """(h, w, 4): a bumpy wall with holes and a nearer board before it."""
    rng = np.random.default_rng(7)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    depth = 2 + 0.2 * np.sin(u / 5) * np.cos(v / 7)
    depth[10:30, 20:40] = 1.4
    depth[rng.random(depth.shape) < 0.05] = 0
    pixel = np.stack([u, v], -1).astype(F)
    normals = unit(-pixel_ray(pixel, K) + 0.3 * rng.normal(size=(HEIGHT, WIDTH, 3)))
    return np.concatenate([normals, depth[..., None]], -1).astype(F)


def some_pixels(count=400):
    rng = np.random.default_rng(8)
    return np.stack([rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count)], -1)


def mostly(found, mirror, atol=2e-5, share=0.99):
    """Equal but for a few: steps and sectors are rounded, and a last bit may tip one over."""
    close = (np.abs(found - mirror) < atol).all(-1)
    assert close.mean() >= share, f"{close.mean():.3f} are equal"


def test_planes_of_16_neighbours_are_spread_over_half_a_turn(gpu):
    pixel = np.stack(np.meshgrid(np.arange(8), np.arange(8)), -1).reshape(-1, 2)
    found = gpu("visibility.glsl", "plane_of(ivec2(p)), 0, 0", p=pixel)[:, :2]
    np.testing.assert_array_equal(found, visibility.plane_of(pixel))
    turns = visibility.plane_of(pixel)[:, 0].reshape(8, 8)
    for y in range(5):
        for x in range(5):
            assert len(np.unique(turns[y : y + 4, x : x + 4])) == 16


def test_sectors_are_marked_as_by_the_mirror(gpu):
    rng = np.random.default_rng(1)
    ends = rng.random((300, 2)).astype(F)
    ends[:4] = (0, 1), (1, 1), (0.5, 0.5), (0, 0.01)
    call = "vec4(sector_bits(e.x, e.y) >> 16u, sector_bits(e.x, e.y) & 65535u, 0, 0)"
    found = gpu("visibility.glsl", call, e=ends)[:, :2].astype(np.int64)
    bits = visibility.sector_bits(*ends.T)
    assert bits[0] == 0xFFFFFFFF and not bits[1:4].any()
    mostly(found, np.stack([bits >> 16, bits & 65535], -1))
    fours = gpu("visibility.glsl", "vec4(bits_in_fours(uint(b)), 0, 0, 0)", b=(bits & 65535).astype(F)[:, None])[:, 0]
    np.testing.assert_array_equal(fours, visibility.bits_in_fours(bits & np.uint32(65535)))


def test_places_across_the_mask_follow_the_sine(gpu):
    directions = np.array([[1, 0], [1, 1], [1, -1], [-1, 0.2], [0, 1]], F)
    for end in (0.0, 1.0):
        found = gpu("visibility.glsl", f"sector_place(d, {end}), 0, 0, 0", d=directions)[:, 0]
        np.testing.assert_allclose(found, visibility.sector_place(directions, end), atol=1e-6)
        half = np.sqrt(0.5) / 2
        np.testing.assert_allclose(found, [0.5, 0.5 + half, 0.5 - half, end, end], atol=1e-6)


def test_a_plane_goes_through_the_eye_and_keeps_what_lies_in_it_of_the_normal(gpu):
    rng = np.random.default_rng(2)
    point, n = rng.uniform((-1, -1, 1), (1, 1, 3), (200, 3)).astype(F), unit(rng.normal(size=(200, 3)))
    pixel = some_pixels(200)
    mirror = visibility.plane_through(pixel, TURNED, point.astype(F), n, K)
    call = f"Plane s = plane_through(ivec2(q), {TURNED}, p, n, {K_GLSL});"
    inputs = {"q": pixel, "p": point, "n": n}
    for name, expression in {"m": "s.m, s.share", "across": "s.across, 0", "v": "s.v, s.tilt"}.items():
        found = gpu("visibility.glsl", expression, before=call, **inputs)
        expected = [getattr(mirror, name), *({"m": [mirror.share[:, None]], "v": [mirror.tilt]}.get(name, []))]
        expected = np.concatenate(expected, -1)
        np.testing.assert_allclose(found[:, : expected.shape[1]], expected, atol=2e-5)
    np.testing.assert_allclose((mirror.m * mirror.across).sum(-1), 0, atol=1e-5)
    np.testing.assert_allclose((np.cross(mirror.m, mirror.across) * point).sum(-1), 0, atol=1e-5)


@pytest.mark.parametrize("k", [0, 1, 10, 17])
def test_steps_and_what_they_hide_are_those_of_the_mirror(gpu, k):
    rng = np.random.default_rng(3)
    pixel, texel = some_pixels(200), some_pixels(200)
    point, n = rng.uniform((-1, -1, 1), (1, 1, 3), (200, 3)).astype(F), unit(rng.normal(size=(200, 3)))
    away = rng.uniform(-0.5, 0.5, (200, 3)).astype(F)
    plane, call = (
        visibility.plane_through(pixel, TURNED, point, n, K),
        f"plane_through(ivec2(q), {TURNED}, p, n, {K_GLSL})",
    )
    inputs = {"q": pixel, "p": point, "n": n}
    found = gpu("visibility.glsl", f"step_place(ivec2(q), ivec2(t), {call}, {k}, 20.0), 0, 0", t=texel, **inputs)
    mostly(found[:, :2], visibility.step_place(pixel, texel, plane, k, np.full(200, F(20))), 1e-3, 0.98)
    bits = f"uint b = hidden_by(a, {call}, {k}, 0.1);"
    found = gpu("visibility.glsl", "vec4(b >> 16u, b & 65535u, 0, 0)", before=bits, a=away, **inputs)
    hidden = visibility.hidden_by(away, plane, k, np.full(200, F(0.1)))
    mostly(found[:, :2], np.stack([hidden >> 16, hidden & 65535], -1), 0.5, 0.97)


def test_a_whole_plane_sums_up_to_the_cosine_lobe_over_16_planes(gpu):
    """As many directions as Lambert's law gives: the weight 1, and 2/3 of the normal."""
    pixel = np.stack(np.meshgrid(np.arange(4), np.arange(4)), -1).reshape(-1, 2)
    for n in ([0, 0, -1], [0.6, 0, -0.8], [0.3, -0.8, -0.5]):
        n = unit(np.array(n, F))
        inputs = {"q": pixel, "p": np.tile(F([0, 0, 2]), (16, 1)), "n": np.tile(n, (16, 1))}
        plane = visibility.plane_through(pixel, TURNED, inputs["p"], inputs["n"], K)
        call = f"Plane s = plane_through(ivec2(q), {TURNED}, p, n, {K_GLSL});"
        found = gpu("visibility.glsl", "sum_of_sectors(s, 0xFFFFFFFFu)", before=call, **inputs)
        whole = np.full(16, 0xFFFFFFFF, np.uint32)
        np.testing.assert_allclose(found, visibility.sum_of_sectors(plane, whole), atol=2e-5)
        np.testing.assert_allclose(found.mean(0), [*(2 / 3 * n), 1], atol=0.03)
        weight = gpu("visibility.glsl", "weight_of_plane(s), 0, 0, 0", before=call, **inputs)[:, 0]
        np.testing.assert_allclose(weight, found[:, 3], atol=2e-5)
        np.testing.assert_allclose(weight, visibility.weight_of_plane(plane), atol=2e-5)


def test_surfaces_go_on_as_planes_beyond_the_border(gpu):
    """A floor of height 1 below the eye, whose nearest visible place lies at pixel row 47."""
    place, at = np.array([[10, 47], [10, 47], [10, 47]]), np.array([[10, 47], [14, 60], [10, 10]])
    k = np.array([60.0, 60.0, 30.0, 20.0], F)
    floor = np.tile(F([0, -1, 0, 60 / 27]), (3, 1))
    found = gpu("visibility.glsl", "met_at(s, p, a, vec4(60, 60, 30, 20)), 0", s=floor, p=place, a=at)[:, :3]
    np.testing.assert_allclose(found, visibility.met_at(floor, place, at, k), rtol=1e-5)
    np.testing.assert_allclose(found[:2, 1], 1, rtol=1e-5)
    assert (found[2] > 1e9).all(), "above the horizon there is no floor"
    assert (visibility.met_at(np.zeros((1, 4), F), place[:1], at[:1], k) > 1e9).all()


@pytest.mark.parametrize("radius", [0.3, 2.0])
def test_what_planes_see_is_as_by_the_mirror(gpu, surfaces, radius):
    texel = some_pixels()
    own = surfaces[texel[:, 1], texel[:, 0]]
    before = f"Plane s = look_along(surface_map, ivec2(t), ivec2(t), o, {K_GLSL}, {radius}, {TURNED});"
    found = gpu("visibility.glsl", "sum_of_sectors(s, s.hidden)", before=before, t=texel, o=own, surface_map=surfaces)
    plane = visibility.look_along(surfaces, texel, texel, own, K, radius, TURNED)
    known = own[:, 3] > 0
    mirror = visibility.sum_of_sectors(plane, plane.hidden)
    mostly(found[known], mirror[known], share=0.95)
    assert np.ptp(mirror[known, 3]) > 0.5 and not plane.hidden[~known].any()
    call = f"seen_from_plane(surface_map, ivec2(t), ivec2(t), o, {K_GLSL}, {radius}, {TURNED})"
    found = gpu("visibility.glsl", call, t=texel, o=own, surface_map=surfaces)
    mostly(
        found[known],
        visibility.seen_from_plane(surfaces, texel, texel, own, K, radius, TURNED)[known],
        1e-3,
        share=0.95,
    )


def test_of_16_neighbours_on_a_ground_and_16_samples_no_two_look_along_the_same_plane():
    pixel = np.stack(np.meshgrid(np.arange(4), np.arange(4)), -1).reshape(16, 2)
    for first in (0, 16, 48):
        samples = range(first, first + 16)
        turns = np.array([visibility.plane_of(pixel + plane_shift(k))[:, 0] + plane_turn(k) for k in samples])
        assert len(np.unique(turns)) == 256
        assert (np.sort(np.floor(16 * turns), axis=0) == np.arange(16)[:, None]).all()  # each pixel all round


def test_what_goes_on_is_thicker_than_what_starts_anew(gpu):
    """Steps along a wall add up; across a gap in depth, and after a hole, the count starts again."""
    v = np.tile(F([0, 0, -1]), (4, 1))
    step, run = np.array([(0.1, 0, 0.1), (0.1, 0, 0.5), (0.1, 0, -0.5), (1e15, 0, 0)], F), np.full((4, 1), 0.2, F)
    found = gpu("visibility.glsl", "run_of(r, s, v), 0, 0, 0", r=run, s=step, v=v)[:, 0]
    np.testing.assert_allclose(found, [0.3, 0, 0, 0], atol=1e-6)
    np.testing.assert_allclose(visibility.run_of(run[:, 0], step, v), found, atol=1e-6)


def test_among_objects_only_the_others_hide(gpu, surfaces):
    texel = some_pixels()
    own = surfaces[texel[:, 1], texel[:, 0]]
    texel, own = texel[own[:, 3] > 0], own[own[:, 3] > 0]
    numbers = np.ones_like(surfaces)
    numbers[10:30, 20:40, 3] = 2
    before = (
        f"Plane s = look_among(surface_map, numbers_map, true, number, ivec2(t), ivec2(t), o, {K_GLSL}, 1.0, {TURNED});"
    )
    answers = []
    for number in (0, 1, 2):
        inputs = {"t": texel, "o": own, "number": np.full((len(texel), 1), number, F)}
        maps = {"surface_map": surfaces, "numbers_map": numbers}
        found = gpu("visibility.glsl", "sum_of_sectors(s, s.hidden)", before=before, **inputs, **maps)
        plane = visibility.look_among(surfaces, numbers, True, number, texel, texel, own, K, 1.0, TURNED)
        mostly(found, visibility.sum_of_sectors(plane, plane.hidden), share=0.95)
        answers.append(found[:, 3])
    assert (answers[1] <= answers[0] + 1e-5).all() and (answers[1] < answers[0] - 0.05).any()


def test_what_is_hidden_is_taken_from_the_cosine_lobe(gpu):
    rng = np.random.default_rng(11)
    n = unit(rng.normal(size=(100, 3)))
    hidden = np.concatenate([rng.uniform(-0.3, 0.3, (100, 3)), rng.random((100, 1))], -1).astype(F)
    hidden[0], hidden[1] = 0, (0, 0, 0, 1)
    found = gpu("visibility.glsl", "without(h, n)", h=hidden, n=n)
    np.testing.assert_allclose(found, visibility.without(hidden, n), atol=1e-4)
    np.testing.assert_allclose(found[0], [*(2 / 3 * n[0]), 1], atol=1e-6)
    assert found[1, 3] == 0 and (np.linalg.norm(found[:, :3], axis=1) < 1.0001).all()


@pytest.mark.parametrize("stride", [1, 2, 3])
def test_means_and_what_pixels_take_from_them_are_as_by_the_mirror(gpu, surfaces, stride):
    rng = np.random.default_rng(4)
    size = -(-WIDTH // stride), -(-HEIGHT // stride)
    sums, weights = rng.random((size[1], size[0], 4)).astype(F) / 2, rng.random((size[1], size[0], 1)).astype(F)
    cell = np.minimum(some_pixels(), np.array(size) - 1)
    call = f"mean_hidden(plane_map, weight_map, true, surface_map, ivec2(c), -1, {stride}, {K_GLSL})"
    maps = {"plane_map": sums, "weight_map": weights[..., 0], "surface_map": surfaces}
    found = gpu("visibility.glsl", call, c=cell, **maps)
    mostly(found, visibility.mean_hidden(sums, weights, True, surfaces, cell, -1, stride, K))
    call = f"visibility_at(mean_map, surface_map, ivec2(t), {stride}, {K_GLSL})"
    found = gpu("visibility.glsl", call, t=some_pixels(), mean_map=sums, surface_map=surfaces)
    known = surfaces[some_pixels()[:, 1], some_pixels()[:, 0], 3] > 0
    mirror = visibility.visibility_at(sums, surfaces, some_pixels(), stride, K)
    mostly(found[known], mirror[known], 1e-4)


def test_visibility_survives_its_eight_bits(gpu):
    rng = np.random.default_rng(5)
    values = np.concatenate([rng.uniform(-1, 1, (200, 3)), rng.random((200, 1))], -1).astype(F)
    packed = gpu("surroundings.glsl", "pack_visibility(v)", v=values)
    np.testing.assert_allclose(packed, surroundings.pack_visibility(values), atol=1e-6)
    found = gpu("surroundings.glsl", "unpack_visibility(v)", v=(np.round(packed * 255) / 255).astype(F))
    assert np.abs(found - values).max() < 1 / 127
    np.testing.assert_allclose(surroundings.unpack_visibility(packed), values, atol=1e-5)


def test_what_is_hidden_twice_is_multiplied_and_bends_twice(gpu):
    rng = np.random.default_rng(6)
    one, other = (np.concatenate([rng.uniform(-0.5, 0.5, (50, 3)), rng.random((50, 1))], -1).astype(F) for _ in "ab")
    n = rng.normal(size=(50, 3)).astype(F)
    found = gpu("surroundings.glsl", "both_visible(a, b, n)", a=one, b=other, n=n)
    np.testing.assert_allclose(found, surroundings.both_visible(one, other, n), atol=1e-5)


def bands_of(rng):
    return rng.uniform(-0.3, 0.3, (9, 3)).astype(F) + np.eye(9, 1, dtype=F)


def matrices(bands):
    return [f"mat3({', '.join(f'{x:.9g}' for x in part.ravel())})" for part in bands.reshape(3, 3, 3)]


def test_environment_light_is_as_by_the_mirror_and_lamberts_where_nothing_is_hidden(gpu):
    rng = np.random.default_rng(9)
    bands, n = bands_of(rng), unit(rng.normal(size=(200, 3)))
    bent = n * rng.uniform(0, 1, (200, 1)).astype(F)
    seen = np.concatenate([bent, rng.random((200, 1))], -1).astype(F)
    call = f"environment_light(v, {', '.join(matrices(bands))}), 0"
    found = gpu("surroundings.glsl", call, v=seen)[:, :3]
    np.testing.assert_allclose(found, surroundings.environment_light(seen, *bands.reshape(3, 3, 3)), atol=2e-5)
    whole = np.concatenate([2 / 3 * n, np.ones((200, 1))], -1).astype(F)
    found, (x, y, z) = gpu("surroundings.glsl", call, v=whole)[:, :3], n.T[..., None]
    order = [np.ones_like(x), *(2 / 3 * one for one in (x, y, z))]
    order += [0.25 * one for one in (x * y, y * z, x * z, 3 * z * z - 1, x * x - y * y)]
    lambert = np.maximum(sum(one * band for one, band in zip(order, bands, strict=True)), 0.3 * bands[0])
    np.testing.assert_allclose(found, lambert, atol=1e-4)


def test_highlights_of_an_environment_are_as_by_the_mirror(gpu):
    rng = np.random.default_rng(10)
    n, v = unit(rng.normal(size=(200, 3))), unit(rng.normal(size=(200, 3)))
    seen = np.concatenate([n * rng.uniform(0.3, 1, (200, 1)), rng.random((200, 1))], -1).astype(F)
    mirrored, s = unit(2 * (n * v).sum(-1, keepdims=True) * n - v), rng.uniform(1, 200, (200, 1)).astype(F)
    material = np.concatenate([np.full((200, 2), 0.5), np.full((200, 1), 0.3), s], -1).astype(F)
    call = "highlight_strength(m), highlight_visibility(v, r, m.w), 0, 0"
    found = gpu("surroundings.glsl", call, m=material, v=seen, n=n, r=mirrored)
    np.testing.assert_allclose(found[:, 0], surroundings.highlight_strength(material), rtol=1e-5)
    np.testing.assert_allclose(
        found[:, 1], surroundings.highlight_visibility(seen, mirrored, material[:, 3]), atol=2e-3
    )
