"""Which of several frames has a wrong pose: by values, and by traced frames and the notes on them."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.agreement import contradictions
from pointshade_gl.estimation.multi_view import Comparison, compared

from ..support import frames
from ..support.view_sets import noisy, pose_at, replaced, seen_from

NONE = np.full(3, np.nan)
FIT, OFF = Comparison(0.002, NONE, 0.02), Comparison(0.03, NONE, 0.6)


def found(count, *off):
    """Of frames that fit each other in pairs, but for these."""
    pairs = {(i, j): FIT for i in range(count) for j in range(count) if i != j}
    return contradictions(pairs | {way: OFF for i, j in off for way in ((i, j), (j, i))}, count)


class TestGroups:
    def test_frames_that_fit_each_other_are_all_right(self):
        assert found(5) == (frozenset(), False)
        assert contradictions({}, 3) == (frozenset(), False)

    def test_one_against_all_others_is_wrong(self):
        assert found(5, (0, 2), (1, 2), (2, 3), (2, 4)) == ({2}, False)
        assert found(3, (0, 1), (0, 2)) == ({0}, False)

    def test_two_against_three_are_wrong_whether_they_fit_each_other_or_not(self):
        against = [(i, j) for i in (1, 3) for j in (0, 2, 4)]
        assert found(5, *against) == found(5, *against, (1, 3)) == ({1, 3}, False)

    def test_of_two_and_of_two_pairs_nobody_knows_which_are_wrong(self):
        assert found(2, (0, 1)) == (frozenset(), True)
        assert found(4, (0, 2), (0, 3), (1, 2), (1, 3)) == (frozenset(), True)

    def test_a_frame_that_fits_one_other_is_not_wrong(self):
        """Poses drift: the first frame may contradict the last."""
        assert found(4, (0, 3), (0, 2)) == (frozenset(), False)

    def test_frames_that_see_something_else_have_no_say(self):
        pairs = {(0, 1): FIT, (2, 3): FIT, (0, 2): Comparison(np.inf, NONE), (3, 1): Comparison(np.inf, NONE)}
        assert contradictions(pairs, 4) == (frozenset(), False)

    @pytest.mark.parametrize(("spread", "named"), [(0.002, frozenset()), (0.01, {2})])
    def test_what_moves_in_a_part_of_the_picture_makes_no_pose_wrong(self, spread, named):
        pairs = {(i, j): FIT for i in range(3) for j in range(3) if i != j}
        pairs |= {pair: Comparison(spread, NONE, 0.2) for pair in pairs if 2 in pair}
        assert contradictions(pairs, 3).frames == named

    def test_what_another_frame_hides_does_not_count(self):
        samples = np.zeros((300, 4), np.float32)
        samples[:150, 0], samples[150:200, 0] = -0.3, 0.3
        assert compared(samples).apart == pytest.approx(1 / 3)
        samples[:280, 0] = -0.3
        assert np.isnan(compared(samples).apart)


TURNS = {"turned aside": (0, 10), "turned up": (10, 0)}


def wrong(view, how):
    if how in TURNS:
        pitch, yaw = TURNS[how]
        return replaced(view, pose=ps.orbit_pose(view.pose, view.pose[:3, 3], yaw, pitch))
    return replaced(
        view, pose=view.pose @ _shift(*{"near": (0, 0, 0.2), "aside": (0.2, 0, 0), "far": (0, 0, 0.6)}[how])
    )


def _shift(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def notes(capsys, views, **options):
    """What a new renderer says of them."""
    capsys.readouterr()
    with ps.Renderer() as fresh:
        fresh.render(views, camera=frames.CAMERA, **options)
    return [line.removeprefix("note: ") for line in capsys.readouterr().err.splitlines()]


@pytest.fixture(scope="module")
def five():
    return [noisy(seen_from(pose_at(yaw, yaw / 4)), yaw) for yaw in range(0, 41, 10)]


class TestNotes:
    def test_nothing_is_said_of_good_poses(self, renderer, five, capsys):
        assert notes(capsys, five) == notes(capsys, five[:2]) == notes(capsys, five[::4]) == []

    @pytest.mark.parametrize("how", ["near", "aside", "far", *TURNS])
    @pytest.mark.parametrize("bad", [0, 3])
    def test_one_of_five_is_named(self, renderer, five, how, bad, capsys):
        views = [wrong(view, how) if k == bad else view for k, view in enumerate(five)]
        (said,) = notes(capsys, views)
        assert said.startswith(f"frame {bad} of 5 contradicts the others")

    @pytest.mark.parametrize("how", ["near", *TURNS])
    def test_one_of_three_is_named(self, renderer, five, how, capsys):
        (said,) = notes(capsys, [five[0], wrong(five[1], how), five[2]])
        assert said.startswith("frame 1 of 3 contradicts the others")

    def test_of_two_both_are(self, renderer, five, capsys):
        (said,) = notes(capsys, [five[0], wrong(five[1], "near")])
        assert said == "the 2 frames contradict each other where they see the same: are their poses right?"

    def test_missing_poses_are_told_once_and_the_same_frame_twice_is_no_news(self, renderer, five, capsys):
        without = [replaced(view, pose=None) for view in five[:3]]
        (said,) = notes(capsys, without)
        assert said.startswith("the 3 frames all have the same pose")
        assert notes(capsys, [five[0], five[0]]) == []
        with ps.Renderer() as fresh:
            fresh.render(without)
            fresh.render(without, yaw=3)
            fresh.render([*without[:2], replaced(without[2])])
        assert capsys.readouterr().err.count("same pose") == 1

    def test_a_live_set_says_it_once_and_another_set_again(self, renderer, five, capsys):
        with ps.Renderer() as fresh:
            for _ in range(3):
                fresh.render([*five[:3], wrong(five[3], "near")])
            assert capsys.readouterr().err.count("frame 3 of 4 contradicts") == 1
            fresh.render(five[:4])
            assert capsys.readouterr().err == ""
            fresh.render([*five[:3], wrong(five[3], "near")])
            assert capsys.readouterr().err.count("frame 3 of 4 contradicts") == 1
            others = [replaced(view) for view in five[:3]]
            fresh.render([*others, wrong(five[3], "aside")])
            assert capsys.readouterr().err.count("frame 3 of 4 contradicts") == 1


def test_a_wrong_frame_changes_the_picture_only_where_no_other_sees(renderer, five):
    options = {"camera": frames.CAMERA, "pose": pose_at(5), "shading": "none"}
    without = renderer.render([five[0], *five[2:]], **options).astype(int)
    image = renderer.render([five[0], wrong(five[1], "aside"), *five[2:]], **options).astype(int)
    seen = (without[..., 3] > 0) & (image[..., 3] > 0)
    assert (image[without[..., 3] > 0][:, 3] > 0).all()
    assert (np.abs(image - without)[seen].max(-1) > 12).mean() < 0.03
