"""The shadows of a pattern beside near objects: the baseline that they tell, and which surfaces they may hide."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere, trace, waves
from pointshade_gl.estimation.stereo_shadows import find_shifts, hidden_below

from ..support import frames
from ..support.pattern_shadow import shadow

CAMERA = ps.Camera(262.0, 262.0, 159.5, 119.5, 320, 240)
SEEDS = range(6)


def balls(seed):
    """(h, w) metres: three balls before a slanted wall."""
    rng = np.random.default_rng(seed)
    low, high = (-0.5, -0.35, 1.0), (0.5, 0.35, 1.5)
    things = [sphere(rng.uniform(low, high), rng.uniform(0.08, 0.2), waves) for _ in range(3)]
    return trace([*things, plane((0.15, -0.1, -1), (0, 0, 2.4), waves)], CAMERA).depth.astype(np.float32)


def lost(depth, *baselines):
    """The depth without what eyes so far to the right, or to the left if negative, do not see; and what that is."""
    sides = [np.s_[:, :: 1 if baseline > 0 else -1] for baseline in baselines]
    pairs = zip(sides, baselines, strict=True)
    hidden = np.any([shadow(depth[side], CAMERA.fx * abs(one))[side] for side, one in pairs], 0)
    return np.where(hidden, 0, depth).astype(np.float32), hidden


@pytest.mark.parametrize("baseline", [0.06, 0.075, 0.1])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_baseline_is_found(seed, baseline):
    left, right = find_shifts(lost(balls(seed), baseline)[0], CAMERA.fx)
    assert left == pytest.approx(CAMERA.fx * baseline, rel=0.05) and right == 0


def test_a_mirrored_picture_swaps_the_sides():
    depth, _ = lost(balls(1), 0.06, -0.09)
    left, right = find_shifts(depth, CAMERA.fx)
    assert (left, right) == pytest.approx((CAMERA.fx * 0.06, CAMERA.fx * 0.09), rel=0.05)
    np.testing.assert_array_equal(find_shifts(depth[:, ::-1], CAMERA.fx), (right, left))
    mirrored = hidden_below(depth[:, ::-1], (right, left))[:, ::-1]
    np.testing.assert_allclose(mirrored, hidden_below(depth, (left, right)), rtol=1e-4)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("baselines", [(0.06,), (-0.1,), (0.06, -0.09)], ids=str)
def test_what_is_hidden_is_never_called_seen(seed, baselines):
    depth = balls(seed)
    left, hidden = lost(depth, *baselines)
    limit = hidden_below(left, find_shifts(left, CAMERA.fx))
    assert hidden.sum() > 300 and (limit[hidden] > 0).all()
    assert (1 / depth[hidden] <= limit[hidden]).all()
    assert (limit[hidden] < 1 / 0.7).all()  # something nearer than all balls would have been seen
    assert (limit[hidden] < 1 / 1.5).mean() > 0.2  # and much of what is no farther than they are


@pytest.mark.parametrize("seed", SEEDS)
def test_frames_without_shadows_have_no_baseline(seed):
    """As they are, with single pixels or round patches missing, or with rows cut off."""
    depth, rng = balls(seed), np.random.default_rng(seed)
    v, u = np.indices(depth.shape)
    places = rng.uniform((0, 0), depth.shape, (25, 2))
    patches = np.any([np.hypot(v - y, u - x) < rng.uniform(3, 12) for y, x in places], 0)
    for missing in (np.zeros_like(patches), rng.random(depth.shape) < 0.3, patches, v < 60, u < 60):
        assert find_shifts(np.where(missing, np.float32(0), depth), CAMERA.fx) == (0, 0)


def test_a_baseline_that_no_camera_has_is_not_believed():
    depth, _ = lost(balls(0), 0.2)
    assert find_shifts(depth, CAMERA.fx) == (0, 0)
    assert find_shifts(lost(balls(0), 0.06)[0], 10 * CAMERA.fx) == (0, 0)  # the same shadows in a tele lens


def test_a_few_runs_are_not_believed():
    depth, _ = lost(balls(2), 0.06)
    depth[:, :] = np.where(np.arange(240)[:, None] % 60 == 30, depth, 0)
    assert find_shifts(depth, CAMERA.fx) == (0, 0)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (3, 5)])
def test_the_smallest_pictures(shape):
    for depth in (np.zeros(shape, np.float32), np.ones(shape, np.float32)):
        assert find_shifts(depth, 100.0) == (0, 0)
        assert hidden_below(depth, (5.0, 3.0)).shape == shape


def test_depths_of_every_magnitude_cause_no_warnings():
    rng = np.random.default_rng(3)
    depth = rng.choice([1e-38, 1e-40, 1e-10, 1, 1e10, 1e30, 3e38], (60, 60)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.6] = 0
    assert len(find_shifts(depth, 100.0)) == 2
    assert not np.isnan(hidden_below(depth, (5.0, 3.0))).any()


def test_without_shadows_nothing_is_hidden():
    assert not hidden_below(frames.holes().depth, (0.0, 0.0)).any()
