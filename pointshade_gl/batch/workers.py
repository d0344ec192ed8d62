"""What becomes of the jobs of a batch, made by worker processes."""

from __future__ import annotations

import errno
from collections.abc import Generator, Sequence
from contextlib import closing
from typing import NamedTuple

from ..files.access.atomic_write import remove_hidden
from ..notes.errors import ContextError, error_text
from ..notes.words import as_command_line
from .jobs import Done, Job, LeftOut, run
from .manifest import no_room
from .processes import on_processes

_FULL = (errno.ENOSPC, errno.EDQUOT)
_ENDS = {"no GL": ContextError, "no room": OSError}  # what is raised where no other job can be done either


class Failed(NamedTuple):
    """Why there is no output.

    kind  "failed"; "left out" by its sequence; "no GL", or "no room" on the disk: then no job can be done
    """

    sentence: str
    kind: str = "failed"


def run_all(
    jobs: Sequence[Job], workers: int | None = None, device: int = 0
) -> Generator[tuple[Job, Done | Failed], None, None]:
    """Runs the jobs in so many processes, and gives each with what became of it, as soon as it is known.

    After an exception, and where the consumer leaves early, the processes are ended at once: what is whole stays, and
    nothing half-written is left.

    Raises ContextError if workers have no OpenGL, OSError if they die before they begin or the disk is full.
    """
    with closing(on_processes(outcome_of, jobs, workers, device, lost=remove_rest)) as results:
        for number, result in results:
            yield jobs[number], checked(result)


def checked(result: Done | Failed | Exception) -> Done | Failed:
    """What became of a job that worked, failed or killed its workers. Raises ContextError or OSError as `run_all`."""
    outcome = Failed(str(result)) if isinstance(result, Exception) else result
    if isinstance(outcome, Failed) and outcome.kind in _ENDS:
        raise _ENDS[outcome.kind](outcome.sentence)
    return outcome


def remove_rest(job: Job, ours: str) -> None:
    """Removes what a worker that died has left of a job's file. ours: how the names of its hidden files begin."""
    remove_hidden(job.path.parent, ours)


def outcome_of(job: Job, device: int = 0) -> Done | Failed:
    """Runs a job; whatever it raises becomes a sentence, so that the next job can be done."""
    with as_command_line():
        try:
            return run(job, device)
        except LeftOut as error:
            return Failed(str(error), "left out")
        except ContextError as error:
            return Failed(str(error), "no GL")
        except Exception as error:
            if isinstance(error, OSError) and error.errno in _FULL:
                return Failed(no_room(job.path, error), "no room")
            return Failed(error_text(error))
