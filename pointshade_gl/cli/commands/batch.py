"""`pointshade batch`: batch_plan.py says what is to be done, batch_run.py does it."""

from __future__ import annotations

import time

import typer

from ...notes.words import option
from ..batch_options import Asked
from ..options import spread
from ..output import complain

INTERRUPTED = 130  # exit code


@spread
def batch(asked: Asked) -> None:
    """Draw many INPUTs to a folder, in several processes: pictures, normals, pages, or a film of each sequence.

    Each picture is the one that render makes of its frame alone. What is there and whole is skipped; what fails is
    listed at the end (exit code 3). After Ctrl+C, the same command with --resume goes on.
    """
    from ..batch_plan import plan_batch
    from ..batch_run import run

    started = time.perf_counter()
    try:
        planned, failures = plan_batch(asked)
        run(asked, planned, failures, started)
    except KeyboardInterrupt:
        complain(
            f"pointshade: interrupted; what is in {asked.output} is whole: the same command with "
            f"{option('resume', True)} goes on"
        )
        raise typer.Exit(INTERRUPTED) from None
