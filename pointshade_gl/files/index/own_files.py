"""Matches files with frames by what their names have in common: a camera or a pose for each frame, masks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Protocol

from ..access.file_name_patterns import FRAME_SUFFIXES, ONLY_DEPTH
from ..access.folder_listing import Item, numbers_in


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
