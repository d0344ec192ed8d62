"""Work on Ray gives the pictures of a single process, and outlives its workers."""

import json
import os
import signal
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch import on_ray as jobs_on_ray
from pointshade_gl.batch.jobs import Done, Job, run
from pointshade_gl.batch.on_ray import on_ray, run_all_on_ray
from pointshade_gl.batch.processes import whole

from ..support import frames
from ..support.small_ray import small_ray

pytestmark = pytest.mark.system

LIT = ps.View([ps.Light((1, -2, 0))], yaw=10)


@pytest.fixture(scope="module")
def cluster():
    with small_ray() as ray:
        yield ray


@pytest.fixture
def views():
    """Five frames that differ, in the light of LIT: under the default light size makes no difference."""
    sphere = frames.sphere()
    return [replace(sphere, depth=sphere.depth * np.float32(1 + k / 10)) for k in range(5)]


def test_pictures_are_those_of_a_single_process_in_order(cluster, renderer, views):
    sources = [*views, "nowhere", views[1:3]]
    *drawn, lost, merged = ps.batch.map(
        sources, ps.Appearance(shading="flat"), LIT, ray="local", workers=2, num_gpus=1, return_exceptions=True
    )
    assert len({picture.tobytes() for picture in drawn}) == len(views)
    for frame, picture in zip(views, drawn, strict=True):
        assert np.array_equal(picture, renderer.render(frame, LIT.lights, yaw=10, shading="flat"))
        assert picture.flags.writeable
    assert isinstance(lost, FileNotFoundError) and "nowhere" in str(lost)
    assert np.array_equal(merged, renderer.render(views[1:3], LIT.lights, yaw=10, shading="flat"))


def test_killed_workers_are_replaced_and_only_what_kills_each_of_them_fails(cluster, tmp_path, monkeypatch):
    def deadly(item, device):
        mark = tmp_path / str(item)
        if item == 4 or (item == 2 and not mark.exists()):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return item, device

    told = []
    keep = lambda worker: told.extend((task.item, worker.hidden) for task in worker.tasks)  # noqa: E731
    monkeypatch.setattr("pointshade_gl.batch.processes.Worker.remove_rest", keep)
    results = dict(on_ray(deadly, range(7), "local", 2))
    assert str(results.pop(4)) == "its worker process died 2 times: is there enough memory?"
    assert results == {k: (k, 0) for k in (0, 1, 2, 3, 5, 6)}
    assert sorted(item for item, _ in told) == [2, 4, 4]
    assert all(ours.startswith(".") for _, ours in told)


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


def test_a_stage_may_be_called_by_another_thread_than_its_makers(data, renderer, views):
    """Ray Data makes an actor's stage in one thread and calls it in another."""
    pool = data.ActorPoolStrategy(size=2)
    made = data.from_items(rows(views)).map_batches(
        ps.batch.Stage, fn_constructor_kwargs={"view": LIT}, batch_size=2, num_cpus=0.5, compute=pool
    )
    drawn = made.take_all()
    assert sorted(row["k"] for row in drawn) == list(range(5))
    for row in drawn:
        assert np.array_equal(row["picture"], renderer.render(views[row["k"]], LIT.lights, yaw=10))


def test_a_worker_of_another_version_is_refused(cluster, monkeypatch):
    monkeypatch.setattr("pointshade_gl.batch.on_ray.__version__", "99")
    with pytest.raises(OSError, match=r"has pointshade_gl [\d.]+, and here it is 99: install the same$"):
        list(on_ray(lambda item, device: item, [1], "local", 1))


class Broken:
    """Cannot be received, as on a machine where something is not installed."""

    def __reduce__(self):
        return __import__, ("no_such_module",)


def test_workers_that_do_not_start_are_told_of_with_the_cause(cluster):
    with pytest.raises(OSError, match=r"no worker starts on Ray: .*no_such_module"):
        list(on_ray(Broken(), [1], "local", 1))


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
    for job in jobs_of(alone, range(2), source):
        whole(run(job))
    done = list(run_all_on_ray(jobs_of(shared, range(2), source), shared, "local", 1))
    assert sorted(job.number for job, _ in done) == [0, 1]
    assert all(isinstance(outcome, Done) and outcome.path == job.path for job, outcome in done)
    monkeypatch.setattr(jobs_on_ray, "_make", blind(jobs_on_ray._make))
    jobs = [*jobs_of(sent, range(2), source), *jobs_of(sent, [99], source), Job("/nowhere/at/all", sent / "a.png")]
    outcomes = {job.path.name: outcome for job, outcome in run_all_on_ray(jobs, sent, "local", 1)}
    for k in range(2):
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


def test_batch_draws_on_ray_and_tells_what_fails_as_it_does_without(cluster, typed, tmp_path, monkeypatch):
    monkeypatch.setenv("RAY_DEDUP_LOGS_SKIP_REGEX", ".")  # the command sets it, for its own process
    folder = tmp_path / "views"
    (folder / "depth").mkdir(parents=True)
    for k in range(3):
        np.save(folder / f"depth/{k}.npy", frames.sphere().depth * np.float32(1 + k / 10))
    (folder / "depth/1.npy").write_bytes(b"\x93NUMPY damaged")
    c = frames.CAMERA
    numbers = {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "width": c.width, "height": c.height}
    (folder / "intrinsics.json").write_text(json.dumps(numbers))
    code, out, err = typed("batch views -o alone --light 1,-2,0 --workers 1")
    on_ray_too = typed("batch views -o out --light 1,-2,0 --ray local --workers 1")
    assert code == on_ray_too[0] == 3
    assert out.split(",")[:2] == ["alone: 2 written", " 1 failed"]
    assert on_ray_too[1].split(",")[:2] == ["out: 2 written", " 1 failed"]
    assert [line for line in err.splitlines() if "failed" in line] == on_ray_too[2].splitlines()[-1:]
    for name in ("0000.png", "0002.png"):
        assert (tmp_path / "out/views" / name).read_bytes() == (tmp_path / "alone/views" / name).read_bytes()
    lines = [(tmp_path / where / "manifest.jsonl").read_text().splitlines() for where in ("alone", "out")]
    digests = [{entry["sha256"] for entry in map(json.loads, those) if "sha256" in entry} for those in lines]
    assert digests[0] == digests[1] and len(digests[0]) == 2
    code, _, err = typed("batch views -o out --num-gpus 1")
    assert code == 2 and err == "pointshade: --num-gpus is of a Ray cluster: add --ray local or ADDRESS\n"
