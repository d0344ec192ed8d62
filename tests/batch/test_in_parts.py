"""A worker reads the next item and writes the last one while it draws; what it makes is as without that."""

from collections import defaultdict
from threading import Event, current_thread

import pytest

import pointshade_gl as ps
from pointshade_gl.batch.jobs import Done, Job
from pointshade_gl.batch.processes import Failed, on_processes, outcome_of, run_all
from pointshade_gl.files.frames import sequences

from ..support.batches import write_sequence

ITEMS = 4
reached: dict[str, Event] = defaultdict(Event)


def reaches(what):
    reached[what].set()


def waits_for(what):
    return reached[what].wait(20)


def overlapping(item, _):
    """Return whether the parts of neighbours were done at the same time, and by which threads."""
    threads = [current_thread().name]
    reaches(f"{item} is read")
    yield
    threads.append(current_thread().name)
    reaches(f"{item} is drawn")
    found = item == ITEMS - 1 or waits_for(f"{item + 1} is read")
    found = (item == 0 or waits_for(f"{item - 1} is written")) and found
    yield
    threads.append(current_thread().name)
    found = (item == ITEMS - 1 or waits_for(f"{item + 1} is drawn")) and found
    reaches(f"{item} is written")
    return found, threads


def test_one_is_read_one_is_drawn_and_one_is_written_at_a_time():
    results = dict(on_processes(overlapping, range(ITEMS), 1))
    assert list(results) == [*range(ITEMS)]
    assert all(found for found, _ in results.values())
    assert {threads[1] for _, threads in results.values()} == {"MainThread"}  # which has the OpenGL context


def untimed(outcome):
    return outcome if isinstance(outcome, Failed) else outcome._replace(seconds=0, notes=())


@pytest.mark.gl
@pytest.mark.system
def test_outcomes_are_those_of_jobs_that_are_run_alone(tmp_path):
    """A frame that is no picture, one that is not there, and notes: each is told of its own job."""
    write_sequence(tmp_path / "seq", 5)
    (tmp_path / "seq/depth/0002.png").write_bytes(b"no picture")
    small = ps.View(picture_size=(64, 48))
    jobs = [Job(str(tmp_path / "seq"), tmp_path / f"out/{k}.png", number=k, view=small) for k in (*range(5), 9)]
    alone = [outcome_of(job) for job in jobs]
    kinds = [outcome.kind if isinstance(outcome, Failed) else "done" for outcome in alone]
    assert kinds == ["done", "done", "failed", "done", "done", "left out"]
    assert [untimed(outcome) for _, outcome in run_all(jobs, 1)] == [untimed(one) for one in alone]


@pytest.mark.gl
def test_the_first_frame_of_a_sequence_is_read_once(tmp_path, monkeypatch):
    write_sequence(tmp_path / "seq", 2)
    read, assemble = [], sequences.assemble

    def counted(parts, *others):
        read.append(parts.number)
        return assemble(parts, *others)

    monkeypatch.setattr(sequences, "assemble", counted)
    for k in range(2):
        job = Job(str(tmp_path / "seq"), tmp_path / f"{k}.png", number=k, view=ps.View(picture_size=(8, 6)))
        assert isinstance(outcome_of(job), Done)
    assert read == [0, 1]
