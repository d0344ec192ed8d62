"""highlights.glsl: each function is compared with its mirror."""

import numpy as np

from ..reference import highlights
from ..reference.color import linear_to_srgb
from .test_resolve_functions import close
from .test_shader_functions import COUNT, F

GAIN = np.array((0.9, 1.0, 1.2), F)
SIZE = 24


def colors(seed):
    return np.random.default_rng(seed).random((COUNT, 3)).astype(F)


def pixels():
    return np.random.default_rng(5).integers(0, SIZE, (COUNT, 2))


def noise_map(seed, holes=0.1):
    """Two excesses, which are 0 where the third value, whether they are known, is."""
    rng = np.random.default_rng(seed)
    known = rng.random((SIZE, SIZE, 1)) > holes
    return (np.concatenate([rng.uniform(0, 20, (SIZE, SIZE, 2)), np.ones((SIZE, SIZE, 2))], -1) * known).astype(F)


def test_brightness_is_the_mean_of_channels_in_steps(gpu):
    linear = colors(1)
    close(gpu("highlights.glsl", "brightness(c)", c=linear), highlights.brightness(linear), rtol=1e-4)
    np.testing.assert_allclose(highlights.brightness(linear), 255 * linear_to_srgb(linear).mean(-1), rtol=1e-5)


def test_what_others_say_about_a_colour(gpu):
    encoded, own = colors(2), np.random.default_rng(3).uniform(0, 255, (COUNT, 1)).astype(F)
    clipped = highlights.may_be_clipped(encoded)
    assert (
        gpu("highlights.glsl", "float(may_be_clipped(c))", c=encoded)[:, 0] == clipped
    ).all() and 0 < clipped.mean() < 1
    part = highlights.darker_part(encoded, GAIN)
    close(gpu("highlights.glsl", "darker_part(c, g)", c=encoded, g=GAIN[None]), part, rtol=2e-3, atol=1e-9)
    assert not part[clipped].any() and (part[~clipped, 3] > 0).all()
    vote = highlights.brightness_vote(encoded, GAIN, own[:, 0])
    close(gpu("highlights.glsl", "brightness_vote(c, g, o)", c=encoded, g=GAIN[None], o=own), vote, atol=2e-2)
    assert not vote[clipped, 0].any() and vote[clipped, 1].any() and (vote[:, :2].sum(-1) <= 1).all()


def test_the_darkest_of_others_counts_most():
    parts = highlights.darker_part(np.array([(0.3, 0.3, 0.3), (0.5, 0.5, 0.5)], F), np.ones(3, F))
    total = parts.sum(0)
    assert abs(highlights.brightness(total[:3] / total[3]) - 0.3 * 255) < 1


def test_an_excess_needs_two_others_and_that_enough_of_them_agree(gpu):
    rng = np.random.default_rng(4)
    total = (highlights.darker_part(colors(6), GAIN) * rng.integers(0, 2, (COUNT, 1))).astype(F)
    count = rng.integers(1, 6, (COUNT, 1)).astype(F)
    votes = np.concatenate([count * rng.random((COUNT, 2)), rng.uniform(0, 90, (COUNT, 1)), count], -1).astype(F)
    own = rng.uniform(0, 255, (COUNT, 1)).astype(F)
    found = highlights.excess_over(total, votes, own[:, 0])
    close(gpu("highlights.glsl", "excess_over(s, v, o), 0", s=total, v=votes, o=own), found, atol=2e-2, missed=2)
    assert not found[count[:, 0] == 1].any() and (found[count[:, 0] > 1, 2] == 1).all()
    part = 4 * highlights.darker_part(np.full(3, 0.3, F), np.ones(3, F))
    by_votes = [highlights.excess_over(part, np.array((k, 0, 0, 4), F), np.array(100.0, F))[0] for k in range(5)]
    assert by_votes[:2] == [0, 0] and min(by_votes[2:]) > 20


def test_the_excess_around_a_pixel_counts_less_where_it_is_rough(gpu):
    excess, pixel = noise_map(7), pixels()
    rows = highlights.excess_in_row(excess, pixel)
    inputs = {"excess_map": excess, "p": pixel.astype(F)}
    close(gpu("highlights.glsl", "excess_in_row(excess_map, ivec2(p))", **inputs), rows, rtol=1e-5)
    rows_map = np.abs(np.random.default_rng(8).normal(0, 9, (SIZE, SIZE, 4))).astype(F)
    rows_map[:12, :12] = 0
    around = highlights.excess_around(rows_map, pixel)
    inputs = {"rows_map": rows_map, "p": pixel.astype(F)}
    close(gpu("highlights.glsl", "excess_around(rows_map, ivec2(p)), 0", **inputs), around, rtol=1e-4, atol=1e-4)
    assert not around[(pixel < 8).all(-1)].any() and (around[:, 2] == 1).mean() > 0.5

    def middle(excess):
        grid = np.stack(np.meshgrid(np.arange(SIZE), np.arange(SIZE)), -1)
        return highlights.excess_around(highlights.excess_in_row(excess, grid), np.array((12, 12)))[0]

    smooth, rough = np.zeros((2, SIZE, SIZE, 4), F)
    smooth[..., 0], rough[..., 0] = 10, 20 * (np.indices((SIZE, SIZE)).sum(0) % 2)
    smooth[..., 2] = rough[..., 2] = 1
    assert middle(smooth) == 10 and middle(rough) < 0


def test_share_and_found_at(gpu):
    rng = np.random.default_rng(9)
    excess, noise = rng.uniform(-5, 30, (COUNT, 1)).astype(F), rng.uniform(1.5, 9, (COUNT, 1)).astype(F)
    share = highlights.highlight_share(excess, noise)[:, 0]
    close(gpu("highlights.glsl", "highlight_share(e, n)", e=excess, n=noise), share, atol=1e-4)
    assert (share == 0).any() and (share == 1).any()
    found, at = rng.random((SIZE, SIZE, 4)).astype(F), rng.uniform(-1, SIZE, (COUNT, 2)).astype(F)
    close(gpu("highlights.glsl", "found_at(f_map, a)", f_map=found, a=at), highlights.found_at(found, at), atol=1e-5)
