"""parts.glsl and consensus.glsl: each function is compared with its mirror, at edges and on planes."""

import numpy as np
import pytest

from ..reference import camera, consensus, parts
from ..reference.splat import carry_footprint
from ..reference.vectors import normalize, texel
from .test_resolve_functions import EDGE, HEIGHT, WIDTH, K, close, positions, seen_at, two_planes
from .test_shader_functions import COUNT, TARGET, VIEW, VIEW_GLSL, F

SEEN = "Seen(at, w, ivec2(p), own, corners_at(surface_map, at))"
LOOK = f"look_twice(surface_map, w, h > 0.5, q, k, {VIEW_GLSL}, t, b)"
BAND = np.full((1, 1), 0.02, F)
WAY = {"k": K[None], "t": TARGET[None]}
PIXELS = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1).reshape(-1, 2)


def drawn_splats():
    """A surface map, and target pixels near the middle of its splats with their 1/z, off by up to 4 %."""
    rng, surface_map = np.random.default_rng(6), two_planes()
    pixel = rng.integers(0, (WIDTH, HEIGHT), (COUNT, 2))
    own = texel(surface_map, pixel)
    splat = carry_footprint(pixel.astype(F), own[:, 3], own[:, :3], K, VIEW, TARGET)
    target_pixel = (splat.centre + rng.uniform(-1, 1, (COUNT, 2))).astype(F)
    return surface_map, pixel, target_pixel, (splat.inverse_depth * rng.uniform(0.96, 1.04, COUNT)).astype(F)


def carried_points(holes=0.1):
    """A surface map, and where points lie in it: half on its surfaces, to 1 %, the others off by up to a half."""
    rng, surface_map = np.random.default_rng(5), two_planes(holes)
    at = rng.uniform(-1.5, (WIDTH + 0.5, HEIGHT + 0.5), (COUNT, 2)).astype(F)
    z = texel(surface_map, np.clip(np.round(at), 0, (WIDTH - 1, HEIGHT - 1)).astype(int))[:, 3]
    off = np.where(rng.random(COUNT) < 0.5, rng.uniform(0.99, 1.01, COUNT), rng.uniform(0.5, 1.5, COUNT))
    return surface_map, np.concatenate([at, (off / np.where(z > 0, z, 1))[:, None]], -1).astype(F)


def test_keys_keep_the_level_above_the_depth_and_what_is_hidden_in_the_last_of_its_bits(gpu):
    w = np.random.default_rng(1).uniform(1e-6, 1e6, (COUNT, 1)).astype(F)
    level = np.arange(COUNT)[:, None] % 4
    hidden = np.random.default_rng(2).random((COUNT, 1)) < 0.5
    key = parts.splat_key(w, level, hidden)
    call, inputs = "splat_key(w, int(l), h > 0.5)", {"w": w, "l": level.astype(F), "h": hidden}
    halves = gpu("parts.glsl", f"float({call} >> 16), float({call} & 65535u), 0, 0", **inputs)
    assert (halves[:, :2].astype(np.int64) @ (65536, 1) == key[:, 0]).all()
    back = gpu("parts.glsl", f"key_inverse_depth({call})", **inputs)[:, :1]
    assert (back == parts.key_inverse_depth(key)).all()
    assert (np.ascontiguousarray(back).view(np.uint32) >> 2 == w.view(np.uint32) >> 2).all()
    assert ((key & 1 == 1) == hidden).all()
    assert (key[level == 3].min() > key[level == 2].max()) and (key[level == 1].min() > key[level == 0].max())


def test_merged_inverse_depth(gpu):
    rng = np.random.default_rng(11)
    w, off, weight = (
        rng.uniform(low, high, (COUNT, 1)).astype(F) for low, high in ((0.1, 10), (-0.04, 0.04), (1e-9, 9))
    )
    inputs = {"w": w, "o": weight * off, "t": weight}
    answer = gpu("parts.glsl", "merged_inverse_depth(splat_key(w, 3, false), o, t), 0, 0, 0", **inputs)[:, 0]
    expected = parts.merged_inverse_depth(
        parts.splat_key(w, np.full_like(w, 3), np.zeros_like(w, bool)), weight * off, weight
    )[:, 0]
    np.testing.assert_allclose(answer, expected, rtol=1e-6)
    np.testing.assert_allclose(expected, (w * (1 + off))[:, 0], rtol=1e-6)


