"""`pointshade batch`: sequences, folders of folders, scenes and single frames become many outputs."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .cli_completion import complete_input, one_of
from .cli_look import LookOptions
from .cli_options import Axes, Bits, Device, FilmOptions, Quiet, ReadingOptions, ViewOptions, spread
from .cli_picture import PictureOptions
from .wording import counted, option

if TYPE_CHECKING:
    from .batch.inputs import Source
    from .batch.jobs import Done, Job
    from .batch.plan import Failure, Planned
    from .batch.workers import Failed
    from .view import View

KINDS = ("png", "jpg", "webp", "tif", "normals.png", "normals.exr", "normals.npy", "html", "mp4", "gif")
BATCH = "Batch"
FAILED, INTERRUPTED = 3, 130  # exit codes

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
    axes: Axes = None,
    bits: Bits = 8,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Draw many INPUTs to a folder, in several processes: pictures, normals, pages, or a film of each sequence.

    Each picture is the one that render makes of its frame alone. What is there and whole is skipped; what fails is
    listed at the end (exit code 3). After Ctrl+C, the same command with --resume goes on.
    """
    started = time.perf_counter()
    try:
        planned, failures = _plan(inputs, output, how, reading, look, place, picture, film, axes, bits)
        _run(planned, failures, output, how, device, started)
    except KeyboardInterrupt:
        print(
            f"pointshade: interrupted; what is in {output} is whole: the same command with "
            f"{option('resume', True)} goes on",
            file=sys.stderr,
        )
        raise typer.Exit(INTERRUPTED) from None


def _plan(
    inputs: list[str],
    output: Path,
    how: BatchOptions,
    reading: ReadingOptions,
    look: LookOptions,
    place: ViewOptions,
    picture: PictureOptions,
    film: FilmOptions,
    axes: str | None,
    bits: int,
) -> tuple[Sequence[Planned], list[Failure]]:
    """What this process has to care for. Raises ValueError or OSError for options and inputs that cannot be."""
    from . import __version__
    from .batch.inputs import find_sources
    from .batch.jobs import FILMS, NORMALS, Job
    from .batch.manifest import told
    from .batch.plan import plan, shard_of
    from .cli_read import check_look
    from .scene import Scene
    from .sources import is_scene

    view, part, is_film = place.view(look), how.part(), how.to in FILMS
    _check(how, view, picture, film, axes, bits)
    output = _folder(output)
    _check_writable(output / f"any.{how.to}", axes, bits)
    sources = find_sources(inputs, output)
    if any(is_scene(source.path) for source in sources):
        check_look(view.look)

    def job_for(source: Source) -> Job:
        seen, scene = view, is_scene(source.path)
        if picture.ground or scene:
            seen = replace(seen, lights=look.lights(shadow=True))
        if how.to not in NORMALS:
            stand_in = Scene(()) if scene else None
            path = output / f"any.{how.to}"
            seen = replace(seen, finish=picture.finish(path, seen, stand_in, is_film, film.turntable == "camera"))
        return Job(source.path, output, how.to, None, seen, given, film.turntable, film.frames, film.fps, axes, bits)

    given = tuple(told(reading).items())
    planned, failures = plan(sources, job_for, output, __version__)
    if failures and not planned:
        raise ValueError(failures[0].sentence)
    return shard_of(planned, part), failures


