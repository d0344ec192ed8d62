"""`progress`: it is told of each step, and ends the work where it returns False or raises; nothing is half-done."""

from functools import partial

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.checks.arguments import Count
from pointshade_gl.renderer.series import jobs_of, write_series

from ..support import frames, view_sets


def ending(at, how=False):
    """A `progress` that ends the work at a step: it returns `how`, or raises it. And what it was told."""
    told = []

    def progress(done, all):
        told.append((done, all))
        if len(told) == at and isinstance(how, BaseException):
            raise how
        return how if len(told) == at else None

    return progress, told


@pytest.fixture(scope="module")
def views():
    """Three frames of one thing."""
    return view_sets.three_views()


@pytest.mark.parametrize(
    ("options", "steps"), [({}, 1), ({"samples": 5}, 5), ({"samples": 3, "ground": True}, 3), ({"splat": "mesh"}, 1)]
)
def test_samples_are_the_steps_of_a_picture(renderer, options, steps):
    progress, told = ending(0)
    renderer.render(frames.sphere(), **options, progress=progress)
    assert told == [(k + 1, steps) for k in range(steps)]
    assert all(type(number) is int for call in told for number in call)


def test_samples_that_are_there_already_are_one_step(renderer):
    frame = frames.sphere()
    renderer.render(frame, samples=4)
    progress, told = ending(0)
    renderer.render(frame, samples=7, progress=progress)
    assert told == [(4, 7), (5, 7), (6, 7), (7, 7)]


def test_merged_frames_are_steps_too(renderer, views):
    progress, told = ending(0)
    with ps.Renderer() as made:  # which has drawn nothing of them before: what is there is no step
        made.render(views, samples=2, progress=progress)
    assert told == [(k + 1, 8) for k in range(8)]
    progress, told = ending(0)
    renderer.render_depth(views, progress=progress)
    assert told[-1] == (7, 7) and [done for done, _ in told] == sorted({done for done, _ in told})


@pytest.mark.parametrize(
    ("at", "how"),
    [
        *((1, False), (3, ValueError("mine")), (4, np.False_), (6, KeyboardInterrupt())),
        *((7, False), (7, ValueError("mine")), (9, np.False_), (9, KeyboardInterrupt())),
    ],
)
def test_a_renderer_goes_on_after_any_step(renderer, views, at, how):
    """The next picture is what it would have been, and nothing stays on the GPU of the one that was not finished."""
    expected = renderer.render(views, samples=3)
    lamp = ps.Light((1, -2, 0))
    with ps.Renderer() as other:
        other.render(frames.sphere())  # another picture, which is forgotten
        progress, told = ending(at, how)
        error = type(how) if isinstance(how, BaseException) else ps.Cancelled
        with pytest.raises(error):
            other.render(views, samples=3, progress=progress)
        assert told[-1] == (at, 9)
        other.explain()  # reads nothing that was freed
        assert np.array_equal(other.render(views, samples=3), expected)
        assert np.array_equal(other.render(views, lamp), renderer.render(views, lamp))


@pytest.mark.parametrize("answer", [None, True, 0, "", 0.0])
def test_only_false_ends_it(renderer, answer):
    assert renderer.render(frames.sphere(), samples=2, progress=lambda done, all: answer).any()


def test_the_error_says_how_far_it_came(renderer):
    with pytest.raises(ps.Cancelled, match="cancelled after 2 of 4 steps: progress returned False"):
        renderer.render(frames.sphere(), samples=4, progress=ending(2)[0])
    with pytest.raises(TypeError, match="progress must be a function, got 3"):
        renderer.render(frames.sphere(), progress=3)


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("at", [1, 2, 3, 4, 5])
def test_a_page_is_written_whole_or_not_at_all(tmp_path, views, at):
    write = partial(ps.save_page, tmp_path / "a.html", views[:2])
    with pytest.raises(ps.Cancelled):
        write(progress=ending(at)[0])
    assert not list(tmp_path.iterdir())
    progress, told = ending(0)
    write(progress=progress)
    assert told[-1] == (6, 6) and (tmp_path / "a.html").stat().st_size


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "%d.png"])
def test_a_film_that_is_cancelled_leaves_nothing_half_written(renderer, tmp_path, name):
    if name == "a.mp4":
        pytest.importorskip("imageio_ffmpeg")
    shots, count = jobs_of(frames.sphere(), ps.View(), "light", 6, print)
    progress, told = ending(3)
    with pytest.raises(ps.Cancelled):
        write_series(renderer, shots, tmp_path / name, 25, progress, count)
    assert told == [(1, 6), (2, 6), (3, 6)]
    left = sorted(path.name for path in tmp_path.iterdir())
    assert left == (["0.png", "1.png", "2.png"] if name == "%d.png" else [])
    assert renderer.render(frames.sphere()).any()


@pytest.mark.usefixtures("renderer")
def test_map_tells_how_many_pictures_there_will_be():
    progress, told = ending(0)
    assert len(list(ps.batch.map([frames.sphere()] * 3, workers=1, progress=progress))) == 3
    assert told == [(1, 3), (2, 3), (3, 3)]
    progress, told = ending(2)
    pictures = ps.batch.map((frames.sphere() for _ in range(3)), workers=1, progress=progress)
    assert next(pictures).any()
    with pytest.raises(ps.Cancelled):
        next(pictures)
    assert list(pictures) == [] and [done for done, _ in told] == [1, 2]


def test_what_is_counted_may_become_more():
    progress, told = ending(0)
    count = Count(progress)
    for all in (2, 3):
        count.all = all
        count.step()
    assert told == [(1, 2), (2, 3)]
