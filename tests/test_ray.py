"""Work on Ray gives the pictures of a single process, and outlives its workers."""

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch import on_ray as module
from pointshade_gl.batch.map import map as map_frames
from pointshade_gl.batch.on_ray import on_ray
from pointshade_gl.view import View

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
    view = View([ps.Light((1, -2, 0))], yaw=10)
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
    assert str(results.pop(1)) == "its worker was killed, 3 times in a row"
    assert results == {0: 0, 2: 2, 3: 3}
