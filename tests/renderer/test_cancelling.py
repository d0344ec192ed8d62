"""Long work, whatever it is: told of in steps that only rise, ended by False or an error at any, whole or not there."""

import threading
from functools import partial
from itertools import cycle

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.renderer.series import jobs_of, write_series

from ..support import frames
from ..support.posed_views import corner, disturbed, views


def small(frame):
    """Every second pixel of a frame."""
    camera = frame.camera.resized(frame.camera.width // 2, frame.camera.height // 2)
    return ps.Frame(frame.color[::2, ::2], frame.depth[::2, ::2], camera, frame.pose)


FRAME = small(frames.sphere())


@pytest.fixture(scope="module")
def given():
    """Three frames of a corner, at poses that are a little wrong."""
    return disturbed(list(map(small, views(corner(), 3, noise=0.001))), 0.02, 0.5)


def film(name, renderer, _, folder, progress):
    jobs, count = jobs_of(FRAME, ps.View(), "light", 4, print)
    write_series(renderer, jobs, folder / name, 25, progress, count)


def page(renderer, given, folder, progress, **options):
    ps.save_page(folder / "a.html", given, progress=progress, quality="small", **options)


WORKS = {  # each: what it calls, and whether files that are whole stay when it is ended
    "picture": (lambda renderer, _, __, progress: renderer.render(FRAME, samples=4, progress=progress), False),
    "passes": (lambda renderer, _, __, progress: renderer.render_passes(FRAME, samples=2, progress=progress), False),
    "merge": (lambda renderer, given, _, progress: renderer.render(given, progress=progress), False),
    "merge and align": (
        lambda renderer, given, _, progress: renderer.render(given[:2], align=True, progress=progress),
        False,
    ),
    "merged depth": (lambda renderer, given, _, progress: renderer.render_depth(given, progress=progress), False),
    "merged points": (lambda renderer, given, _, progress: renderer.render_points(given, progress=progress), False),
    "align": (lambda renderer, given, _, progress: renderer.align_frames(given, progress=progress), False),
    "search": (
        lambda renderer, given, _, progress: renderer.align_frames(given[:2], search=True, progress=progress),
        False,
    ),
    "film": (partial(film, "a.gif"), False),
    "numbered pictures": (partial(film, "%d.png"), True),
    "page": (page, False),
    "page that plays": (partial(page, fps=5), False),
    "cell": (lambda _, given, __, progress: ps.show(given, progress=progress), False),
    "batch": (lambda _, __, ___, progress: list(ps.batch.map([FRAME] * 3, workers=1, progress=progress)), False),
}
SLOW = "search", "batch", "cell", "page that plays", "merge and align"
HOW = False, ValueError("of the caller's own")


def told_by(work, renderer, given, folder):
    """What the whole work tells of its steps."""
    told = []
    work(renderer, given, folder, lambda *step: told.append(step))
    return told


def ending(at, how):
    """A `progress` that ends the work at a step, and what it was told."""
    told = []

    def progress(*step):
        told.append(step)
        if len(told) == at and how is not False:
            raise how
        return len(told) != at

    return progress, told


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.system) if name in SLOW else name for name in WORKS]
)
def test_each_work_counts_up_to_its_end_and_may_be_ended_at_any_step(name, given, tmp_path):
    work, leaves_files = WORKS[name]
    expected = ps.render(FRAME, samples=2)
    ps.release()
    with ps.Renderer() as renderer:
        told = told_by(work, renderer, given, tmp_path)
        whole = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert all(type(number) is int for step in told for number in step)
    done = [step[0] for step in told]
    assert done == sorted(set(done)) and told[-1][0] == told[-1][1] and done[0] >= 1
    for at, how in zip(sorted({1, (len(told) + 1) // 2, len(told)}), cycle(HOW), strict=False):
        for path in tmp_path.iterdir():
            path.unlink()
        ps.release()  # the renderer of pages, which would know what it has drawn before
        progress, heard = ending(at, how)
        with ps.Renderer() as renderer:
            with pytest.raises(ps.Cancelled if how is False else ValueError) as caught:
                work(renderer, given, tmp_path, progress)
            assert how is False or caught.value is how
            assert heard == told[:at]
            left = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
            assert left.items() <= whole.items() and (len(left) == (at if leaves_files else 0))
            for one in (renderer, ps):
                assert np.array_equal(one.render(FRAME, samples=2), expected)
            again = told_by(work, renderer, given, tmp_path)  # fewer, where poses were found before
            assert again[-1][0] == again[-1][1] <= told[-1][1]
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == whole


def test_another_thread_may_end_work(renderer, given):
    """As a button of a window or a request that is given up: `progress` asks what it has set."""
    is_over, told = threading.Event(), []

    def progress(done, all):
        told.append(done)
        if done == 2:
            thread = threading.Thread(target=is_over.set)
            thread.start()
            thread.join()
        return not is_over.is_set()

    with pytest.raises(ps.Cancelled, match="cancelled after 2 of 9 steps"):
        renderer.render(given, samples=3, progress=progress)
    assert told == [1, 2]


@pytest.mark.parametrize("name", ["a.gif", "a.mp4"])
def test_a_film_that_its_maker_ends_early_plays_what_was_added(tmp_path, name):
    """Leaving the block by `break`, or closing the film where something ends the work, keeps it; an error does not."""
    if name == "a.mp4":
        pytest.importorskip("imageio_ffmpeg")
    picture = np.full((16, 16, 3), 90, np.uint8)
    with ps.Film(tmp_path / name) as film:
        for k in range(9):
            film.add(picture + np.uint8(20 * k))
            if k == 2:
                break
    assert pictures_in(tmp_path / name) == 3
    with pytest.raises(KeyboardInterrupt), ps.Film(tmp_path / name) as film:
        film.add(picture)
        film.add(picture + np.uint8(9))
        film.close()
        raise KeyboardInterrupt
    assert pictures_in(tmp_path / name) == 2
    with pytest.raises(KeyboardInterrupt), ps.Film(tmp_path / f"b{name}") as film:
        film.add(picture)
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == [name]


def pictures_in(path):
    if path.suffix == ".gif":
        with Image.open(path) as film:
            return film.n_frames
    import imageio_ffmpeg

    return imageio_ffmpeg.count_frames_and_secs(path)[0]
