"""The options of `pointshade batch`: what comes out, and who draws it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ..files.access.known_names import BATCH as KINDS
from ..notes.words import option
from ..scene.option_fields import BATCH
from .completion import complete_input
from .look_options import LookOptions
from .option_groups import said
from .options import Axes, Bits, CloudOptions, Device, FilmOptions, Quiet, ReadingOptions, ViewOptions
from .page_options import PageOptions
from .picture_options import PictureOptions

Inputs = Annotated[
    list[str],
    typer.Argument(
        metavar="INPUT",
        help="Folders with a sequence or a frame, folders of such folders, depth files, scenes, point clouds "
        "or folders of them, built-in names.",
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

    to: str = said(
        f"What comes out, the ending of each name: {', '.join(KINDS)}. Films are one for each sequence.",
        metavar="KIND",
        known=KINDS,
        default="png",
        panel=BATCH,
    )
    workers: int | None = said("Processes that draw. Default: one for each core.", metavar="N", min=1, panel=BATCH)
    ray: str | None = said(
        "Draw on a Ray cluster, as at auto or host:6379, instead of on this machine; local starts a Ray here. "
        "Its machines must all see INPUT.",
        metavar="local|ADDRESS",
        panel=BATCH,
    )
    num_gpus: float | None = said(
        "With --ray: GPUs for each worker, which draws on that GPU; 0.25 lets four share one.",
        metavar="N",
        min=0,
        panel=BATCH,
    )
    shard: str | None = said(
        "Do part I of N, counted from 1, as in --shard $SLURM_ARRAY_TASK_ID/8 with sbatch --array=1-8.",
        metavar="I/N",
        panel=BATCH,
    )
    resume: bool = said(
        "Go on: do again what the manifest does not prove to be whole and made of the same input, with the "
        "same options and version.",
        "--resume",
        default=False,
        panel=BATCH,
    )
    overwrite: bool = said(
        "Do everything again, and write over files that are read as inputs, too.",
        "--overwrite",
        default=False,
        panel=BATCH,
    )

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


@dataclass(frozen=True)
class Asked:
    """What was typed."""

    inputs: Inputs
    output: Folder
    how: BatchOptions
    reading: ReadingOptions
    cloud: CloudOptions
    look: LookOptions
    place: ViewOptions
    picture: PictureOptions
    film: FilmOptions
    page: PageOptions
    axes: Axes = None
    bits: Bits = 8
    device: Device = 0
    quiet: Quiet = False
