"""What a batch is going to do, and its manifest, the list of what is done.

The manifest has one line of JSON for each output, appended when the output is whole, at once: a process that is killed
loses no more than what it was doing. What cannot be read is passed over: a torn line, or one of a newer version.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..files.access.atomic_write import check_place, is_case_sensitive, name_key, sha256_of
from ..files.access.folders import Listing
from ..notes.errors import error_text
from ..notes.version import __version__
from ..notes.words import option
from ..scene.environment import NAMES, Environment
from .batch_inputs import Source, parts_of, whole_of
from .jobs import FILMS, Done, Job

# how whole files end; of others their size must do
_ENDS = {".png": b"IEND\xaeB`\x82", ".jpg": b"\xff\xd9", ".gif": b";", ".html": b"</html>"}
_OTHERWISE = {"version": "by another version", "options": "with other options"}
Entry = dict[str, Any]


class Manifest:
    """The lines of a folder's manifests by output, and the file that new ones go to.

    folder  of the outputs; their names in the manifest are relative to it
    shard   (i, n): its lines go to a file of their own, as other machines may write theirs at the same time

    Of several lines about an output the last one of a file counts; of several files, the one that was written last.

    Raises OSError if its own file can be none.
    """

    def __init__(self, folder: Path, shard: tuple[int, int] | None = None):
        self.folder = folder
        name = "manifest.jsonl" if shard is None else f"manifest.{shard[0]}-of-{shard[1]}.jsonl"
        self.path = check_place(folder / name, only_read=True)
        self.entries: dict[str, Entry] = {}
        self._torn = self.path.exists() and self.path.read_bytes()[-1:] not in (b"", b"\n")  # its last line
        for path in sorted(filter(Path.is_file, folder.glob("manifest*.jsonl"))):
            for output, entry in {entry["output"]: entry for entry in _lines_of(path)}.items():
                before = self.entries.get(output)
                if before is None or str(entry.get("time")) >= str(before.get("time")):
                    self.entries[output] = entry

    def of(self, output: Path) -> Entry | None:
        return self.entries.get(self._name(output))

    def add(self, done: Done, made_from: Entry) -> None:
        """Appends the line of an output. made_from: input, options and version, as `differs` compares them. Raises
        OSError if the line cannot be written, such as on a full disk."""
        seconds = round(done.seconds, 3)
        measured = {"size": done.size, "sha256": done.sha256, "seconds": seconds, "renderer": done.renderer}
        now = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        entry = {"output": self._name(done.path), **made_from, "time": now, **measured}
        self.entries[entry["output"]] = entry
        line = ("\n" * self._torn + json.dumps(entry) + "\n").encode()
        try:
            with self.path.open("ab", buffering=0) as file:  # at once: others may append, too
                if file.write(line) < len(line):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise OSError(no_room(self.path, error)) from None
        self._torn = False

    def _name(self, output: Path) -> str:
        return output.relative_to(self.folder).as_posix()


def no_room(path: Path, error: OSError) -> str:
    """What to do about a file that cannot be written."""
    why, resume = os.strerror(error.errno or errno.ENOSPC), option("resume", True)
    return f"cannot write {path}: {why}: make room, then the same command with {resume} goes on"


def differs(entry: Entry, made_from: Entry) -> str:
    """How an output was made otherwise than it would be now: "with other options"; "" if it was not."""
    changed = (name for name, value in made_from.items() if entry.get(name) != value)
    return next((_OTHERWISE.get(name, "from other input") for name in changed), "")


def is_whole(output: Path, entry: Entry | None, thoroughly: bool = False) -> bool:
    """Whether the file is there and ends as files of its format do; of other formats, has the manifest's size.
    thoroughly: each byte is compared with the manifest: it must have a line for the file."""
    try:
        size = output.stat().st_size
        if thoroughly:
            return entry is not None and entry.get("size") == size and sha256_of(output)[1] == entry.get("sha256")
        end = _ENDS.get(output.suffix.lower())
        if not size or end is None:
            return bool(size) and (entry is None or entry.get("size") == size)
        with output.open("rb") as file:
            file.seek(max(size - 64, 0))
            return file.read().rstrip(b"\n").endswith(end)
    except OSError:
        return False


def plain_value(value: Any) -> Any:
    """A value as JSON has it: of a dataclass the fields that are not their default; of an environment what identifies
    it."""
    if isinstance(value, Environment):
        return value.name if value.name in NAMES else f"sha256:{hashlib.sha256(value.picture.tobytes()).hexdigest()}"
    if is_dataclass(value):
        plain = _defaults(type(value))
        return {name: one for name, one in _plain_fields(value).items() if one != plain[name]}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain_value(one) for one in value] if isinstance(value, list | tuple) else value


def _plain_fields(value: Any) -> Entry:
    return {field.name: plain_value(getattr(value, field.name)) for field in fields(value)}


_defaults = cache(lambda kind: _plain_fields(kind()))  # of a dataclass


def _lines_of(path: Path) -> Iterable[Entry]:
    for line in path.read_bytes().splitlines():
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):  # of brackets in brackets
            continue
        if isinstance(entry, dict) and isinstance(entry.get("output"), str):
            yield entry


class Planned(NamedTuple):
    """A job, and what its output is made from, as the manifest has it."""

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
            if path in planned or (twin != path and not is_case_sensitive(output)):
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
    thoroughly: whole is what the manifest proves: a line for the file, and the same bytes."""
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
    options = {"view": plain_value(job.view), **dict(job.reading)}
    options |= {name: getattr(job, name) for name in names if getattr(job, name) != getattr(plain, name)}
    return json.loads(json.dumps({name: value for name, value in options.items() if value not in (None, {})}))
