"""How frames of one thing are weighed: values only, without a GPU."""

import numpy as np
import pytest

from pointshade_gl.estimation import multi_view as consensus
from pointshade_gl.estimation.multi_view import Comparison

from ..support.view_sets import pose_at, seen_from

NONE = np.full(3, np.nan)


def pairs_of(spreads):
    return {pair: Comparison(spread, NONE) for pair, spread in spreads.items()}


def test_the_band_follows_the_spread_within_its_bounds():
    assert consensus.band_of({}) == consensus.NARROWEST
    assert consensus.band_of(pairs_of({(0, 1): 0.004, (1, 0): 0.004, (0, 2): np.inf})) == pytest.approx(0.012)
    assert consensus.band_of(pairs_of({(0, 1): 0.3})) == consensus.WIDEST
    assert consensus.band_of(pairs_of({(0, 1): 1e-6})) == consensus.NARROWEST
    assert consensus.band_of(pairs_of({(0, 1): 1e-6}), None, consensus.FINEST) == consensus.FINEST


def test_gains_make_overlaps_equally_bright_and_keep_the_mean():
    exposures = np.log([[1, 1, 1], [1.2, 1.1, 1], [0.8, 1, 1.3]])
    known = {(i, j): Comparison(0.001, exposures[i] - exposures[j]) for i, j in ((0, 1), (1, 2), (2, 0))}
    logs = np.log(consensus.gains_of(known, 3)) + exposures
    assert np.ptp(logs, axis=0) == pytest.approx(0, abs=1e-9)
    assert np.log(consensus.gains_of(known, 3)).mean(0) == pytest.approx(0, abs=1e-9)


def test_gains_of_equal_exposures_and_of_unknown_ones_are_1():
    assert (consensus.gains_of({(0, 1): Comparison(0.001, np.full(3, 0.005))}, 3) == 1).all()
    assert (consensus.gains_of(pairs_of({(0, 1): 0.001}), 2) == 1).all()


def test_a_frame_without_overlap_keeps_its_exposure():
    gains = consensus.gains_of({(0, 1): Comparison(0.001, np.full(3, 0.4)), (0, 2): Comparison(np.inf, NONE)}, 3)
    assert gains[2] == pytest.approx(1) and gains[0] == pytest.approx(np.exp(-0.2))


def test_samples_of_other_surfaces_and_clipped_colours_do_not_count():
    rng = np.random.default_rng(1)
    samples = np.full((300, 4), 1e30, np.float32)
    samples[:200, 0] = rng.normal(0, 0.002, 200)
    samples[200:250, 0] = 0.5
    samples[:200, 1] = rng.normal(0.3, 0.01, 200)
    found = consensus.compared(samples)
    assert found.spread == pytest.approx(0.002, rel=0.15) and found.log_ratios[0] == pytest.approx(0.3, abs=0.01)
    assert np.isnan(found.log_ratios[1:]).all()
    assert consensus.compared(samples[200:]).spread == np.inf


def test_a_highlight_must_be_brighter_than_the_frame_is_darker_elsewhere():
    rng, samples = np.random.default_rng(1), np.zeros((1000, 4), np.float32)
    assert consensus.excess_noise(samples) == consensus.LEAST_EXCESS
    samples[:, 0], samples[:, 1], samples[:, 2] = 200, rng.uniform(0, 20, 1000), 1
    assert consensus.excess_noise(samples) == pytest.approx(19.8, abs=0.2)
    samples[:500, 1:3] = 90, 0  # not known
    assert consensus.excess_noise(samples) < 20


def test_a_band_that_is_nearly_right_stays():
    some = pairs_of({(0, 1): 0.0041, (1, 0): 0.0041})
    assert consensus.band_of(some) == 0.012 and consensus.band_of(some, 0.0125) == 0.0125
    assert consensus.band_of(some, 0.02) == 0.012


@pytest.fixture(scope="module")
def frames():
    return [seen_from(pose_at(yaw)) for yaw in range(-20, 21, 5)]


class TestPrimaryViews:
    def test_the_nearest_carry_the_picture_and_the_farthest_nearly_nothing(self, frames):
        weights = consensus.importances(frames, frames[4].pose)
        assert (weights[3:6] == 1).all() and weights[0] == weights[8] == pytest.approx(consensus.FAINT)

    def test_all_of_a_few_are_primary(self, frames):
        assert (consensus.importances(frames[: consensus.PRIMARY], pose_at(90)) == 1).all()

    def test_of_frames_without_noise_all_are_but_where_one_looks_from_the_place_of_one(self, frames):
        assert (consensus.importances(frames, pose_at(90), is_exact=True) == 1).all()
        weights = consensus.importances(frames, frames[4].pose, is_exact=True)
        assert weights[4] == 1 and (np.delete(weights, 4) == consensus.FAINT).all()
        wrong = consensus.importances(frames, frames[4].pose, frozenset([4]), is_exact=True)
        assert wrong[4] == 0 and wrong.max() == 1

    def test_weights_change_smoothly_along_a_path(self, frames):
        path = np.array([consensus.importances(frames, pose_at(yaw)) for yaw in np.arange(-20, 20, 0.1)])
        assert np.abs(np.diff(path, axis=0)).max() < 0.08
        assert np.ptp(path, axis=0).min() > 0.9
        path = [consensus.importances(frames[::4], pose_at(y), is_exact=True) for y in np.arange(-20, 20, 0.1)]
        assert np.abs(np.diff(path, axis=0)).max() < 0.08

    def test_a_view_comes_and_goes_splat_by_splat(self, frames):
        path = [consensus.importances(frames, pose_at(yaw)) for yaw in np.arange(-20, 20, 0.05)]
        shares = np.array([consensus.primary_shares(weights) for weights in path])
        assert np.abs(np.diff(shares, axis=0)).max() < 0.15
        assert ((shares == 1).sum(1) >= consensus.PRIMARY).all() and (shares > 0).sum(1).max() <= consensus.PRIMARY + 2

    def test_each_is_compared_with_those_that_stand_nearest(self, frames, monkeypatch):
        monkeypatch.setattr(consensus, "COMPARED", 2)
        others = consensus.nearest_others(frames)
        assert sorted(others[4]) == [3, 5] and sorted(others[0]) == [1, 2]