def test_target_normal_gives_way_where_the_frames_contradict_it(gpu):
    rng = np.random.default_rng(12)
    mixed = normalize(rng.normal(0, 1, (COUNT, 3)).astype(F))
    turned = normalize(
        mixed + rng.uniform(0, 1.4, (COUNT, 1)).astype(F) * normalize(rng.normal(0, 1, (COUNT, 3)).astype(F))
    )
    found = np.concatenate([turned, rng.choice([0, 2.5], (COUNT, 1), p=(0.2, 0.8))], -1).astype(F)
    expected = parts.target_normal(found, mixed)
    close(gpu("parts.glsl", "target_normal(f, m), 0", f=found, m=mixed), expected, missed=1)
    kept = (expected == turned).all(-1)
    assert 0.3 < kept.mean() < 0.7 and not kept[found[:, 3] == 0].any()
    assert kept[(found[:, 3] > 0) & ((turned * mixed).sum(-1) > 0.71)].all()


def test_is_stretched_and_splat_level(gpu):
    rng = np.random.default_rng(2)
    extent, side = rng.uniform(0, 12, (COUNT, 2)).astype(F), rng.choice([1, 2, 4], (COUNT, 1)).astype(F)
    stretched = parts.is_stretched(extent, side[:, 0])
    answer = gpu("parts.glsl", "float(is_stretched(e, s)), 0, 0, 0", e=extent, s=side)
    assert (answer[:, 0] == stretched).all() and 0.1 < stretched.mean() < 0.9
    trust = rng.choice([0, 1], (COUNT, 1)).astype(F)
    for primary in (False, True):
        call = f"float(splat_level(t, is_stretched(e, s), {str(primary).lower()}))"
        expected = parts.splat_level(trust[:, 0], stretched, primary)
        assert (gpu("parts.glsl", call, e=extent, s=side, t=trust)[:, 0] == expected).all()
        assert set(expected) == {int(primary), 2 + int(primary)}


def test_is_among_picks_a_share_of_pixels_blocks_and_quarters_alike(gpu):
    pixel = np.random.default_rng(10).integers(0, 2000, (COUNT, 2))
    for share in (0, 0.3, 1):
        among = parts.is_among(pixel, share)
        answer = gpu("parts.glsl", f"float(is_among(ivec2(p), {share:.1f})), 0, 0, 0", p=pixel.astype(F))[:, 0]
        assert (answer != among).sum() <= 1
        for side in (1, 2, 4):  # source pixels that one splat may stand for
            assert parts.is_among(PIXELS * side, share).mean() == pytest.approx(share, abs=0.01)


def test_share_across_is_1_where_a_ray_meets_a_surface_squarely_and_never_vanishes(gpu):
    surface_map, pixel, target_pixel, _ = drawn_splats()
    normal = texel(surface_map, pixel)[:, :3]
    expected = parts.share_across(normal, target_pixel, VIEW, TARGET)
    call = f"share_across(n, q, {VIEW_GLSL}, t)"
    close(gpu("parts.glsl", call, n=normal, q=target_pixel, t=TARGET[None]), expected)
    ray = camera.pixel_ray(np.array([7, 5], F), TARGET) @ VIEW[:3, :3]
    aside = np.cross(ray, [0, 1, 0])
    for toward, share in ((ray, 1), (aside, parts.FLATTEST)):
        unit = (toward / np.linalg.norm(toward)).astype(F)
        assert parts.share_across(unit, np.array([7, 5], F), VIEW, TARGET) == pytest.approx(share, abs=1e-5)


