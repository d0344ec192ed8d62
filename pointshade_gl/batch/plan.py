"""What a batch is going to do: a job for each output, and which of them are done already."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import NamedTuple

from ..files.access.atomic_write import name_key, tells_case_apart
from ..files.access.folders import Listing
from ..notes.errors import error_text
from ..notes.version import __version__
from .inputs import Source
from .jobs import FILMS, Job
from .manifest import Entry, Manifest, differs, is_whole, told
from .source_files import parts_of, whole_of


class Planned(NamedTuple):
    """A job, and what the manifest says that its output was made from."""

    job: Job
    made_from: Entry


class Failure(NamedTuple):
    """An output, or a source of many, that there is not; and why."""

    name: str
    sentence: str


def plan(
    sources: Sequence[Source], job_for: Callable[[Source], Job], output: Path, listing: Listing
) -> tuple[list[Planned], list[Failure]]:
    """The jobs of all sources in their order, and the sources that cannot be listed.

    job_for  a job of the source with everything but its frame and its path
    listing  of their folders, from when they were found

    A frame's output is called by the number that it has in its sequence, in a folder of the sequence's name; that of a
    single frame, a scene or a film by the name of the source. Raises ValueError where two outputs have the same name.
    """
    planned: dict[Path, Planned] = {}
    twins: dict[str, Path] = {}  # one file where case does not count
    failures: list[Failure] = []
    last, options = None, {}
    for source in sources:
        job = job_for(source)
        if last is None or not _is_alike(job, last):
            last, options = job, _options_of(job)
        made_from = {"version": __version__, "options": options}
        try:
            parts = parts_of(source, dict(job.reading), output, listing)
        except Exception as error:  # also a bug: the other sources are drawn
            failures.append(Failure(str(source.name), error_text(error)))
            continue
        is_film = job.kind in FILMS
        digits = max(4, len(str(parts[-1].number)))
        for part in [whole_of(source, parts)] if is_film else parts[: job.frames]:
            number = "" if is_film or len(parts) == 1 else f"/{part.number:0{digits}d}"
            path = output / f"{source.name}{number}.{job.kind}"
            twin = twins.setdefault(name_key(str(path)), path)
            if path in planned or (twin != path and not tells_case_apart(output)):
                other = planned[twin].job.source
                raise ValueError(f"{other} and {source.path} would both become {path}: pass them with two -o DIR")
            one = {"input": part.input, "frame": part.number, "state": part.state}
            planned[path] = Planned(replace(job, path=path, number=part.number), one | made_from)
    return list(planned.values()), failures


def shard_of(planned: Sequence[Planned], part: tuple[int, int] | None) -> Sequence[Planned]:
    """Part i of n, from 1: neighbours stay together, as each process opens the sequences that it draws."""
    if part is None:
        return planned
    number, count = part
    return planned[len(planned) * (number - 1) // count : len(planned) * number // count]


def split_done(
    planned: Sequence[Planned], manifest: Manifest, thoroughly: bool
) -> tuple[list[Planned], list[tuple[Path, str]]]:
    """What is to be done, as its output is not there or not whole; and outputs that were made otherwise, and how so.

    thoroughly  whole is what the manifest proves: a line for the file, and the same bytes
    """
    missing: list[Planned] = []
    changed: list[tuple[Path, str]] = []
    for one in planned:
        entry = manifest.of(one.job.path)
        if not is_whole(one.job.path, entry, thoroughly):
            missing.append(one)
        elif entry and (how_so := differs(entry, one.made_from)):
            changed.append((one.job.path, how_so))
            if thoroughly:
                missing.append(one)
    return missing, changed


def _is_alike(one: Job, other: Job) -> bool:
    """Whether two jobs without a path differ by their sources alone; those of one command share all else."""
    return all(getattr(one, part.name) is getattr(other, part.name) for part in fields(Job) if part.name != "source")


def _options_of(job: Job) -> Entry:
    """All that decides how an output looks, as JSON has it; nothing that is the default."""
    plain = Job("", Path())
    names = ("turntable", "frames", "fps") if job.kind in FILMS else ("axes", "bits", "quality", "title")
    options = {"view": told(job.view), **dict(job.reading)}
    options |= {name: getattr(job, name) for name in names if getattr(job, name) != getattr(plain, name)}
    return json.loads(json.dumps({name: value for name, value in options.items() if value not in (None, {})}))
