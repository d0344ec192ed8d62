"""What lies in a folder: its files by level, and what their names say they are for."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from .file_name_patterns import ANY_PICTURE, COLOR, DEPTH, FRAME_SUFFIXES, NEITHER, ONLY_DEPTH, REGISTERED, SHOWN_DEPTH

LEVELS = 3  # folders in folders in folders
_MOST = 200_000  # files that are looked at
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_BITS = re.compile(r"(?<!\d)\d+bits?")  # of leftImg8bit
_PARTS = sorted(
    DEPTH | COLOR - {"wide", "im"} | {"pose", "meta", "intrinsics", "conf", "confidence", "mask"}, key=len, reverse=True
)
_ROLE_WORD = re.compile(rf"(?:^|(?<=[\W_])|(?<=\d))(?:{'|'.join([*_PARTS, 'im'])})(?=[\W_]|\d|$)")


@dataclass(frozen=True)
class Item:
    """A file of a folder. Its name, and the folders that it lies in, say what it is for."""

    path: Path
    name: str  # relative to the folder, in lower case, with slashes

    @cached_property
    def suffix(self) -> str:
        return suffix_of(self.name.rpartition("/")[2])

    @cached_property
    def stem(self) -> str:
        """Of its own name, in lower case."""
        name = self.name.rpartition("/")[2]
        return name.removesuffix(self.suffix)

    @cached_property
    def level(self) -> int:
        return self.name.count("/")

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
        """What it is: depth, shown depth (a picture of it, for the eye), color, other; "" if the name does not say."""
        own = self.words - ANY_PICTURE if self.folder_words & DEPTH else self.words
        for words in (own, self.folder_words):
            is_depth, is_color = bool(words & DEPTH), bool(words & COLOR)
            if words & SHOWN_DEPTH and is_depth:
                return "shown depth"
            if words & NEITHER:
                return "other"
            if is_depth and words & {"color", "colour", "rgb"} and words is own:
                return self._first_of_both()
            if is_depth or (is_color and self.suffix not in ONLY_DEPTH):
                return "depth" if is_depth else "color"
        return ""

    def _first_of_both(self) -> str:
        """Of depth_to_color.png and color_to_depth.png; without the "to" it is a picture of depth in colours."""
        if "to" not in self.words:
            return "shown depth"
        first = re.search(r"depth|colou?r|rgb", self.stem)
        return "depth" if first and first[0] == "depth" else "color"

    @cached_property
    def is_registered(self) -> bool:
        """Whether its name says that it is depth which was brought to the colour's camera."""
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
        """The time stamp, if the name is one."""
        return float(self.key) if re.fullmatch(r"\d{1,18}(\.\d{0,18})?", self.key) else None


def key_of(stem: str) -> str:
    """A name without its suffix, in lower case, without the words that say what the file is for."""
    return _ROLE_WORD.sub("", _BITS.sub("", stem)).strip("._- ")


def numbers_in(key: str) -> tuple[int, ...]:
    """The whole numbers of a name without its suffix."""
    return tuple(int(number[:18]) for number in re.findall(r"\d+", key))


def matches(keys: Sequence[str], items: Iterable[Item]) -> list[Path | None]:
    """For each frame, by its key, a file with the same key, numbers, last or first number. Empty if most have none."""
    items = [item for item in items if item.key]
    for same, is_part in _SAME:
        if is_part and len({same(key) for key in keys}) < len(keys):
            continue  # it does not tell one frame from another
        named = {same(item.key): item.path for item in items}
        named.pop(None, None)
        found = [named.get(same(key)) for key in keys] if named else []
        if 2 * (len(found) - found.count(None)) > len(found):
            return found
    return []


# What two names of a frame may have in common, and whether it is only a part of all numbers.
_SAME: tuple[tuple[Callable[[str], Any], bool], ...] = (
    (lambda key: key or None, False),
    (numbers_in, False),
    (lambda key: next(reversed(numbers_in(key)), None), True),
    (lambda key: next(iter(numbers_in(key)), None), True),
)