def test_plane_inverse_depth(gpu):
    surface_map, pixel, target_pixel, w = drawn_splats()
    own = texel(surface_map, pixel)
    call = f"plane_inverse_depth(own, p, q, k, {VIEW_GLSL}, t)"
    answer = gpu("parts.glsl", call, own=own, p=pixel.astype(F), q=target_pixel, **WAY)
    expected = parts.plane_inverse_depth(own, pixel.astype(F), target_pixel, K, VIEW, TARGET)
    close(answer, expected)
    assert np.median(np.abs(expected / w - 1)) < 0.03


def test_look_twice_finds_the_surface_where_the_first_depth_was_a_little_wrong(gpu):
    surface_map, pixel, target_pixel, w = drawn_splats()
    hidden = np.zeros((COUNT, 1), bool)
    seen = parts.look_twice(surface_map, w, hidden[:, 0], target_pixel, K, VIEW, TARGET, BAND[0, 0])
    inputs = {"surface_map": surface_map, "q": target_pixel, "w": w[:, None], "b": BAND, "h": hidden, **WAY}
    close(gpu("parts.glsl", f"{LOOK}.at, {LOOK}.inverse_depth, 0", **inputs)[:, :2], seen.at, missed=5, atol=1e-3)
    close(gpu("parts.glsl", f"{LOOK}.inverse_depth", **inputs), seen.inverse_depth, missed=5, rtol=1e-4)
    close(gpu("parts.glsl", f"{LOOK}.pixel, 0, 0", **inputs), seen.pixel, missed=5)
    near = np.abs(seen.inverse_depth / w - 1) < 0.015
    exact = parts.plane_inverse_depth(texel(surface_map, pixel), pixel.astype(F), target_pixel, K, VIEW, TARGET)
    assert (np.abs(seen.inverse_depth / exact - 1)[near] < 1e-4).mean() > 0.9


def test_part_is_known_only_inside_the_frame_and_where_it_has_depth(gpu):
    surface_map = two_planes(holes=0.1)
    rng = np.random.default_rng(3)
    at = rng.uniform(-2, (WIDTH + 1, HEIGHT + 1), (COUNT, 2)).astype(F)
    seen, inputs = seen_at(surface_map, at)
    size = np.array([[WIDTH, HEIGHT]], F)
    answer = gpu("parts.glsl", f"float(part_is_known({SEEN}, s)), 0, 0, 0", **inputs, s=size)
    expected = parts.part_is_known(seen, size[0])
    assert (answer[:, 0] == expected).all() and 0.4 < expected.mean() < 0.9


def test_agreement_and_fallback_weight(gpu):
    off = np.random.default_rng(4).uniform(-0.05, 0.05, (COUNT, 1)).astype(F)
    close(gpu("parts.glsl", "agreement(o, b)", o=off, b=BAND), parts.agreement(off, BAND[0, 0]))
    close(
        gpu("parts.glsl", "fallback_weight(o, b) * 1e11", o=off, b=BAND), 1e11 * parts.fallback_weight(off, BAND[0, 0])
    )
    assert parts.agreement(F(0), BAND[0, 0]) == 1 and parts.agreement(BAND[0, 0], BAND[0, 0]) == 0


def test_view_weight(gpu):
    surface_map = two_planes()
    at = positions(surface_map, margin=0)
    seen, inputs = seen_at(surface_map, at)
    target_pixel = np.random.default_rng(7).uniform(0, 400, at.shape).astype(F)
    expected = parts.view_weight(seen, target_pixel, K, VIEW, TARGET)
    call = f"view_weight({SEEN}, q, k, {VIEW_GLSL}, t, false), view_weight({SEEN}, q, k, {VIEW_GLSL}, t, true), 0, 0"
    answer = gpu("parts.glsl", call, **inputs, q=target_pixel, **WAY)[:, :2].T
    sharp = parts.view_weight(seen, target_pixel, K, VIEW, TARGET, is_exact=True)
    close(answer, np.stack([expected, sharp]), rtol=1e-3)
    turned_away = (seen.own[:, :3] * camera.pixel_ray(at, K)).sum(-1) / np.linalg.norm(camera.pixel_ray(at, K), axis=-1)
    seen = seen._replace(inverse_depth=1 / seen.own[:, 3])
    own = parts.view_weight(seen, at, K, np.eye(4, dtype=F), K)
    np.testing.assert_allclose(own, -turned_away, rtol=1e-4)  # of a frame in its own view
    assert (own > 50 * expected).all()


