"""Work on Ray gives the pictures of a single process, and outlives its workers."""

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch import jobs_on_ray
from pointshade_gl.batch.jobs import Done, Job, run
from pointshade_gl.batch.jobs_on_ray import run_all_on_ray
from pointshade_gl.batch.map import map as map_frames
from pointshade_gl.batch.on_ray import on_ray

from . import frames


@pytest.fixture(scope="module")
def cluster():
    """A Ray of two processors for all tests of this file."""
    ray = pytest.importorskip("ray")
    ray.init(
        "local",
        num_cpus=2,
        object_store_memory=100_000_000,
        include_dashboard=False,
        log_to_driver=False,
        logging_level="CRITICAL",
    )
    yield ray
    ray.shutdown()


@pytest.fixture
def views():
    """Five frames that differ."""
    sphere = frames.sphere()
    return [replace(sphere, depth=sphere.depth * np.float32(1 + k / 10)) for k in range(5)]


def test_pictures_are_those_of_a_single_process_in_order(cluster, renderer, views):
    view = ps.View([ps.Light((1, -2, 0))], yaw=10)
    drawn = list(map_frames(views, ps.Look(shading="flat"), view, ray="local", workers=2))
    assert len(drawn) == len(views)
    for frame, picture in zip(views, drawn, strict=True):
        assert np.array_equal(picture, renderer.render(frame, view.lights, yaw=10, shading="flat"))
        assert picture.flags.writeable


def test_a_killed_worker_is_replaced_and_its_task_done_again(cluster, tmp_path):
    def dies_once(item, device):
        mark = Path(item)
        if mark.name == "2" and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return mark.name, device

    told = []
    items = [str(tmp_path / str(k)) for k in range(6)]
    results = dict(on_ray(dies_once, items, "local", 2, lost=lambda item, ours: told.append((Path(item).name, ours))))
    assert results == {k: (str(k), 0) for k in range(6)}
    assert ("2", told[0][1]) in told and told[0][1].startswith(".")


def test_a_task_that_kills_each_worker_fails_alone(cluster):
    def dies(item, device):
        if item == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    results = dict(on_ray(dies, range(4), "local", 2))
    assert str(results.pop(1)) == "its worker process died 2 times (is there enough memory?)"
    assert results == {0: 0, 2: 2, 3: 3}


def test_what_cannot_be_drawn_is_told_in_its_turn(cluster, views):
    sources = [views[0], "nowhere", [views[1], views[2]], "vase", 7]
    drawn = list(map_frames(sources, ray="local", workers=2, return_exceptions=True))
    assert [type(result).__name__ for result in drawn] == [
        "Picture",
        "FileNotFoundError",
        "Picture",
        "Picture",
        "TypeError",
    ]
    pictures = map_frames(sources, ray="local", workers=2)
    assert next(pictures).shape == (120, 160, 4)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        next(pictures)
    assert list(pictures) == []


def test_frames_are_read_only_as_far_as_they_are_needed(cluster, views):
    taken = []

    def source():
        for k in range(1000):
            taken.append(k)
            yield views[k % 5]

    pictures = map_frames(source(), ray="local", workers=2)
    assert taken == []
    next(pictures)
    pictures.close()
    assert len(taken) <= 1 + 2 * 4


@pytest.fixture
def data(cluster):
    """ray.data without bars."""
    data = pytest.importorskip("ray.data")
    data.DataContext.get_current().enable_progress_bars = False
    return data


def rows(views):
    c = frames.CAMERA
    return [
        {"k": k, "color": view.color, "depth": view.depth, "intrinsics": [c.fx, c.fy, c.cx, c.cy]}
        for k, view in enumerate(views)
    ]


def test_a_stage_of_ray_data_draws_the_same_pictures(data, renderer, views):
    stage = ps.batch.Stage(view=ps.View(yaw=10))
    drawn = data.from_items(rows(views)).map_batches(stage, batch_size=2).take_all()
    assert sorted(row["k"] for row in drawn) == list(range(5))
    for row in drawn:
        assert np.array_equal(row["picture"], renderer.render(views[row["k"]], yaw=10))


def test_a_stage_may_be_called_by_another_thread_than_its_makers(data, renderer, views):
    """Ray Data makes an actor's stage in one thread and calls it in another."""
    pool = data.ActorPoolStrategy(size=2)
    made = data.from_items(rows(views)).map_batches(ps.batch.Stage, batch_size=2, num_cpus=0.5, compute=pool)
    for row in made.take_all():
        assert np.array_equal(row["picture"], renderer.render(views[row["k"]]))


def jobs_of(folder, numbers, source="icl_livingroom_23views"):
    return [Job(str(source), folder / "out" / f"{k}.png", number=k) for k in numbers]


@pytest.mark.data
def test_jobs_are_done_where_the_folder_is_seen_and_sent_back_where_it_is_not(
    cluster, shared_data, tmp_path, monkeypatch
):
    source = shared_data / "icl_livingroom_23views"
    alone, shared, sent = (tmp_path / name for name in ("alone", "shared", "sent"))
    for folder in (alone, shared, sent):
        folder.mkdir()
    for job in jobs_of(alone, range(3), source):
        run(job)
    done = list(run_all_on_ray(jobs_of(shared, range(3), source), shared, "local", 2))
    assert sorted(job.number for job, _ in done) == [0, 1, 2]
    assert all(isinstance(outcome, Done) and outcome.path == job.path for job, outcome in done)
    monkeypatch.setattr(jobs_on_ray, "_make", blind(jobs_on_ray._make))
    jobs = [*jobs_of(sent, range(3), source), *jobs_of(sent, [99], source), Job("/nowhere/at/all", sent / "a.png")]
    outcomes = {job.path.name: outcome for job, outcome in run_all_on_ray(jobs, sent, "local", 2)}
    for k in range(3):
        expected = (alone / "out" / f"{k}.png").read_bytes()
        assert (shared / "out" / f"{k}.png").read_bytes() == expected
        assert (sent / "out" / f"{k}.png").read_bytes() == expected
        assert outcomes[f"{k}.png"].path == sent / "out" / f"{k}.png"
    assert "99" in outcomes["99.png"].sentence
    assert "does not see /nowhere/at/all: put it where all machines" in outcomes["a.png"].sentence
    assert [path for folder in (shared, sent) for path in folder.rglob(".*")] == []


def blind(make):
    """The function on a machine that sees another disk."""

    def elsewhere(job, device, mark):
        return make(job, device, mark.with_name("not here"))

    return elsewhere
