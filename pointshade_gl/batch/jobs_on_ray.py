"""The outputs of a batch, made on a Ray cluster as `run_all` makes them in processes of this machine."""

from __future__ import annotations

import socket
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from ..files.access.atomic_write import hidden_beside, written_whole
from .jobs import Done, Job
from .on_ray import on_ray
from .workers import Failed, checked, outcome_of, remove_rest


def run_all_on_ray(
    jobs: Sequence[Job], output: Path, address: str, workers: int | None = None, num_gpus: float = 0.0, device: int = 0
) -> Generator[tuple[Job, Done | Failed], None, None]:
    """Runs the jobs on a Ray cluster, and gives each with what became of it, as soon as it is known.

    Workers write into the folder of the outputs where they see it; others send the files here. What is read they must
    all see.

    output  the folder of the outputs, which exists

    Other arguments, and errors, are those of `on_ray`; and ContextError where a worker has no OpenGL.
    """
    with _mark_in(output) as mark:
        make = partial(_make, mark=mark)
        with closing(on_ray(make, jobs, address, workers, num_gpus, device, lost=remove_rest)) as results:
            for number, result in results:
                outcome, content = (result, None) if isinstance(result, Exception) else result
                if content is not None:
                    _write(jobs[number].path, content)
                yield jobs[number], checked(outcome)


def _make(job: Job, device: int, mark: Path) -> tuple[Done | Failed, bytes | None]:
    """What became of a job, and the content of its file where this machine does not see the folder of the outputs."""
    if mark.exists():
        return _outcome(job, device), None
    with TemporaryDirectory() as folder:
        there = Path(folder, job.path.name)
        outcome = _outcome(replace(job, path=there), device)
        return (outcome._replace(path=job.path), there.read_bytes()) if isinstance(outcome, Done) else (outcome, None)


def _outcome(job: Job, device: int) -> Done | Failed:
    outcome = outcome_of(job, device)
    if isinstance(outcome, Failed) and Path(job.source).is_absolute() and not Path(job.source).exists():
        return Failed(f"{socket.gethostname()} does not see {job.source}: put it where all machines of the cluster do")
    return outcome


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as hidden:
        hidden.write_bytes(content)


@contextmanager
def _mark_in(folder: Path) -> Iterator[Path]:
    """A hidden file, by which others find out whether they see this folder."""
    mark = hidden_beside(folder.absolute() / "any")
    mark.touch()
    try:
        yield mark
    finally:
        mark.unlink(missing_ok=True)
