"""Reads lists of pictures in a folder: depth.txt and rgb.txt of TUM, associations.txt, transforms.json."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

from ..access.content import read_text
from ..access.file_name_patterns import COLOR_LISTS, COLOR_SUFFIXES, DEPTH_LISTS, DEPTH_SUFFIXES, PAIR_LISTS, TRANSFORMS
from ..access.folder_listing import Item
from ..access.limits import PARTS, check_limit
from ..access.safe_paths import Folder
from ..cameras.transforms_json import read_transforms

_PICTURES = (*COLOR_SUFFIXES, *DEPTH_SUFFIXES)
_NUMBER = re.compile(r"\d{1,18}(\.\d{0,18})?")


def listed_pictures(place: Folder, items: list[Item], max_pixels: float) -> tuple[list[Item], list[Item]]:
    """The colour and the depth pictures that lists of the folder name; none without such a list."""
    top = {item.name: item.path for item in items if not item.level}
    for name, path in top.items():
        if TRANSFORMS.fullmatch(name):
            files = [(entry.color, entry.depth) for entry in read_transforms(path, max_pixels) if entry.depth]
            pairs = [[_item(place.named, text) for text in pair if text] for pair in files]
            pairs = [pair for pair in pairs if len(pair) == 2 and all(item.path.is_file() for item in pair)]
        elif PAIR_LISTS.fullmatch(name):
            pairs = [row for row in _read_list(place, path, max_pixels) if len(row) == 2]
        else:
            continue
        if pairs:
            is_swapped = pairs[0][0].role == "depth"
            return [pair[is_swapped] for pair in pairs], [pair[not is_swapped] for pair in pairs]
    colors, depths = (
        next((rows for name in names if name in top and (rows := _read_list(place, top[name], max_pixels))), [])
        for names in (COLOR_LISTS, DEPTH_LISTS)
    )
    return [row[0] for row in colors], [row[0] for row in depths]


def _item(named: Callable[[str], Path], text: str, time: str = "") -> Item:
    """A picture that a list names, with the list's time stamp."""
    item = Item(named(text), text.lower().replace("\\", "/").removeprefix("./"))
    if time:
        item.__dict__["time"] = float(time)
    return item


def _read_list(place: Folder, path: Path, max_pixels: float) -> list[list[Item]]:
    """For each line of a text file the pictures that it names after time stamps; none if it holds anything else."""
    lines = read_text(place.check(path), max_pixels).splitlines()
    check_limit(len(lines), f"{path} has {len(lines)} lines", max_pixels, PARTS)
    found, named = [], cache(place.named)  # colours stand beside several depths
    for line in lines:
        words = _words(line.split("#")[0])
        if len(words) not in (2, 4) or not _NUMBER.fullmatch(words[0]):
            continue
        if not all(text.lower().endswith(_PICTURES) for text in words[1::2]):
            continue
        try:
            if " " in words[1] and not named(words[1]).is_file():
                continue
            found.append([_item(named, words[k + 1], words[k]) for k in range(0, len(words), 2)])
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    return found


def _words(line: str) -> list[str]:
    """Time stamps and names; a single name may have spaces in it."""
    words = line.split()
    is_one = len(words) > 2 and not any(word.lower().endswith(_PICTURES) for word in words[:-1])
    return line.strip().split(None, 1) if is_one else words