def test_lies_deep_and_is_spare(gpu):
    surface_map, pixel, target_pixel, w = drawn_splats()
    z, w = texel(surface_map, pixel)[:, 3], w * np.random.default_rng(14).uniform(0.8, 1.25, COUNT).astype(F)
    expected = parts.lies_deep(target_pixel, w, z, K, VIEW, TARGET)
    call = f"float(lies_deep(q, w, z, k, {VIEW_GLSL}, t)), 0, 0, 0"
    answer = gpu("parts.glsl", call, q=target_pixel, w=w[:, None], z=z[:, None], **WAY)[:, 0]
    assert (answer == expected).mean() > 0.999 and 0.1 < expected.mean() < 0.95
    trust = np.array([[0], [parts.SPARE], [consensus.CONTESTED], [1]], F)
    assert gpu("parts.glsl", "float(is_spare(t)), 0, 0, 0", t=trust)[:, 0].tolist() == [0, 1, 0, 0]


def test_carry_forth_and_lies_inside(gpu):
    surface_map, pixel, _, _ = drawn_splats()
    w = 1 / texel(surface_map, pixel)[:, 3]
    there = consensus.carry_forth(pixel.astype(F), w, K, VIEW, TARGET)
    inputs = {"p": pixel.astype(F), "w": w[:, None], "k": K[None], "t": TARGET[None]}
    close(gpu("consensus.glsl", f"carry_forth(p, w, k, {VIEW_GLSL}, t), 0", **inputs), there, atol=1e-3)
    size = np.array([[210, 160]], F)
    inside = consensus.lies_inside(there, size[0])
    assert (gpu("consensus.glsl", "float(lies_inside(h, s)), 0, 0, 0", h=there, s=size)[:, 0] == inside).all()
    assert 0.1 < inside.mean() < 0.9


def test_depth_excess_and_vote_on(gpu):
    surface_map, there = carried_points()
    inputs = {"surface_map": surface_map, "h": there, "k": K[None]}
    excess = consensus.depth_excess(surface_map, there, K)
    close(gpu("consensus.glsl", "depth_excess(surface_map, h, k)", **inputs), excess, missed=1)
    votes = consensus.vote_on(surface_map, there, K, BAND[0, 0])
    close(gpu("consensus.glsl", "vote_on(surface_map, h, k, b), 0, 0", **inputs, b=BAND), votes, missed=1)
    assert (votes.mean(0) > 0.1).all() and not votes.all(-1).any()
    assert (excess == consensus.NO_OVERLAP).mean() > 0.1


def test_a_frame_sees_through_what_floats_before_it_but_not_through_an_edge():
    surface_map = two_planes()
    ahead = np.array([[4, 9, 1 / 1.6], [EDGE - 0.5, 9, 1 / 1.6], [4, 9, 1 / surface_map[9, 4, 3]]], F)
    votes = consensus.vote_on(surface_map, ahead, K, BAND[0, 0])
    assert votes.tolist() == [[0, 1], [0, 0], [1, 0]]