class Keyed(Protocol):
    """A frame; `key` is what the names of its files have in common."""

    @property
    def key(self) -> str: ...


def own_files(
    items: Iterable[Item], frames: Sequence[Keyed], words: frozenset[str], is_other: Callable[[Item], Any]
) -> list[Path | None]:
    """For each frame a file called or laid as its own, or named like it alone. Empty if most of several have none."""
    some = [(item, bool((item.words | item.folder_words | {item.suffix[1:]}) & words)) for item in items]
    some = [(item, is_called) for item, is_called in some if is_called or item.suffix in FRAME_SUFFIXES]
    if len(some) < 2:
        return []  # before a frame is asked for its name
    keys = [one.key for one in frames]
    stems = set(keys)
    own = [item for item, is_called in some if is_called or item.stem in stems]
    own = [item for item in own if not ((item.suffix in ONLY_DEPTH and item.role == "depth") or is_other(item))]
    found = matches(keys, own) if len(own) > 1 else []
    return found if len(set(found)) > 1 else []


def words_of(name: str) -> frozenset[str]:
    """The words in a name, in lower case: depth and map of rawDepth-map_01."""
    return frozenset(word.lower() for word in _WORD.findall(name))


class Listing:
    """What lies in folders. Each of them is looked at once: what changes afterwards is not seen."""

    def __init__(self) -> None:
        self._seen: dict[Path, _Seen] = {}

    def files(self, folder: Path, levels: int, suffixes: Collection[str] | None = None) -> list[Item]:
        """Return all files up to so many folders deep, in natural order: 2.png before 10.png. Hidden ones are left out.

        suffixes  in lower case, "" for none: only files with these
        """
        found = self._walk(folder, "", levels, suffixes)
        return sorted(found, key=lambda item: natural(item.path.name))

    def folders(self, folder: Path) -> list[Path]:
        """Return the folders in a folder, in natural order, without hidden ones."""
        return self._look(folder).folders

    def _walk(self, folder: Path, prefix: str, levels: int, suffixes: Collection[str] | None) -> Iterator[Item]:
        """Files first, then what is in the folders."""
        seen = self._look(folder)
        for path, name in seen.files:
            if suffixes is None or suffix_of(name) in suffixes:
                yield Item(path, prefix + name)
        for inside in seen.folders if levels else ():
            yield from self._walk(inside, f"{prefix}{inside.name.lower()}/", levels - 1, suffixes)

    def _look(self, folder: Path) -> _Seen:
        if folder not in self._seen:
            self._seen[folder] = _look_into(folder)
        return self._seen[folder]


class _Seen(NamedTuple):
    """A folder's files, with their names in lower case, and the folders in it, in natural order."""

    files: list[tuple[Path, str]]
    folders: list[Path]


def _look_into(folder: Path) -> _Seen:
    """What is not hidden: macOS leaves hidden twins such as ._color.png on foreign disks."""
    try:
        entries = [entry for entry in os.scandir(folder) if entry.name[0] != "."][:_MOST]
    except PermissionError:
        return _Seen([], [])
    kinds = [_kind_of(entry) for entry in entries]
    files = [(Path(one.path), one.name.lower()) for one, kind in zip(entries, kinds, strict=True) if kind == "file"]
    folders = [Path(one.path) for one, kind in zip(entries, kinds, strict=True) if kind == "folder"]
    return _Seen(files, sorted(folders, key=lambda path: natural(path.name)))


def _kind_of(entry: os.DirEntry[str]) -> str:
    """ "folder", "file", or "" for all else, such as a link that leads to itself."""
    try:
        return "folder" if entry.is_dir() else "file" if entry.is_file() else ""
    except OSError:
        return ""


def suffix_of(name: str) -> str:
    """Of a file's own name, with the dot; "" without one."""
    return name[name.rfind(".") :] if "." in name else ""


def natural(name: str) -> list[tuple[int, str]]:
    """Sorts 2.png before 10.png."""
    parts = re.split(r"(\d+)", name)
    return [(len(part.lstrip("0")), part.lstrip("0")) if part.isdecimal() else (-1, part) for part in parts]
