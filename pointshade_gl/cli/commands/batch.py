"""`pointshade batch`: its options; cli/batch_plan.py says what is to be done, cli/batch_run.py does it."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ...messages.formatting import option
from ..completion import complete_input, one_of
from ..look_options import LookOptions
from ..options import Axes, Bits, Device, FilmOptions, Quiet, ReadingOptions, ViewOptions, spread
from ..page_options import PageOptions
from ..picture_options import PictureOptions

KINDS = ("png", "jpg", "webp", "tif", "normals.png", "normals.exr", "normals.npy", "html", "mp4", "gif")
BATCH = "Batch"
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


@dataclass(frozen=True)
class BatchOptions:
    """What comes out of a batch, and who does it."""

    to: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help=f"What comes out, the ending of each name: {', '.join(KINDS)}. Films are one for each sequence.",
            autocompletion=one_of(KINDS),
            rich_help_panel=BATCH,
        ),
    ] = "png"
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Processes that draw. Default: one for each core.", rich_help_panel=BATCH
        ),
    ] = None
    ray: Annotated[
        str | None,
        typer.Option(
            metavar="local|ADDRESS",
            help="Draw on a Ray cluster, as at auto or host:6379, instead of on this machine; local starts a Ray here. "
            "Its machines must all see INPUT.",
            rich_help_panel=BATCH,
        ),
    ] = None
    num_gpus: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            min=0,
            help="With --ray: GPUs for each worker, which draws on that GPU; 0.25 lets four share one.",
            rich_help_panel=BATCH,
        ),
    ] = None
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="I/N",
            help="Do part I of N, counted from 1, as in --shard $SLURM_ARRAY_TASK_ID/8 with sbatch --array=1-8.",
            rich_help_panel=BATCH,
        ),
    ] = None
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on: do again what the manifest does not prove to be whole and made of the same input, with the "
            "same options and version.",
            rich_help_panel=BATCH,
        ),
    ] = False
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Do everything again.", rich_help_panel=BATCH)] = False

    def part(self) -> tuple[int, int] | None:
        """Which part of how many, from 1. Raises ValueError for anything else."""
        if self.shard is None:
            return None
        number, _, count = self.shard.partition("/")
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            raise ValueError(
                f"{option('shard')} is a part from 1 and how many there are, such as 1/8 to 8/8, got {self.shard!r}: "
                "with an array from 0 add 1, as in $((SLURM_ARRAY_TASK_ID+1))/8"
            )
        return int(number), int(count)


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
        asked = Asked(output, how, reading, look, place.view(look), picture, film, page, axes, bits)
        planned, failures = asked.plan(inputs)
        run(planned, failures, output, how, device, started)
    except KeyboardInterrupt:
        print(
            f"pointshade: interrupted; what is in {output} is whole: the same command with "
            f"{option('resume', True)} goes on",
            file=sys.stderr,
        )
        raise typer.Exit(INTERRUPTED) from None
