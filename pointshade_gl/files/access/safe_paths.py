"""Restricts which files a file may name: only those in its own folder, unless the caller allows others."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...notes.words import option, shown
from .content import followed
from .folder_listing import Listing

_LONGEST = 1024  # characters of a name
_ABSOLUTE = re.compile(r"[A-Za-z]:|[/\\]")
_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:[/\\]")


@dataclass(frozen=True)
class Folder:
    """A folder, and what the files in it may name.

    allow_outside  names in its files may leave it
    root           its files must lie in here, also with links followed: the folder of a scene, which came as a whole.
                   Without a root any link is followed: it is the user's own, perhaps to a data set on another disk.
    listing        what lies in it and around it, looked at once
    """

    path: Path
    allow_outside: bool = False
    root: Path | None = None
    listing: Listing = field(default_factory=Listing, compare=False, repr=False)

    def named(self, text: Any) -> Path:
        """The path for a name in a file here, links not followed. Raises ValueError if it is absolute or leaves."""
        if not isinstance(text, str) or not 0 < len(text) < _LONGEST or "\0" in text:
            raise ValueError(f"a file must be named by a text, got {shown(text)}")
        is_address = _ADDRESS.match(text)
        if is_address or (_ABSOLUTE.match(text) and not self.allow_outside):
            way_out = ", and nothing is fetched" if is_address else self._way_out()
            raise ValueError(
                f"{shown(text)} is an address or an absolute path, expected a path relative to {self._title}{way_out}"
            )
        if self.allow_outside or ".." not in text:
            return self.path / text
        if _climbs(text):
            raise ValueError(f"{shown(text)} leaves {self._title}{self._way_out()}")
        return self.path / os.path.normpath(text)  # a/.. is nothing here, also where a is a link

    def check(self, path: Path) -> Path:
        """The path of a file in this folder. Raises ValueError if links lead out of the root."""
        if self.root is None or self.allow_outside:
            return path
        if not followed(path).is_relative_to(followed(self.root)):
            name = path.relative_to(self.path) if path.is_relative_to(self.path) else path
            raise ValueError(f"{shown(str(name))} leaves the scene's folder{self._way_out()}")
        return path

    def own(self, path: Path) -> Path:
        """The path of a file in this folder as it is listed here, however it is written; any other path itself."""
        here, rooted = from_root(self.path), from_root(path)
        return self.path / rooted.relative_to(here) if rooted.is_relative_to(here) else path

    @property
    def _title(self) -> str:
        return "the scene's folder" if self.path == self.root else f"the folder {self.path}"

    def _way_out(self) -> str:
        return f": pass {option('allow_outside', True, beside_file=True)} to allow it"


def places_of(path: Path) -> list[Path]:
    """Where a path lies, from the root; then what it leads to, if there are links on the way.

    What belongs to a file is known by names and neighbours. Those of the place where it lies come first: in a data set
    that is made of links (git-annex, DVC) what they lead to has neither. Where nothing is found there, as beside a
    single link to a data set on another disk, those of the file itself count.
    """
    return list(dict.fromkeys((from_root(path), followed(path))))


def from_root(path: Path) -> Path:
    """The path from the root, without dots. Links stay, but "link/.." is the folder above what the link leads to."""
    top, *parts = path.absolute().parts
    here = Path(top)
    for part in parts:
        here = here / part if part != ".." else (followed(here) if here.is_symlink() else here).parent
    return here


def _climbs(text: str) -> bool:
    """Whether a relative path goes above its start on the way, on any system."""
    depth = 0
    for part in re.split(r"[/\\]", text):
        depth += {"..": -1, ".": 0, "": 0}.get(part, 1)
        if depth < 0:
            return True
    return False
