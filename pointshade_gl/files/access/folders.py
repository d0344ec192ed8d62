"""What lies in a folder and what its names mean; and which files a file may name."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import accumulate, islice
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from ...notes.words import option, shown
from .content import FOLDER_FILES, followed
from .known_names import ABOUT_FRAMES, ANY_PICTURE, COLOR, DEPTH, NEITHER, ONLY_DEPTH, REGISTERED, SHOWN_DEPTH

LEVELS = 3  # folders in folders in folders
_MOST_ABOVE = 7  # folders from a picture up to the top of its tree: set/depth/scene/clone/frames/depth/camera
_ORDER = attrgetter("order")
_DIGITS = re.compile(r"(\d+)")
_remembered = lru_cache(4096)  # the folders of a batch have files of the same names
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_BITS = re.compile(r"(?<!\d)\d+bits?")  # of leftImg8bit
_PARTS = sorted(
    DEPTH | COLOR - {"wide", "im"} | {"pose", "meta", "intrinsics", "conf", "confidence", "mask"}, key=len, reverse=True
)
_ROLE_WORD = re.compile(rf"(?:^|(?<=[\W_])|(?<=\d))(?:{'|'.join([*_PARTS, 'im'])})(?=[\W_]|\d|$)")


@dataclass(frozen=True)
class ListedFile:
    """A file of a folder. Its name, and the folders that it lies in, show what it is for."""

    path: Path
    name: str  # relative to the folder, in lower case, with slashes

    @cached_property
    def suffix(self) -> str:
        """Of its own name, with the dot, in lower case; "" without one."""
        name = self.name.rpartition("/")[2]
        return name[name.rfind(".") :] if "." in name else ""

    @cached_property
    def stem(self) -> str:
        """Of its own name, in lower case."""
        return self.name.rpartition("/")[2].removesuffix(self.suffix)

    @cached_property
    def level(self) -> int:
        return self.name.count("/")

    @cached_property
    def order(self) -> tuple[tuple[int, str], ...]:
        return natural(self.path.name)

    @cached_property
    def words(self) -> frozenset[str]:
        """Of its own name."""
        return words_of(self.path.stem)

    @cached_property
    def folder_words(self) -> frozenset[str]:
        """Of the folders in which it lies, below the one that was listed."""
        return words_of(" ".join(self.path.parts[-1 - self.level : -1]))

    @cached_property
    def role(self) -> str:
        """Its kind: depth, shown depth (a picture of it, for the eye), color, other; "" if unknown."""
        own = self.words - ANY_PICTURE if self.folder_words & DEPTH else self.words
        for words in (own, self.folder_words):
            is_depth, is_color = bool(words & DEPTH), bool(words & COLOR)
            if words & SHOWN_DEPTH and is_depth:
                return "shown depth"
            if words & NEITHER:
                return "other"
            if is_depth and words & {"color", "colour", "rgb"} and words is own:
                first = re.search(r"depth|colou?r|rgb", self.stem)  # of depth_to_color.png and color_to_depth.png
                is_first = first and first[0] == "depth"
                return "shown depth" if "to" not in words else "depth" if is_first else "color"
            if is_depth or (is_color and self.suffix not in ONLY_DEPTH):
                return "depth" if is_depth else "color"
        return ""

    @cached_property
    def is_registered(self) -> bool:
        """Whether by its name it is depth which was brought to the colour's camera."""
        return REGISTERED.search(self.name) is not None

    @cached_property
    def key(self) -> str:
        """What the files of one frame have in common: 0001 of depth_0001.png, frame-0001 of frame-0001.color.png."""
        return key_of(self.stem)

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """The whole numbers in its name, by which files of one frame are matched where their names differ."""
        return numbers_in(self.key)

    @cached_property
    def time(self) -> float | None:
        return float(self.key) if re.fullmatch(r"\d{1,18}(\.\d{0,18})?", self.key) else None


@_remembered
def key_of(stem: str) -> str:
    """A name without its suffix, in lower case, without the words for what the file is."""
    return _ROLE_WORD.sub("", _BITS.sub("", stem)).strip("._- ")


