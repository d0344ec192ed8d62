"""`pointshade batch`: its options, the jobs after all of them are checked, and what becomes of them."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from ...batch.batch_inputs import Source, find_sources, not_whole
from ...batch.jobs import FILMS, NORMALS, PAGE, Done, Job
from ...batch.manifest import Failure, Manifest, Planned, plain_value, plan, shard_of, split_done
from ...batch.on_ray import run_all_on_ray, silence_ray
from ...batch.processes import Failed, run_all
from ...checks.arguments import check_choice, check_fps
from ...files.access.atomic_write import check_place
from ...files.access.content import check_not_read
from ...files.access.folders import Listing
from ...files.access.known_names import BATCH as KINDS
from ...files.input_kinds import Kind
from ...files.pictures.picture_files import check_writable
from ...files.writing.film import check_film
from ...files.writing.maps_and_points import check_normals_path
from ...gpu.context.software_driver import is_software
from ...notes.notes import once, print_note
from ...notes.words import counted, option
from ...scene.graph import check_of_clouds, given_by
from ...scene.option_fields import BATCH, Cli
from ...scene.viewpoint import View, check_turntable, moves_camera
from .. import options
from ..help import complete_input
from ..inputs import check_look, view_of
from ..option_groups import AppearanceGroup, cli_option, option_info
from ..output import SOFTWARE, complain, print_line, progress


@dataclass(frozen=True)
class BatchOptions:
    """What comes out of a batch, and who does it."""

    to: str = cli_option(
        f"What comes out, the ending of each name: {', '.join(KINDS)}. Films are one for each sequence.",
        Cli(BATCH, "KIND", KINDS),
        default="png",
    )
    workers: int | None = cli_option("Processes that draw. Default: one for each core.", Cli(BATCH, "N"), min=1)
    ray: str | None = cli_option(
        "Draw on a Ray cluster, as at auto or host:6379, instead of on this machine; local starts a Ray here. "
        "Its machines must all see INPUT.",
        Cli(BATCH, "local|ADDRESS"),
    )
    num_gpus: float | None = cli_option(
        "With --ray: GPUs for each worker, which draws on that GPU; 0.25 lets four share one.", Cli(BATCH, "N"), min=0
    )
    shard: str | None = cli_option(
        "Do part I of N, counted from 1, as in --shard $SLURM_ARRAY_TASK_ID/8 with sbatch --array=1-8.",
        Cli(BATCH, "I/N"),
    )
    resume: bool = cli_option(
        "Go on: do again what the manifest does not prove to be whole and made of the same input, with the "
        "same options and version.",
        Cli(BATCH),
        default=False,
    )
    overwrite: bool = cli_option(
        "Do everything again, and write over files that are read as inputs, too.", Cli(BATCH), default=False
    )

    def part(self) -> tuple[int, int] | None:
        """Which part of how many, from 1. Raises ValueError for anything else."""
        if self.shard is None:
            return None
        number, _, count = self.shard.partition("/")
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            expected = f"{option('shard')} is a part from 1 and how many there are, such as 1/8 to 8/8"
            way_out = "with an array from 0 add 1, as in $((SLURM_ARRAY_TASK_ID+1))/8"
            raise ValueError(f"{expected}, got {self.shard!r}: {way_out}")
        return int(number), int(count)


@dataclass(frozen=True)
class BatchCommand:
    """What was typed."""

    inputs: Annotated[
        list[str],
        typer.Argument(
            metavar="INPUT",
            help="Folders with a sequence or a frame, folders of such folders, depth files, scenes, point clouds "
            "or folders of them, built-in names.",
            autocompletion=complete_input,
        ),
    ]
    output: Annotated[
        Path, option_info("The folder to write to, and its manifest.jsonl.", Cli(BATCH, "DIR"), "-o", "--output")
    ]
    how: BatchOptions
    reading: options.ReadingOptions
    cloud: options.CloudGroup
    look: AppearanceGroup
    place: options.ViewOptions
    picture: options.PictureOptions
    film: options.FilmOptions
    page: options.PageOptions
    axes: options.Axes = None
    bits: options.Bits = 8
    device: options.Device = 0
    quiet: options.Quiet = False


INTERRUPTED = 130  # exit code


@options.spread
def batch(asked: BatchCommand) -> None:
    """Draw many INPUTs to a folder, in several processes: pictures, normals, pages, or a film of each sequence.

    Each picture is the one that render makes of its frame alone. What is there and whole is skipped; what fails is
    listed at the end (exit code 3). After Ctrl+C, the same command with --resume goes on.
    """

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


UNMARKED = ("jpg", "webp", "tif", *FILMS)  # in these, readers of frames do not recognise renderings


def plan_batch(asked: BatchCommand) -> tuple[Sequence[Planned], list[Failure]]:
    """What this process has to care for. Raises ValueError or OSError for options and inputs that cannot be."""
    part = asked.how.part()
    _check(asked)
    folder = Path(os.path.realpath(asked.output))  # resolve() fails where a link leads to itself
    views = {kind: _view(asked, folder, kind) for kind in Kind}
    listing = Listing()
    sources = find_sources(asked.inputs, folder, listing)
    _check_apart(asked, sources, folder)
    kinds = {source.path: source.kind for source in sources}
    _check_kinds(asked, {*kinds.values()})
    _make_folder(asked.output)
    _check_writable(asked, folder)
    reading = tuple(plain_value(asked.reading).items())
    writing: tuple[Any, ...] = asked.axes, asked.bits, asked.page.exactness, asked.page.title
    given = dict.fromkeys(Kind, reading) | {Kind.CLOUD: reading + tuple(asked.cloud.cloud_options.items())}

    def job_for(source: Source) -> Job:
        """The job of a source, without frame and path."""
        kind, film = kinds[source.path], asked.film
        return Job(
            source.path, folder, asked.how.to, None, views[kind], given[kind], film.turntable, film.frames, film.fps,
            *writing,
        )  # fmt: skip

    planned, failures = plan(sources, job_for, folder, listing)
    sentences = "\n".join(failure.sentence for failure in failures)
    failures += [Failure(*one) for one in not_whole(asked.inputs, listing) if one[1] not in sentences]
    if failures and not planned:
        raise ValueError(failures[0].sentence)
    if not asked.how.overwrite:
        check_not_read(*(one.job.path for one in planned))
    return shard_of(planned, part), failures


def _check_kinds(asked: BatchCommand, kinds: set[Kind]) -> None:
    """Raises ValueError for options that what is drawn has not."""
    look, plain = asked.look.look(), AppearanceGroup().look()
    if Kind.SCENE in kinds:
        check_look(look, plain)
    if Kind.CLOUD in kinds:
        check_of_clouds(given_by(look, plain))
    elif asked.cloud.cloud_options:
        raise ValueError(f"no INPUT is a point cloud: leave out {', '.join(map(option, asked.cloud.cloud_options))}")


def _view(asked: BatchCommand, folder: Path, of: Kind) -> View:
    """From where, under which lights and how one kind of source is drawn."""
    to, output, turns = asked.how.to, folder / f"*.{asked.how.to}", moves_camera(asked.film.turntable)
    if to in NORMALS:
        return asked.place.view(asked.look.look(), asked.look.lights(shadow=of is not Kind.FRAMES))
    return view_of(of, asked.look, asked.place, asked.picture, output, is_film=to in FILMS, is_changed=turns)


def _check(asked: BatchCommand) -> None:
    """Raises ValueError for options that do not go together."""
    how, picture, kind = asked.how, asked.picture, asked.how.to
    check_choice(option("to"), kind, KINDS)
    if how.num_gpus is not None and how.ray is None:
        raise ValueError(f"{option('num_gpus')} is of a Ray cluster: add {option('ray', 'local', 'ADDRESS')}")
    if how.resume and how.overwrite:
        raise ValueError(f"pass {option('resume', True)} or {option('overwrite', True)}, not both")
    if kind in FILMS:
        check_fps(asked.film.fps, option("fps"), "pictures")
        if asked.film.turntable is not None:
            check_turntable(asked.film.turntable)
        if asked.look.align and asked.film.turntable is not None:
            fact = f"{option('align', True)} is of several frames, {option('turntable')} shows one"
            raise ValueError(f"{fact}: leave one out")
    else:
        _check_still(asked)
    if kind == PAGE:
        check_choice(option("quality"), asked.page.exactness, options.QUALITIES)
    else:
        asked.page.check_none(Path(f"*.{kind}"))
    if kind in NORMALS:
        picture.check_none(Path(f"*.{kind}"))
    elif asked.axes is not None or asked.bits != 8:
        raise ValueError(f"{option('axes')} and {option('bits')} are of normals: add {option('to', NORMALS[0])}")


def _check_still(asked: BatchCommand) -> None:
    """Raises ValueError for what only films have."""
    films = f"{option('to', 'mp4')} or {option('to', 'gif')}"
    if asked.film.turntable is not None:
        raise ValueError(f"{option('turntable')} makes films: add {films}")
    if asked.look.align:
        fact = f"{option('align', True)} corrects the poses of several frames of one thing"
        raise ValueError(f"{fact}, and each picture is drawn alone: add {films}, or leave it out")
    if asked.look.temporal:
        raise ValueError(f"{option('temporal', True)} filters over time, and each picture is drawn alone: add {films}")


def _check_apart(asked: BatchCommand, sources: Sequence[Source], folder: Path) -> None:
    """Raises ValueError for outputs in the folder of a sequence, which would be taken for its colours."""
    paths = map(Path, {source.path for source in sources})
    near = (path for path in paths if path.name in folder.parts or path.is_symlink())  # few: links need not be followed
    inside = [path for path in near if folder.is_relative_to(os.path.realpath(path))]
    if inside and asked.how.to in UNMARKED:
        fact = f"which would take each {asked.how.to} there for its own colours"
        way_out = f"pass another -o DIR, or {option('to', 'png')}"
        raise ValueError(f"{asked.output} is in {inside[0]}, {fact}: {way_out}")


def _check_writable(asked: BatchCommand, folder: Path) -> None:
    """Raises ValueError for a kind that needs an extra which is not installed, OSError for no such place."""
    to, chosen = asked.how.to, {"axes": asked.axes, "bits": asked.bits}
    checks = {PAGE: check_place} | dict.fromkeys(FILMS, check_film)
    checks |= dict.fromkeys(NORMALS, partial(check_normals_path, **chosen))
    with suppress(PermissionError):  # which is reported once something is to be written
        checks.get(to, check_writable)(folder / f"*.{to}")


def _make_folder(output: Path) -> None:
    """Makes the folder to write to, if need be. Raises OSError if there can be none."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        expected = "a folder for many outputs: pass another -o DIR"
        raise NotADirectoryError(f"{output} is a file, expected {expected}") from None
    except OSError as error:
        raise OSError(f"cannot make the folder {output}: {error.strerror}") from None


FAILED = 3  # exit code


def run(asked: BatchCommand, planned: Sequence[Planned], failures: list[Failure], started: float) -> None:
    """Does what is not done, and reports what has become of it: exit code 3 if anything failed."""
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
    outcomes = [f"{count} {name}" for name, count in (counts | {"failed": len(failures)}).items() if count]
    print_line(f"{output}: {', '.join(outcomes) or 'nothing to do'}, {time.perf_counter() - started:.1f} s")
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


def _outcomes(asked: BatchCommand, todo: Sequence[Planned]) -> Iterator[tuple[Planned, Done | Failed]]:
    """What becomes of each. Notes that workers send are printed once; a bar moves on a terminal."""
    after_each, by_path = once(print_note), {one.job.path: one for one in todo}
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
                    after_each(SOFTWARE.format(outcome.renderer))
                for note in outcome.notes:
                    after_each(note)
            yield by_path[job.path], outcome
            advance(done, len(todo))