def _folder(output: Path) -> Path:
    """The folder to write to, which is made if need be, without links. Raises OSError if there can be none."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(
            f"{output} is a file, expected a folder for many outputs: pass another -o DIR"
        ) from None
    except OSError as error:
        raise OSError(f"cannot make the folder {output}: {error.strerror}") from None
    return output.resolve()


def _check(
    how: BatchOptions, view: View, picture: PictureOptions, film: FilmOptions, axes: str | None, bits: int
) -> None:
    """Raises ValueError for options that do not go together."""
    from .batch.jobs import FILMS, KINDS, NORMALS
    from .checks import check_choice

    check_choice(option("to"), how.to, KINDS)
    if how.num_gpus is not None and how.ray is None:
        raise ValueError(f"{option('num_gpus')} is of a Ray cluster: add {option('ray', 'local', 'ADDRESS')}")
    if how.resume and how.overwrite:
        raise ValueError(f"pass {option('resume', True)} or {option('overwrite', True)}, not both")
    films = f"{option('to', 'mp4')} or {option('to', 'gif')}"
    if how.to not in FILMS and film.turntable is not None:
        raise ValueError(f"{option('turntable')} makes films: add {films}")
    if how.to not in FILMS and view.look.temporal:
        raise ValueError(f"{option('temporal', True)} filters over time, and each picture is drawn alone: add {films}")
    if how.to in NORMALS:
        picture.check_none(Path(f"any.{how.to}"))
    elif axes is not None or bits != 8:
        raise ValueError(f"{option('axes')} and {option('bits')} are of normals: add {option('to', NORMALS[0])}")


def _check_writable(path: Path, axes: str | None, bits: int) -> None:
    """Raises ValueError for a kind that needs an extra which is not installed, OSError for no such place."""
    from .files.film import FILM_SUFFIXES, check_film
    from .files.maps import check_normals_path
    from .files.pictures import check_writable
    from .files.whole import check_place

    if path.suffix in FILM_SUFFIXES:
        check_film(path)
    elif path.stem.endswith(".normals"):
        check_normals_path(path, axes, bits)
    elif path.suffix == ".html":
        check_place(path)
    else:
        check_writable(path)


def _run(
    planned: Sequence[Planned], failures: list[Failure], output: Path, how: BatchOptions, device: int, started: float
) -> None:
    """Does what is not done, and says what has become of it: exit code 3 if anything failed."""
    from .batch.manifest import Manifest
    from .batch.plan import Failure, split_done
    from .batch.workers import Failed

    folder = output.resolve()
    manifest = Manifest(folder, how.part())
    todo, changed = (list(planned), []) if how.overwrite else split_done(planned, manifest, how.resume)
    if changed and not how.resume:
        path, how_so = changed[0]
        raise ValueError(
            f"{counted(len(changed), 'output')} in {output} were made {how_so}, such as "
            f"{path.relative_to(folder)}: pass {option('resume', True)} to do these again, "
            f"{option('overwrite', True)} to do all again, or another -o DIR"
        )
    counts = {"written": 0, "there": len(planned) - len(todo), "left out": 0}
    try:
        for one, outcome in _outcomes(todo, output, how, device):
            if isinstance(outcome, Failed):
                counts["left out"] += outcome.kind == "left out"
                if outcome.kind == "failed":
                    failures.append(Failure(str(one.job.path.relative_to(folder)), outcome.sentence))
            else:
                manifest.add(outcome, one.made_from)
                counts["written"] += 1
    finally:
        for failure in failures:
            print(f"failed: {failure.name}: {failure.sentence}", file=sys.stderr)
    told = [f"{count} {name}" for name, count in (counts | {"failed": len(failures)}).items() if count]
    print(f"{output}: {', '.join(told)}, {time.perf_counter() - started:.1f} s")
    if failures:
        raise typer.Exit(FAILED)


def _outcomes(
    todo: Sequence[Planned], output: Path, how: BatchOptions, device: int
) -> Iterator[tuple[Planned, Done | Failed]]:
    """What becomes of each. Notes that workers send are printed once; a bar moves on a terminal."""
    from .batch.cluster import silence_ray
    from .batch.jobs_on_ray import run_all_on_ray
    from .batch.workers import Failed, run_all
    from .cli_output import SOFTWARE, progress
    from .gpu.software import is_software
    from .notes import once, print_note

    tell, by_path = once(print_note), {one.job.path: one for one in todo}
    jobs = [one.job for one in todo]
    if how.ray is None:
        running = run_all(jobs, how.workers, device)
    else:
        silence_ray()
        running = run_all_on_ray(jobs, output, how.ray, how.workers, how.num_gpus or 0, device)
    with progress(len(todo), with_rate=True) as advance, closing(running):
        for job, outcome in running:
            if not isinstance(outcome, Failed):
                if is_software(outcome.renderer):
                    tell(SOFTWARE.format(outcome.renderer))
                for note in outcome.notes:
                    tell(note)
            yield by_path[job.path], outcome
            advance()
