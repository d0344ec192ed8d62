"""Highlights in several views of one thing: they move from view to view, and what others show lies under them."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import decode, encode

from ..support.glossy_views import errors_of, glossy_views

SIZE = 256, 192


@lru_cache
def views(seed=1, matt=False):
    return views(seed).with_frames(glossy_views(seed, SIZE, True).frames) if matt else glossy_views(seed, SIZE)


def unlit(renderer, frames, **options):
    return renderer.render(frames, shading="none", **options)


def brighter(frame, factor):
    color = encode(np.clip(decode(frame.color.astype(float)) * factor, 0, 1))
    return replace(frame, color=np.round(color).astype(np.uint8))


class TestTraced:
    @pytest.mark.parametrize("seed", [1, 2, 3])
    def test_highlights_of_five_noisy_views_are_taken_out(self, renderer, seed):
        before = errors_of(renderer, views(seed))
        after = errors_of(renderer, views(seed), remove_highlights=True)
        assert before[0] > 25 and after[0] < 5 and after[1] < before[1] + 0.05, (before, after)

    @pytest.mark.parametrize("seed", [1, 2, 3])
    def test_matt_things_stay(self, renderer, seed):
        before = errors_of(renderer, views(seed, matt=True))
        after = errors_of(renderer, views(seed, matt=True), remove_highlights=True)
        assert abs(after[0] - before[0]) < 0.05 and abs(after[1] - before[1]) < 0.05, (before, after)

    def test_exposures_that_differ_do_not_matter(self, renderer):
        glossy, matt = (
            one.with_frames(list(map(brighter, one.frames, (1.1, 0.85, 0.95, 1.15, 0.9))))
            for one in (views(), views(matt=True))
        )
        assert errors_of(renderer, glossy, remove_highlights=True)[0] < errors_of(renderer, glossy)[0] / 4
        before, after = errors_of(renderer, matt), errors_of(renderer, matt, remove_highlights=True)
        assert abs(after[0] - before[0]) < 0.1 and abs(after[1] - before[1]) < 0.1, (before, after)

    def test_colours_that_lie_beside_their_depth_are_no_highlights(self, renderer):
        def shifted(frame, by):
            return replace(frame, color=np.roll(frame.color, by, 1))

        frames = list(map(shifted, views(matt=True).frames, (5, -6, 4, -5, 6)))
        one, other = (unlit(renderer, frames, remove_highlights=on)[..., :3].astype(int) for on in (False, True))
        assert np.abs(one - other).mean() < 0.5

    @pytest.mark.parametrize("options", [{"shading": "gouraud"}, {"shading": "flat"}, {"unlight": True}])
    def test_every_shading_shows_it(self, renderer, options):
        before, after = (renderer.render(views().frames, **options, remove_highlights=on) for on in (False, True))
        assert (np.abs(before[..., :3].astype(int) - after[..., :3]).mean(-1) > 5).sum() > 50


class TestFewerViews:
    def test_what_one_view_alone_sees_keeps_its_colours(self, renderer):
        _, second, third, fourth, _ = views().frames
        depth = np.zeros_like(third.depth)
        depth[:, :10] = third.depth[:, :10]
        others = [replace(frame, depth=depth) for frame in (second, fourth)]
        before, after = (unlit(renderer, [third, *others], remove_highlights=on) for on in (False, True))
        assert (before[:, 40:] == after[:, 40:]).all()

    @pytest.mark.parametrize("count", [1, 2])
    def test_too_few_views_keep_theirs_and_a_note_says_what_is_missing(self, renderer, capsys, count):
        frames = views().frames[:count]
        frames = [ps.Frame(f.color, f.depth, f.camera, f.pose) for f in frames]  # of which no note was given
        shown = frames if count > 1 else frames[0]
        before, after = (unlit(renderer, shown, remove_highlights=on) for on in (False, True))
        assert (before == after).all()
        assert capsys.readouterr().err.count("note: remove_highlights needs 3 or more views of one object") == 1

    def test_it_runs_once_for_a_set_and_costs_nothing_unless_it_is_asked_for(self, renderer):
        frames = views(2).frames
        unlit(renderer, frames)
        before = renderer.steps.counts["matte"]
        unlit(renderer, frames)
        assert renderer.steps.counts["matte"] == before
        for pose in (frames[0].pose, frames[1].pose):
            unlit(renderer, frames, pose=pose, remove_highlights=True)
        assert renderer.steps.counts["matte"] == before + 5

    def test_a_larger_colour_picture_keeps_its_size(self, renderer):
        large = glossy_views(1, (400, 300))
        frames = [ps.Frame(f.color, f.depth[::2, ::2], f.camera.resized(200, 150), f.pose) for f in large.frames]
        pose = frames[2].pose
        before, after = (
            unlit(renderer, frames, camera=large.camera, pose=pose, remove_highlights=on)[..., :3].astype(int).mean(-1)
            for on in (False, True)
        )
        assert (before - after > 20).sum() > 200 and np.abs(before - after).mean() < 1


class TestAsked:
    def test_typed(self, typed):
        code, _, said = typed("render vase -o a.png --remove-highlights")
        assert code == 0 and "--remove-highlights needs 3 or more views" in said

    def test_a_wrong_value_is_named(self, renderer):
        with pytest.raises(TypeError, match="remove_highlights must be True or False, got 'no'"):
            renderer.render(views().frames, remove_highlights="no")
