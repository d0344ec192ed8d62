"""A network gives each picture of a film its own scale: one is found for all, from what does not change."""

import numpy as np
import pytest

from pointshade_gl.files.depth.scale_over_time import FrameScale

from ..support.network_films import film


def followed(made, **options):
    """The lines of a film's pictures, and the numbers of those that begin a shot."""
    scale = FrameScale(**options)
    lines = [scale.of(raw.astype(np.float32), color) for raw, color in zip(made.raw, made.colors, strict=True)]
    return lines, tuple(k for k, line in enumerate(lines) if line.is_first)


def errors(made, lines):
    """(n, 3) of all, the nearest and the farthest fifth: how far inverse depth is off, if the first picture's is right.

    The law of a shot's first picture is found from the truth.
    """
    found = []
    for raw, z, line in zip(made.raw, made.depth, lines, strict=True):
        values = line.a * raw + line.b
        if line.is_first:
            a, b = np.polyfit((1 / z).ravel(), values.ravel(), 1)
        ratios, inverse = (values - b) / a * z, 1 / z
        parts = np.ones_like(z, bool), inverse > np.percentile(inverse, 80), inverse < np.percentile(inverse, 20)
        found.append([abs(np.median(ratios[part]) - 1) for part in parts])
    return np.array(found)


MOTIONS = ("still", "slide", "turn", "crop")
FRAMES = {"still": 16, "slide": 16, "turn": 12, "crop": 12}


@pytest.mark.parametrize(
    ("seed", "kind"), [pytest.param(21, "affine", marks=pytest.mark.system), (21, "8bit"), (22, "minmax")]
)
@pytest.mark.parametrize("motion", MOTIONS)
def test_every_picture_has_the_scale_of_the_first(seed, motion, kind):
    made = film(seed, motion, FRAMES[motion], kind=kind)
    lines, shots = followed(made)
    off = errors(made, lines)
    assert shots == (0,)
    assert np.median(off, axis=0).max() <= 0.01 and off.max() <= 0.04, off.max(axis=0)


@pytest.mark.parametrize(
    ("motion", "frames", "cut"),
    [
        ("still", 12, 5),
        ("turn", 14, 7),
        *(pytest.param(one, 12, 5, marks=pytest.mark.system) for one in ("slide", "crop")),
    ],
)
def test_a_cut_begins_a_shot_with_a_scale_of_its_own(motion, frames, cut):
    made = film(23, motion, frames, cut=cut)
    lines, shots = followed(made)
    off = errors(made, lines)
    assert shots == made.shots and off.max() <= 0.04


def test_a_pan_there_and_back_ends_where_it_began():
    there = film(24, "turn", 10, hand=False)
    order = [*range(10), *range(8, -1, -1)]
    scale, again = FrameScale(), FrameScale()
    both = [scale.of(there.raw[k].astype(np.float32), there.colors[k]) for k in order]
    begun = [again.of(there.raw[k].astype(np.float32), there.colors[k]) for k in order[:4]]
    assert both[-1].a == pytest.approx(1, rel=0.01) and both[:4] == begun


def test_pictures_without_colours_agree_by_their_values():
    made = film(25, "still", 10)
    scale = FrameScale()
    lines = [scale.of(raw, None) for raw in made.raw]
    assert errors(made, lines).max() <= 0.04


def test_depth_that_is_missing_does_not_vote():
    made = film(26, "still", 8, hand=False)
    made.raw[:, :80] = np.nan
    made.raw[3, 100:200, :100] = np.inf
    lines, _ = followed(made)
    whole = film(26, "still", 8, hand=False)
    assert errors(whole, lines).max() <= 0.04


@pytest.mark.parametrize("values", [np.full((48, 64), np.nan), np.zeros((48, 64)), np.full((3, 2), 1.0), np.eye(1)])
def test_pictures_that_show_nothing_end_in_a_line_all_the_same(values):
    scale = FrameScale()
    colors = np.zeros((*values.shape, 3), np.uint8)
    for _ in range(3):
        line = scale.of(values.astype(np.float32), colors)
        assert np.isfinite([line.a, line.b]).all() and line.a > 0


@pytest.mark.parametrize("noise", [0, 0.02])
@pytest.mark.parametrize("motion", MOTIONS)
def test_metres_that_do_not_breathe_are_not_changed_by_a_bit(motion, noise):
    made = film(27, motion, 10, noise=noise)
    rng = np.random.default_rng(0)
    made.raw = made.depth * (1 + rng.normal(0, noise, made.depth.shape))
    lines, _ = followed(made, is_metric=True)
    assert all(line[:2] == (1, 0) for line in lines)


def test_metres_that_breathe_are_steadied():
    made = film(28, "still", 12)
    breath = np.random.default_rng(0).uniform(0.92, 1.08, 12)
    made.raw = made.depth * breath[:, None, None]
    lines, _ = followed(made, is_metric=True)
    left = [line.a * one for line, one in zip(lines, breath, strict=True)]
    assert np.abs(np.array(left) / left[0] - 1).max() <= 0.005
