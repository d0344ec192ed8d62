"""What `pointshade batch` is asked for: the jobs, after all options are checked."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import __version__
from ..batch.inputs import Source, find_sources
from ..batch.jobs import FILMS, KINDS, NORMALS, PAGE, Job
from ..batch.manifest import told
from ..batch.plan import Failure, Planned, plan, shard_of
from ..files.access.atomic_write import check_place
from ..files.access.folder_listing import Listing
from ..files.pictures.picture_files import check_writable
from ..files.sources import is_scene
from ..files.writing.depth_and_normal_maps import check_normals_path
from ..files.writing.film import check_film
from ..messages.formatting import option
from ..messages.validation import check_choice, check_fps
from ..scene.view import View
from .batch_options import BatchOptions
from .inputs import check_look
from .look_options import LookOptions
from .options import FilmOptions, ReadingOptions, ViewOptions
from .page_options import NAMES, PageOptions
from .picture_options import PictureOptions, view_of

UNMARKED = ("jpg", "webp", "tif", *FILMS)  # readers of frames cannot tell that these are renderings


@dataclass(frozen=True)
class Asked:
    """What was typed, but for INPUT."""

    output: Path
    how: BatchOptions
    reading: ReadingOptions
    look: LookOptions
    place: ViewOptions
    picture: PictureOptions
    film: FilmOptions
    page: PageOptions
    axes: str | None
    bits: int

    def plan(self, inputs: list[str]) -> tuple[Sequence[Planned], list[Failure]]:
        """What this process has to care for. Raises ValueError or OSError for options and inputs that cannot be."""
        part = self.how.part()
        self._check()
        folder = Path(os.path.realpath(self.output))  # resolve() fails where a link leads to itself
        views = {is_one: self._view(folder, is_one) for is_one in (False, True)}
        listing = Listing()
        sources = find_sources(inputs, folder, listing)
        self._check_apart(sources, folder)
        if any(is_scene(source.path) for source in sources):
            check_look(self.look.look())
        _make_folder(self.output)
        self._check_writable(folder)
        given = tuple(told(self.reading).items())
        planned, failures = plan(
            sources, lambda one: self._job(one, folder, given, views[is_scene(one.path)]), folder, __version__, listing
        )
        if failures and not planned:
            raise ValueError(failures[0].sentence)
        return shard_of(planned, part), failures

    def _view(self, folder: Path, of_scene: bool) -> View:
        """From where, under which lights and how frames or scenes are drawn."""
        kind, turns = self.how.to, self.film.turntable == "camera"
        if kind in NORMALS:
            return self.place.view(self.look.look(), self.look.lights(shadow=of_scene))
        return view_of(
            self.look, self.place, self.picture, folder / f"*.{kind}",
            is_scene=of_scene, is_film=kind in FILMS, is_changed=turns,
        )  # fmt: skip

    def _job(self, source: Source, folder: Path, reading: tuple[tuple[str, Any], ...], view: View) -> Job:
        """The job of a source, without frame and path."""
        kind, film = self.how.to, self.film
        writing = self.axes, self.bits, self.page.exactness, self.page.title
        return Job(source.path, folder, kind, None, view, reading, film.turntable, film.frames, film.fps, *writing)

    def _check(self) -> None:
        """Raises ValueError for options that do not go together."""
        how, picture, kind = self.how, self.picture, self.how.to
        check_choice(option("to"), kind, KINDS)
        if how.num_gpus is not None and how.ray is None:
            raise ValueError(f"{option('num_gpus')} is of a Ray cluster: add {option('ray', 'local', 'ADDRESS')}")
        if how.resume and how.overwrite:
            raise ValueError(f"pass {option('resume', True)} or {option('overwrite', True)}, not both")
        if kind in FILMS:
            check_fps(self.film.fps, option("fps"), "pictures")
        else:
            self._check_still()
        if kind == PAGE:
            check_choice(option("quality"), self.page.exactness, NAMES)
        else:
            self.page.check_none(Path(f"*.{kind}"))
        if kind in NORMALS:
            picture.check_none(Path(f"*.{kind}"))
        elif self.axes is not None or self.bits != 8:
            raise ValueError(f"{option('axes')} and {option('bits')} are of normals: add {option('to', NORMALS[0])}")

    def _check_still(self) -> None:
        """Raises ValueError for what only films have."""
        films = f"{option('to', 'mp4')} or {option('to', 'gif')}"
        if self.film.turntable is not None:
            raise ValueError(f"{option('turntable')} makes films: add {films}")
        if self.look.temporal:
            raise ValueError(
                f"{option('temporal', True)} filters over time, and each picture is drawn alone: add {films}"
            )

    def _check_apart(self, sources: Sequence[Source], folder: Path) -> None:
        """Raises ValueError for outputs in the folder of a sequence, which would be taken for its colours."""
        inside = [source.path for source in sources if folder.is_relative_to(Path(source.path).resolve())]
        if inside and self.how.to in UNMARKED:
            raise ValueError(
                f"{self.output} is in {inside[0]}, which would take each {self.how.to} there for its own colours: "
                f"pass another -o DIR, or {option('to', 'png')}"
            )

    def _check_writable(self, folder: Path) -> None:
        """Raises ValueError for a kind that needs an extra which is not installed, OSError for no such place."""
        path = folder / f"*.{self.how.to}"
        if self.how.to in FILMS:
            check_film(path)
        elif self.how.to in NORMALS:
            check_normals_path(path, self.axes, self.bits)
        elif self.how.to == PAGE:
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
