"""What `pointshade batch` is asked for: the jobs, after all options are checked."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import Any

from ..batch.batch_inputs import Source, find_sources, not_whole
from ..batch.jobs import FILMS, NORMALS, PAGE, Job
from ..batch.manifest import Failure, Planned, plan, shard_of, told
from ..checks.arguments import check_choice, check_fps
from ..files.access.atomic_write import check_place
from ..files.access.content import check_not_read
from ..files.access.folders import Listing
from ..files.access.known_names import BATCH as KINDS
from ..files.frame_sources import is_cloud, is_scene
from ..files.pictures.picture_files import check_writable
from ..files.writing.film import check_film
from ..files.writing.maps_and_points import check_normals_path
from ..notes.words import option
from ..scene.graph import check_of_clouds, given_by
from ..scene.viewpoint import View, check_turntable, moves_camera
from .batch_options import Asked
from .inputs import check_look
from .look_options import LookOptions
from .page_options import NAMES
from .picture_options import view_of

UNMARKED = ("jpg", "webp", "tif", *FILMS)  # readers of frames cannot tell that these are renderings


class Kind(Enum):
    """What a source is."""

    FRAMES, SCENE, CLOUD = range(3)

    @classmethod
    def of(cls, path: str) -> Kind:
        return cls.SCENE if is_scene(path) else cls.CLOUD if is_cloud(path) else cls.FRAMES


def plan_batch(asked: Asked) -> tuple[Sequence[Planned], list[Failure]]:
    """What this process has to care for. Raises ValueError or OSError for options and inputs that cannot be."""
    part = asked.how.part()
    _check(asked)
    folder = Path(os.path.realpath(asked.output))  # resolve() fails where a link leads to itself
    views = {kind: _view(asked, folder, kind) for kind in Kind}
    listing = Listing()
    sources = find_sources(asked.inputs, folder, listing)
    _check_apart(asked, sources, folder)
    kinds = {source.path: Kind.of(source.path) for source in sources}
    _check_kinds(asked, {*kinds.values()})
    _make_folder(asked.output)
    _check_writable(asked, folder)
    reading = tuple(told(asked.reading).items())
    given = {kind: reading + (tuple(told(asked.cloud).items()) if kind is Kind.CLOUD else ()) for kind in Kind}
    planned, failures = plan(
        sources,
        lambda one: _job(asked, one, folder, given[kinds[one.path]], views[kinds[one.path]]),
        folder,
        listing,
    )
    said = "\n".join(failure.sentence for failure in failures)
    failures += [Failure(*one) for one in not_whole(asked.inputs, listing) if one[1] not in said]
    if failures and not planned:
        raise ValueError(failures[0].sentence)
    if not asked.how.overwrite:
        check_not_read(*(one.job.path for one in planned))
    return shard_of(planned, part), failures


def _check_kinds(asked: Asked, kinds: set[Kind]) -> None:
    """Raises ValueError for options that what is drawn has not."""
    look, plain = asked.look.look(), LookOptions().look()
    if Kind.SCENE in kinds:
        check_look(look, plain)
    if Kind.CLOUD in kinds:
        check_of_clouds(given_by(look, plain))
    elif asked.cloud.cloud_options:
        raise ValueError(f"no INPUT is a point cloud: leave out {', '.join(map(option, asked.cloud.cloud_options))}")


def _view(asked: Asked, folder: Path, of: Kind) -> View:
    """From where, under which lights and how one kind of source is drawn."""
    kind, turns, of_scene = asked.how.to, moves_camera(asked.film.turntable), of is not Kind.FRAMES
    if kind in NORMALS:
        return asked.place.view(asked.look.look(), asked.look.lights(shadow=of_scene))
    return view_of(
        asked.look, asked.place, asked.picture, folder / f"*.{kind}",
        is_scene=of_scene, is_film=kind in FILMS, is_changed=turns, is_cloud=of is Kind.CLOUD,
    )  # fmt: skip


def _job(asked: Asked, source: Source, folder: Path, reading: tuple[tuple[str, Any], ...], view: View) -> Job:
    """The job of a source, without frame and path."""
    kind, film = asked.how.to, asked.film
    writing: tuple[Any, ...] = asked.axes, asked.bits, asked.page.exactness, asked.page.title
    return Job(source.path, folder, kind, None, view, reading, film.turntable, film.frames, film.fps, *writing)


def _check(asked: Asked) -> None:
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
            raise ValueError(
                f"{option('align', True)} is of several frames, {option('turntable')} shows one: leave one out"
            )
    else:
        _check_still(asked)
    if kind == PAGE:
        check_choice(option("quality"), asked.page.exactness, NAMES)
    else:
        asked.page.check_none(Path(f"*.{kind}"))
    if kind in NORMALS:
        picture.check_none(Path(f"*.{kind}"))
    elif asked.axes is not None or asked.bits != 8:
        raise ValueError(f"{option('axes')} and {option('bits')} are of normals: add {option('to', NORMALS[0])}")


def _check_still(asked: Asked) -> None:
    """Raises ValueError for what only films have."""
    films = f"{option('to', 'mp4')} or {option('to', 'gif')}"
    if asked.film.turntable is not None:
        raise ValueError(f"{option('turntable')} makes films: add {films}")
    if asked.look.align:
        raise ValueError(
            f"{option('align', True)} corrects the poses of several frames of one thing, and each picture is drawn "
            f"alone: add {films}, or leave it out"
        )
    if asked.look.temporal:
        raise ValueError(f"{option('temporal', True)} filters over time, and each picture is drawn alone: add {films}")


def _check_apart(asked: Asked, sources: Sequence[Source], folder: Path) -> None:
    """Raises ValueError for outputs in the folder of a sequence, which would be taken for its colours."""
    paths = map(Path, {source.path for source in sources})
    near = (path for path in paths if path.name in folder.parts or path.is_symlink())  # few: links need not be followed
    inside = [path for path in near if folder.is_relative_to(os.path.realpath(path))]
    if inside and asked.how.to in UNMARKED:
        raise ValueError(
            f"{asked.output} is in {inside[0]}, which would take each {asked.how.to} there for its own colours: "
            f"pass another -o DIR, or {option('to', 'png')}"
        )


def _check_writable(asked: Asked, folder: Path) -> None:
    """Raises ValueError for a kind that needs an extra which is not installed, OSError for no such place."""
    path = folder / f"*.{asked.how.to}"
    with suppress(PermissionError):  # which is told once something is to be written
        if asked.how.to in FILMS:
            check_film(path)
        elif asked.how.to in NORMALS:
            check_normals_path(path, asked.axes, asked.bits)
        elif asked.how.to == PAGE:
            check_place(path)
        else:
            check_writable(path)


def _make_folder(output: Path) -> None:
    """Makes the folder to write to, if need be. Raises OSError if there can be none."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(
            f"{output} is a file, expected a folder for many outputs: pass another -o DIR"
        ) from None
    except OSError as error:
        raise OSError(f"cannot make the folder {output}: {error.strerror}") from None