def test_shows_better_and_is_shown_better(gpu):
    surface_map, there = carried_points(holes=0.02)
    density = np.random.default_rng(15).uniform(0, 800, (COUNT, 1)).astype(F)
    better = consensus.shows_better(surface_map, there, K, BAND[0, 0], density[:, 0])
    inputs = {"surface_map": surface_map, "h": there, "k": K[None], "b": BAND, "d": density}
    answer = gpu("consensus.glsl", "float(shows_better(surface_map, h, k, b, d)), 0, 0, 0", **inputs)[:, 0]
    assert (answer == better).mean() > 0.99 and 0.1 < better.mean() < 0.9
    votes_map = np.repeat((np.random.default_rng(16).random((HEIGHT, WIDTH, 1)) < 0.9).astype(F), 4, -1)
    spared = consensus.is_shown_better(votes_map, surface_map, PIXELS, K)
    inputs = {"surface_map": surface_map, "votes_map": votes_map, "p": PIXELS.astype(F), "k": K[None]}
    call = "float(is_shown_better(votes_map, surface_map, ivec2(p), k)), 0, 0, 0"
    answer = gpu("consensus.glsl", call, **inputs)[:, 0]
    assert (answer == spared).mean() > 0.99 and 0.1 < spared.mean() < 0.9


def test_a_point_is_shown_better_by_a_denser_surface_that_goes_on_around_it():
    surface_map = two_planes()
    own = surface_map[9, 4]
    density = consensus.point_density(own[None], np.array([[4, 9]], F), K)
    at = np.array([[4, 9, 1 / own[3]], [EDGE - 0.5, 9, 1 / own[3]]], F)

    def is_better(share):
        return consensus.shows_better(surface_map, at, K, BAND[0, 0], share * density).tolist()

    assert is_better(0.5) == [True, False] and is_better(0.9) == [False, False]  # not beside an edge, nor hardly denser
    votes_map = np.ones((HEIGHT, WIDTH, 4), F)
    votes_map[9, 5] = 0
    spared = consensus.is_shown_better(votes_map, surface_map, np.array([(4, 9), (2, 9)]), K)
    assert spared.tolist() == [False, True]  # what is beside it would be left open


def test_end_vote_and_faces(gpu):
    surface_map, there = carried_points()
    inputs = {"surface_map": surface_map, "h": there, "k": K[None], "b": BAND}
    for is_exact in (False, True):
        votes = consensus.end_vote(surface_map, there, K, BAND[0, 0], is_exact)
        call = f"end_vote(surface_map, h, k, b, {str(is_exact).lower()}), 0, 0, 0"
        close(gpu("consensus.glsl", call, **inputs), votes, missed=0.01)
        assert (votes > 0.9).mean() > 0.1 and (votes < -0.9).mean() > 0.1 and (np.abs(votes) < 0.9).mean() > 0.1
    normal, direction = np.random.default_rng(13).normal(0, 1, (2, COUNT, 3)).astype(F)
    expected = consensus.faces(normal, direction)
    answer = gpu("consensus.glsl", "float(faces(n, d)), 0, 0, 0", n=normal, d=direction)[:, 0]
    assert (answer == expected).mean() > 0.999 and 0.4 < expected.mean() < 0.6


def test_a_frame_says_between_its_pixels_where_a_surface_ends():
    surface_map = two_planes()  # the right one is nearer
    w = 1 / surface_map[9, EDGE, 3]
    beside = np.array([[EDGE - share, 9, w] for share in (0, 0.25, 0.75)], F)
    np.testing.assert_allclose(consensus.end_vote(surface_map, beside, K, BAND[0, 0], False), [1, 0.5, -0.5], atol=1e-5)
    surface_map[:, :EDGE] = 0
    for is_exact, expected in ((True, (1, 0.5, -0.5)), (False, (1, 0.75, 0.25))):  # is nothing where there is no depth?
        votes = consensus.end_vote(surface_map, beside, K, BAND[0, 0], is_exact)
        np.testing.assert_allclose(votes, expected, atol=1e-5)


def test_primary_share(gpu):
    trust = np.repeat(np.array([[consensus.CONTESTED, 1]], F).T, 5, 0)
    for primary in (0.0, 0.3, 0.5, 0.8, 1.0):
        expected = parts.primary_share(primary, trust)
        close(gpu("parts.glsl", f"primary_share({primary}, t), 0, 0, 0", t=trust), expected)
    assert parts.primary_share(0.5, trust[[0, -1], 0]).tolist() == [0, 1]  # what others see through goes first


