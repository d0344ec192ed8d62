"""`pointshade batch`: batch_plan.py says what is to be done, batch_run.py does it."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from ...messages.formatting import option
from ..batch_options import BATCH, BatchOptions
from ..completion import complete_input
from ..look_options import LookOptions
from ..options import Axes, Bits, Device, FilmOptions, Quiet, ReadingOptions, ViewOptions, spread
from ..page_options import PageOptions
from ..picture_options import PictureOptions

INTERRUPTED = 130  # exit code

Inputs = Annotated[
    list[str],
    typer.Argument(
        metavar="INPUT",
        help="Folders with a sequence or a frame, folders of such folders, depth files, scenes, built-in names.",
        autocompletion=complete_input,
    ),
]
Folder = Annotated[
    Path,
    typer.Option(
        "-o", "--output", metavar="DIR", help="The folder to write to, and its manifest.jsonl.", rich_help_panel=BATCH
    ),
]


@spread
def batch(
    inputs: Inputs,
    output: Folder,
    how: BatchOptions,
    reading: ReadingOptions,
    look: LookOptions,
    place: ViewOptions,
    picture: PictureOptions,
    film: FilmOptions,
    page: PageOptions,
    axes: Axes = None,
    bits: Bits = 8,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Draw many INPUTs to a folder, in several processes: pictures, normals, pages, or a film of each sequence.

    Each picture is the one that render makes of its frame alone. What is there and whole is skipped; what fails is
    listed at the end (exit code 3). After Ctrl+C, the same command with --resume goes on.
    """
    from ..batch_plan import Asked
    from ..batch_run import run

    started = time.perf_counter()
    try:
        asked = Asked(output, how, reading, look, place, picture, film, page, axes, bits)
        planned, failures = asked.plan(inputs)
        run(planned, failures, output, how, device, started)
    except KeyboardInterrupt:
        print(
            f"pointshade: interrupted; what is in {output} is whole: the same command with "
            f"{option('resume', True)} goes on",
            file=sys.stderr,
        )
        raise typer.Exit(INTERRUPTED) from None
