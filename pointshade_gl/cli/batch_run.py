"""Does what `pointshade batch` is asked for, and says what has become of it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import typer

from ..batch.jobs import Done
from ..batch.manifest import Failure, Manifest, Planned, split_done
from ..batch.on_ray import run_all_on_ray, silence_ray
from ..batch.processes import Failed, run_all
from ..files.access.atomic_write import check_place
from ..gpu.context.software_driver import is_software
from ..notes.notes import once, print_note
from ..notes.words import counted, option
from .batch_options import Asked
from .output import SOFTWARE, complain, print_line, progress

FAILED = 3  # exit code


def run(asked: Asked, planned: Sequence[Planned], failures: list[Failure], started: float) -> None:
    """Does what is not done, and says what has become of it: exit code 3 if anything failed."""
    output, how = asked.output, asked.how
    manifest = Manifest(output.resolve(), how.part())
    todo = list(planned) if how.overwrite else _undone(planned, manifest, output, how.resume)
    if todo:
        check_place(manifest.path)
    counts = {"written": 0, "there": len(planned) - len(todo), "left out": 0}
    try:
        for one, outcome in _outcomes(asked, todo) if todo else ():
            if not isinstance(outcome, Failed):
                manifest.add(outcome, one.made_from)
                counts["written"] += 1
            elif outcome.kind == "failed":
                failures.append(Failure(str(one.job.path.relative_to(manifest.folder)), outcome.sentence))
            else:
                counts[outcome.kind] += 1
    finally:
        for failure in failures:
            complain(f"failed: {' '.join(failure.name.split())}: {failure.sentence}")
    told = [f"{count} {name}" for name, count in (counts | {"failed": len(failures)}).items() if count]
    print_line(f"{output}: {', '.join(told) or 'nothing to do'}, {time.perf_counter() - started:.1f} s")
    if failures:
        raise typer.Exit(FAILED)


def _undone(planned: Sequence[Planned], manifest: Manifest, output: Path, resume: bool) -> list[Planned]:
    """What is not there and whole. Raises ValueError if some of it was made otherwise, unless it may be done again."""
    todo, changed = split_done(planned, manifest, resume)
    if changed and not resume:
        path, how_so = changed[0]
        raise ValueError(
            f"{counted(len(changed), 'output')} in {output} were made {how_so}, such as "
            f"{path.relative_to(manifest.folder)}: pass {option('resume', True)} to do these again, "
            f"{option('overwrite', True)} to do all again, or another -o DIR"
        )
    return todo


def _outcomes(asked: Asked, todo: Sequence[Planned]) -> Iterator[tuple[Planned, Done | Failed]]:
    """What becomes of each. Notes that workers send are printed once; a bar moves on a terminal."""
    tell, by_path = once(print_note), {one.job.path: one for one in todo}
    jobs, how = [one.job for one in todo], asked.how
    if how.ray is None:
        running = run_all(jobs, how.workers, asked.device)
    else:
        silence_ray()
        running = run_all_on_ray(jobs, asked.output, how.ray, how.workers, how.num_gpus or 0, asked.device)
    with progress(len(todo), with_rate=True) as advance, closing(running):
        for done, (job, outcome) in enumerate(running, 1):
            if not isinstance(outcome, Failed):
                if is_software(outcome.renderer):
                    tell(SOFTWARE.format(outcome.renderer))
                for note in outcome.notes:
                    tell(note)
            yield by_path[job.path], outcome
            advance(done, len(todo))
