"""`ps.batch.map`: the pictures of a single process, in order, and never more of them than there is use for."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch.map import Drawn, _pictures
from pointshade_gl.batch.processes import Tasks
from pointshade_gl.checks.arguments import Count

from ..support import frames
from ..support.posed_views import corner, disturbed, views


@pytest.fixture
def folder(tmp_path):
    """A sequence of four frames; the third cannot be read."""
    (tmp_path / "depth").mkdir()
    for k in range(4):
        np.save(tmp_path / f"depth/{k}.npy", frames.sphere().depth * np.float32(1 + k / 10))
    (tmp_path / "depth/2.npy").write_bytes(b"\x93NUMPY damaged")
    c = frames.CAMERA
    numbers = f'"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": {c.width}, "height": {c.height}'
    (tmp_path / "intrinsics.json").write_text(f"{{{numbers}}}")
    return tmp_path


@pytest.mark.system
def test_a_sequence_is_drawn_whether_workers_read_it_or_not(renderer, folder):
    sequence, view = ps.open_source(folder), ps.View([ps.Light((1, -2, 0))], yaw=10)
    alone = [replace(sequence[k], source=None) for k in (0, 1, 3)]
    expected = [renderer.render(frame, view.lights, yaw=10) for frame in alone]
    assert len({picture.tobytes() for picture in expected}) == 3
    for source in (folder, sequence):
        first, second, damaged, fourth = ps.batch.map(source, None, view, workers=2, return_exceptions=True)
        for picture, single in zip((first, second, fourth), expected, strict=True):
            assert np.array_equal(picture, single)
            assert picture._repr_png_()
        assert isinstance(damaged, ValueError) and "2.npy" in str(damaged)


def test_frames_of_one_thing_are_aligned_and_single_ones_are_drawn_as_they_are(renderer):
    given, look = disturbed(views(corner(), 2), 0.02, 0.5), ps.Appearance(shading="none", align=True)
    merged, single = ps.batch.map([given, given[1]], look, workers=1)
    assert np.array_equal(merged, renderer.render(given, shading="none", align=True))
    assert np.array_equal(single, renderer.render(given[1], shading="none"))


def results(*outcomes):
    """Of workers, the last one first."""
    yield from reversed(list(enumerate(outcomes)))


PICTURES = [Drawn(np.full((2, 3, 4), k, np.uint8), [f"note {k}"]) for k in range(3)]


def test_results_come_in_order_with_their_notes_and_errors_when_they_are_due():
    notes, error = [], ValueError("no depth")
    first, given, third = _pictures(results(PICTURES[0], error, PICTURES[2]), notes.append, Count(), True)
    assert (first == 0).all() and given is error and (third == 2).all()
    assert notes == ["note 0", "note 2"]
    pictures = _pictures(results(PICTURES[0], error, PICTURES[2]), notes.append, Count(), False)
    assert (next(pictures) == 0).all()
    with pytest.raises(ValueError, match=r"^no depth$"):
        next(pictures)
    assert list(pictures) == []


def test_workers_end_when_the_consumer_leaves():
    ended = []

    def working():
        try:
            for number in range(100):
                yield number, PICTURES[0]
        finally:
            ended.append(True)

    pictures = _pictures(working(), print, Count(), False)
    next(pictures)
    pictures.close()
    assert ended == [True]


def test_no_more_is_taken_than_may_wait_for_the_first():
    tasks = Tasks(iter(range(100)), 3)
    taken = [tasks.next() for _ in range(5)]
    assert [task and task.number for task in taken] == [0, 1, 2, None, None]
    assert tasks.done(taken[1], "b") == (1, "b")
    assert tasks.next() is None
    assert tasks.lost(taken[0], "signal 9") == []
    assert tasks.next(is_idle=False) is None
    again = tasks.next()
    assert again.number == 0
    [(number, error)] = tasks.lost(again, "signal 9")
    assert number == 0 and str(error) == "its worker process died 2 times: signal 9"
    assert tasks.next().number == 3


def test_a_worker_gets_several_tasks_only_while_there_are_enough_for_all():
    tasks = Tasks(range(5), None)
    assert tasks.share(2, 3) == 3
    for _ in range(4):
        tasks.next()
    assert tasks.share(2, 3) == 1
    assert Tasks(iter(range(5)), None).share(2, 3) == 3


def test_nothing_is_read_before_the_first_picture():
    def source():
        raise AssertionError
        yield

    ps.batch.map(source())


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"frames": 7}, TypeError, "frames must be an iterable of frames, or the path of a sequence, got 7"),
        ({"workers": 0}, ValueError, "workers"),
        ({"look": "phong"}, TypeError, "look must be an Appearance"),
        ({"view": 3}, TypeError, "view must be a View"),
        ({"look": ps.Appearance(temporal=True)}, ValueError, "temporal averages a stream"),
        ({"num_gpus": -1}, ValueError, "num_gpus"),
        ({"num_gpus": 1}, ValueError, "num_gpus is of a Ray cluster: pass ray='local' or an address"),
        ({"ray": True}, TypeError, "ray must be 'local' or an address, got True"),
        ({"return_exceptions": 2}, TypeError, "return_exceptions"),
    ],
)
def test_arguments_that_make_no_sense_are_refused_at_once(options, error, message):
    with pytest.raises(error, match=message):
        ps.batch.map(**({"frames": []} | options))