def numbers_in(key: str) -> tuple[int, ...]:
    """The whole numbers of a name without its suffix."""
    return tuple(int(number[:18]) for number in re.findall(r"\d+", key))


@_remembered
def words_of(name: str) -> frozenset[str]:
    """The words in a name, in lower case: depth and map of rawDepth-map_01."""
    return frozenset(word.lower() for word in _WORD.findall(name))


class Listing:
    """What lies in folders. Each of them is looked at once: what changes afterwards is not seen."""

    def __init__(self) -> None:
        self._seen: dict[Path, _SeenFolder] = {}

    def files(self, folder: Path, levels: int, suffixes: Collection[str] | None = None) -> list[ListedFile]:
        """Return all files up to so many folders deep, in natural order, without hidden ones; only those with suffixes.
        Suffixes are in lower case, "" for none."""
        found = self._walk(self._look(folder), "", levels)
        return sorted((item for item in found if suffixes is None or item.suffix in suffixes), key=_ORDER)

    def folders(self, folder: Path) -> list[Path]:
        """Return the folders in a folder, in natural order, without hidden ones."""
        return self._look(folder).folders

    def twins(self, folder: Path, suffixes: Collection[str]) -> list[ListedFile]:
        """Return files at the place of a folder in the trees beside its own: of set/depth/a/b those in set/rgb/a/b.

        Those above on the way, and set/poses/a.txt, belong to it, too. Its own tree is called for depth; names are
        relative to what holds the trees.
        """
        for place in places_of(folder):
            for k, tree in enumerate(islice(place.parents, _MOST_ABOVE), 1):
                if not words_of(tree.name) & DEPTH:
                    continue
                tops, rest = [one for one in self.folders(tree.parent) if one != tree], place.parts[-k:]
                if any(words_of(part) & DEPTH for part in rest):  # vkitti_depth/x/depth; else a set that is called so
                    name = key_of(tree.name.lower())
                    tops = [one for one in tops if name and one.name.lower().startswith(name)]
                tops = [
                    one for one in tops if k > 1 or words_of(one.name) & COLOR or ABOUT_FRAMES.search(one.name.lower())
                ]
                found = [path for top in tops for path in self._on_the_way(top, rest)]
                items = [ListedFile(path, path.relative_to(tree.parent).as_posix().lower()) for path in found]
                if items := sorted((one for one in items if one.suffix in suffixes), key=_ORDER):
                    return items
        return []

    def _on_the_way(self, top: Path, rest: Collection[str]) -> list[Path]:
        """Files in the folders of a tree down a path, whose parts for depth are called otherwise there."""
        found: list[Path] = []
        here = [top]
        for part in rest:
            found += [path for one in here for path in self._look(one).files if path.stem == part]
            inside = [path for one in here for path in self.folders(one)]
            here = [path for path in inside if path.name == part or words_of(part) & DEPTH]
            found += [path for one in here for path in self._look(one).files]
        return found

    def not_whole(self, folder: Path) -> list[str]:
        """Return a sentence, with its path, for each folder looked at in this one of which something is left out."""
        missed = ((path, seen.missed) for path, seen in self._seen.items() if seen.missed)
        return [f"{path} {why}" for path, why in missed if path.is_relative_to(folder)]

    def _walk(self, seen: _SeenFolder, prefix: str, levels: int) -> Iterator[ListedFile]:
        """Files first, then what is in the folders."""
        if prefix not in seen.items:
            seen.items[prefix] = [ListedFile(path, prefix + path.name.lower()) for path in seen.files]
        yield from seen.items[prefix]
        if levels and len(seen.inside) < len(seen.folders):
            seen.inside.extend(map(self._look, seen.folders))
        for path, inside in zip(seen.folders, seen.inside, strict=True) if levels else ():
            yield from self._walk(inside, f"{prefix}{path.name.lower()}/", levels - 1)

    def _look(self, folder: Path) -> _SeenFolder:
        if folder not in self._seen:
            self._seen[folder] = _look_into(folder)
        return self._seen[folder]