def test_log_ratio(gpu):
    rng = np.random.default_rng(8)
    a, b, c, d = rng.uniform(0, 1, (4, COUNT, 3)).astype(F)
    expected = consensus.log_ratio(a, b, c, d)
    close(gpu("consensus.glsl", "log_ratio(a, b, c, d), 0", a=a, b=b, c=c, d=d), expected)
    assert 0.6 < (expected < 1e29).mean() < 0.9


def test_surface_ends_and_the_way_to_them(gpu):
    surface_map = two_planes(holes=0.02)
    ends = consensus.surface_ends(surface_map, PIXELS, K).reshape(HEIGHT, WIDTH)
    inputs = {"p": PIXELS.astype(F), "k": K[None]}
    answer = gpu("consensus.glsl", "surface_ends(surface_map, ivec2(p), k)", surface_map=surface_map, **inputs)
    close(answer, ends, missed=1)
    assert ends[:, EDGE - 1 : EDGE + 1].all() and ends.mean() < 0.4
    rows = consensus.end_in_row(ends, PIXELS).reshape(HEIGHT, WIDTH)
    assert (
        gpu("consensus.glsl", "end_in_row(ends_map, ivec2(p))", ends_map=ends, **inputs)[:, 0] == rows.ravel()
    ).all()
    around = consensus.end_around(rows, PIXELS)
    answer = gpu("consensus.glsl", "float(end_around(rows_map, ivec2(p)))", rows_map=rows, **inputs)[:, 0]
    assert (answer == around).all() and set(around) == {0, 1, 2, 3, 4}
    v, u = np.nonzero(ends)
    true = np.minimum(np.maximum(abs(PIXELS[:, None, 0] - u), abs(PIXELS[:, None, 1] - v)).min(1), 4)
    assert (around == true).all()


def test_trust_in(gpu):
    rng = np.random.default_rng(9)
    votes, edge = rng.integers(0, 4, (COUNT, 2)), rng.integers(0, 5, (COUNT, 1))
    border, cosine = rng.integers(1, 40, (COUNT, 1)), rng.uniform(0, 0.5, (COUNT, 1)).astype(F)
    inputs = {"v": votes.astype(F), "e": edge.astype(F), "b": border.astype(F), "c": cosine}
    for is_exact in (True, False):
        expected = consensus.trust_in(votes, edge[:, 0], border[:, 0], cosine[:, 0], is_exact)
        call = f"trust_in(v, int(e), int(b), c, {str(is_exact).lower()}), 0, 0"
        close(gpu("consensus.glsl", call, **inputs), expected)
    assert 0.2 < expected[:, 0].mean() < 0.9


def test_points_are_trusted_by_votes_away_from_edges_and_by_support_beside_them():
    def trusted(support, through, edge, cosine=1.0):
        values = (np.array([x]) for x in ((support, through), edge, 24, cosine))
        return bool(consensus.trust_in(*values)[0, 0])

    assert trusted(0, 0, 4) and trusted(0, 1, 4) and not trusted(0, 1, 1) and not trusted(1, 3, 4)
    assert not trusted(0, 0, 1, cosine=0.1) and trusted(1, 0, 1, cosine=0.1) and trusted(0, 0, 2, cosine=0.1)
    assert not trusted(0, 0, 0) and trusted(1, 0, 0) and trusted(0, 0, 1)
    contested = consensus.trust_in(np.array([(3, 1), (3, 0)]), np.full(2, 4), np.full(2, 24), np.ones(2))[:, 0]
    assert contested[0] == consensus.CONTESTED and contested[1] == 1
    alone = consensus.trust_in(np.zeros((1, 2)), np.zeros(1, int), np.full(1, 24), np.ones(1), is_exact=True)
    assert alone[0, 0] == 1  # where there is no noise, nothing flies
    assert trusted(5, 0, 0, cosine=0.1)  # a thin thing, which others see as well
