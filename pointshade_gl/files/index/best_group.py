"""Chooses, among the pictures of a folder that may be its depth or its colour, those of one series."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from ...notes.notes import Note
from ..access.file_name_patterns import COLOR_SUFFIXES, DEPTH_SUFFIXES, RAY_NAMES
from ..access.folder_listing import Item
from ..depth.colormaps import read_levels
from ..pictures.picture_files import read_image
from ..pictures.picture_heads import shallowness

_NUMBER = re.compile(r"[0-9]+")


def template(item: Item) -> str:
    """Return what the file names of a series have in common."""
    return f"{item.path.parent}/{_NUMBER.sub('#', item.stem)}"


def best_group(folder: Path, items: list[Item], what: str, note: Note, partners: Sequence[Item] = ()) -> list[Item]:
    """Return files of one folder with similar names that fit their partners best; of equal keys the best suffix."""
    suffixes = DEPTH_SUFFIXES if what == "depth" else COLOR_SUFFIXES
    groups: dict[str, list[Item]] = {}
    for item in items:
        groups.setdefault(template(item), []).append(item)
    keys, numbers = {item.key for item in partners}, {item.numbers for item in partners if item.numbers}
    places = {item.path.parent for item in partners}

    def rank(group: list[Item]) -> tuple[float, ...]:
        matched = sum(item.key in keys or item.numbers in numbers for item in group)
        together = any(group[0].path.parent.parent in (place, place.parent, place.parent.parent) for place in places)
        return (
            -min(matched, len(partners)),
            what == "depth" and shallowness(group[0].path),
            what == "depth" and bool(RAY_NAMES.search(group[0].name)),
            what == "depth" and not group[0].is_registered,
            group[0].level,
            -(group[0].path.parent in places),
            -together,
            group[0].stem not in (what, "color", "rgb"),
            len(group[0].words),
        )

    ranked = sorted(groups.values(), key=rank) if len(groups) > 1 else list(groups.values())
    best = ranked[0]
    if not partners and len(ranked) > 1:
        _tell_others(folder, best, ranked[1:], what, note)
    if what == "colour" and partners and len(best) < len(partners):
        same = [group for group in ranked if group[0].path.parent == best[0].path.parent]
        best = [item for group in same for item in group]  # named one by one: kitchen.jpg, garden.jpg
    by_stem: dict[str, list[Item]] = {}
    for item in best:
        by_stem.setdefault(item.stem, []).append(item)
    kept = [_best_form(forms, suffixes) for forms in by_stem.values()]
    if len(kept) == 1 < len(best):
        note(f"{folder} has {', '.join(item.path.name for item in best)}: {kept[0].path.name} is taken")
    return kept


def _best_form(forms: list[Item], suffixes: tuple[str, ...]) -> Item:
    """Return, of files that differ in their suffix, the one that keeps the most, and is no colour-mapped depth."""
    forms = sorted(forms, key=lambda item: suffixes.index(item.suffix))
    if len(forms) > 1 and suffixes == COLOR_SUFFIXES:
        forms = [item for item in forms if not _is_mapped(item.path)] or forms
    return forms[0]


def _is_mapped(path: Path) -> bool:
    image = read_image(path)
    return image.ndim == 3 and image.dtype == np.uint8 and read_levels(image) is not None


def _tell_others(folder: Path, best: list[Item], others: Iterable[list[Item]], what: str, note: Note) -> None:
    rivals = [group[0].path.relative_to(folder).as_posix() for group in others if group[0].level == best[0].level]
    if rivals:
        listed = ", ".join(rivals[:3]) + (f" and {len(rivals) - 3} more" if len(rivals) > 3 else "")
        note(f"{folder}: {best[0].path.relative_to(folder).as_posix()} is taken as the {what}, not {listed}")