class _SeenFolder(NamedTuple):
    """A folder's files, and the folders in it, in natural order."""

    files: list[Path]
    folders: list[Path]
    missed: str  # why something in it is left out; "" if nothing is
    inside: list[_SeenFolder]  # the same of its folders, once they were looked at
    # its files by what stands before their names, as seen from the folder that was asked for
    items: dict[str, list[ListedFile]]


def _look_into(folder: Path) -> _SeenFolder:
    """What is not hidden: macOS leaves hidden twins such as ._color.png on foreign disks."""
    try:
        with os.scandir(folder) as found:
            entries = list(islice((entry for entry in found if entry.name[0] != "."), FOLDER_FILES + 1))
    except OSError as error:  # it may not be read, or is gone
        return _SeenFolder([], [], f"cannot be read ({error.strerror}): what is in it is left out", [], {})
    missed = ""
    if len(entries) > FOLDER_FILES:
        missed = f"has more than {FOLDER_FILES} files: the others are left out; put them into several folders"
    kinds = [(one.path, _kind_of(one)) for one in entries[:FOLDER_FILES]]
    folders = [Path(path) for path, kind in kinds if kind == "folder"]
    folders.sort(key=lambda path: natural(path.name))
    return _SeenFolder([Path(path) for path, kind in kinds if kind == "file"], folders, missed, [], {})


def _kind_of(entry: os.DirEntry[str]) -> str:
    """ "folder", "file", or "" for all else, such as a link that leads to itself."""
    try:
        return "folder" if entry.is_dir() else "file" if entry.is_file() else ""
    except OSError:
        return ""


@_remembered
def natural(name: str) -> tuple[tuple[int, str], ...]:
    """Sorts 2.png before 10.png."""
    parts = ((part, part.lstrip("0")) for part in _DIGITS.split(name))
    return tuple((len(number), number) if part.isdecimal() else (-1, part) for part, number in parts)


_LONGEST = 1024  # characters of a name
_ABSOLUTE = re.compile(r"[A-Za-z]:|[/\\]")
_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:[/\\]")


@dataclass(frozen=True)
class Folder:
    """A folder, and what the files in it may name."""

    path: Path
    allow_outside: bool = False  # names in its files may leave it
    # its files must lie in here, also with links followed: the folder of a scene, which came as a whole. Without a root
    # any link is followed: it is the user's own, perhaps to a data set on another disk.
    root: Path | None = None
    levels: int = 2  # how far below it the cameras and poses of its frames may lie; 0 beside a file that was named
    # what lies in it and around it, looked at once
    listing: Listing = field(default_factory=Listing, compare=False, repr=False)

    def named(self, text: Any) -> Path:
        """The path for a name in a file here, links not followed. Raises ValueError if it is absolute or leaves."""
        if not isinstance(text, str) or not 0 < len(text) < _LONGEST or "\0" in text:
            raise ValueError(f"a file must be named by a text, got {shown(text)}")
        is_address = _ADDRESS.match(text)
        if is_address or (_ABSOLUTE.match(text) and not self.allow_outside):
            way_out = ", and nothing is fetched" if is_address else self._way_out()
            expected = f"expected a path relative to {self._title}{way_out}"
            raise ValueError(f"{shown(text)} is an address or an absolute path, {expected}")
        if self.allow_outside or ".." not in text:
            return self.path / text
        # whether it goes above its start on the way, on any system
        steps = ({"..": -1, ".": 0, "": 0}.get(part, 1) for part in re.split(r"[/\\]", text))
        if min(accumulate(steps)) < 0:
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

    Names and neighbours show what belongs to a file. Those where it lies come first: in a data set of links
    (git-annex, DVC) what they lead to has neither. Beside a single link to another disk those of the file itself count.
    """
    return list(dict.fromkeys((from_root(path), followed(path))))


def from_root(path: Path) -> Path:
    """The path from the root, without dots. Links stay, but "link/.." is the folder above what the link leads to."""
    top, *parts = path.absolute().parts
    here = Path(top)
    for part in parts:
        here = here / part if part != ".." else (followed(here) if here.is_symlink() else here).parent
    return here
