"""Groups the files of a folder into frames: which depth and colour pictures belong together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...messages.formatting import option
from ...messages.notes import Note
from ...messages.suggestions import near_path
from ..access.builtin import FRAMES, SCENES
from ..access.content import FilePath
from ..access.file_name_patterns import (
    COLOR_SUFFIXES,
    CONFIDENCE,
    CONTAINERS,
    DEPTH,
    DEPTH_SUFFIXES,
    NOT_PICTURES,
    ONLY_DEPTH,
    RAW_SUFFIXES,
    RAY_NAMES,
    RIGHT_VIEWS,
    SPARSE,
    VALID,
    VIDEO_SUFFIXES,
)
from ..access.folder_listing import LEVELS, Item, key_of, matches, words_of
from ..access.limits import MAX_PIXELS
from ..access.safe_paths import Folder
from ..depth.colormaps import read_levels
from ..pictures.picture_files import is_ours, read_image
from ..pictures.picture_heads import is_deep_grey, shallowness
from .pairing import find_partners
from .picture_lists import listed_pictures


class FrameFiles(NamedTuple):
    """The files of one frame.

    color   None: there is none, and the surface is light grey
    valid   a mask or the confidence of the depth, where there is one
    time    the depth's time stamp, if it has one
    number  counted from 0 among the frames: which picture of a video is the colour, which frame of a container
    """

    depth: Path
    color: Path | None = None
    valid: Path | None = None
    time: float | None = None
    number: int = 0

    @property
    def key(self) -> str:
        """What the names of its files have in common."""
        return key_of(self.depth.stem.lower())


def check_folder(folder: FilePath) -> Path:
    """The folder as a path. Raises OSError if it is not one."""
    place = Path(folder)
    if place.is_file():
        raise NotADirectoryError(
            f"{place} is a file, expected a folder: "
            f"pass single files as {option('depth', 'FILE')} and {option('color', 'FILE')}"
        )
    if not place.is_dir():
        what = "file" if place.suffix else "folder"
        raise FileNotFoundError(f"there is no {what} {place}{near_path(place, (*FRAMES, *SCENES))}")
    return place


def find_frames(place: Folder, note: Note, max_pixels: float = MAX_PIXELS) -> list[FrameFiles]:
    """The frames of a folder in their order; none if it has no depth.

    Pictures are those that a list names (depth.txt and rgb.txt of TUM, associations.txt, transforms.json), else those
    whose names say what they are (see file_name_patterns.py), in the folder itself before those in folders of it.
    Depth and colour belong together by name, else by number, else by the nearest time stamp, else by order.

    Raises ValueError if none of these fits, or if a list names files elsewhere.
    """
    folder = place.path
    for levels in range(1, LEVELS + 1):
        items = place.listing.files(folder, levels)
        pictures = [item for item in items if item.suffix in (*COLOR_SUFFIXES, *DEPTH_SUFFIXES, *VIDEO_SUFFIXES)]
        pictures = [item for item in pictures if not NOT_PICTURES.fullmatch(item.name)]
        if place.root is not None:
            pictures = [item for item in pictures if place.check(item.path)]
        listed_colors, listed_depths = listed_pictures(place, items, max_pixels)
        depths = listed_depths or _depths_of(folder, pictures, note)
        if depths:
            break
    else:
        return []
    colors = listed_colors or _colors_of(folder, pictures, depths, note)
    if not colors and place.root is None and _above(folder) != folder:
        beside = [item for item in place.listing.files(_above(folder), 1) if item.suffix in COLOR_SUFFIXES]
        colors = _colors_of(_above(folder), beside, depths, note)
    masks = [item for item in pictures if (item.words | item.folder_words) & VALID and _is_mask_of(item, depths[0])]
    valid = (matches([item.key for item in depths], masks) if masks else []) or [None] * len(depths)
    if not colors:
        note(f"{folder} has no colour picture (color.*, rgb.*, image.*): the surface is light grey")
    partners = find_partners(folder, depths, colors, note) if colors else [None] * len(depths)
    alone = partners.count(None) if colors else 0
    if alone:
        note(f"{folder}: {alone} of {len(depths)} depth pictures have no colour picture and are left out")
    kept = [one for one in zip(depths, partners, valid, strict=True) if one[1] or not colors]
    return [
        FrameFiles(item.path, mate.path if mate else None, mask, item.time, number)
        for number, (item, mate, mask) in enumerate(kept)
    ]


def find_color(place: Folder, depth: Path, note: Note) -> Path | None:
    """The colour picture of a folder that belongs to a depth picture, which the caller has named."""
    folder = place.path
    items = [item for item in place.listing.files(_above(folder), 1) if item.suffix in COLOR_SUFFIXES]
    alike = (item for item in items if item.path.name == depth.name)  # links are followed for few
    own = next((item for item in alike if item.path.resolve() == depth.resolve()), None)
    named = own or Item(depth, depth.name.lower())
    colors = _colors_of(folder, items, [named], lambda _: None)
    same = next((item.path for item in colors if item.key == named.key), None)
    if same or not colors:
        if not same:
            note(f"no colour picture lies beside {depth.name} (color.*, rgb.*, image.*): the surface is light grey")
        return same
    if len(colors) > 1:
        note(f"{folder} has {len(colors)} colour pictures: {colors[0].path.name} is taken")
    return colors[0].path


def _above(folder: Path) -> Path:
    """Return the folder above a folder of depth pictures, where their colours may be; any other folder itself."""
    return folder.resolve().parent if words_of(folder.resolve().name) & DEPTH else folder


def _depths_of(folder: Path, pictures: list[Item], note: Note) -> list[Item]:
    """Return the depth pictures: those named so, else those that cannot be anything else."""
    allowed = [item for item in pictures if item.suffix in DEPTH_SUFFIXES and not _is_right(item, pictures)]
    for wanted in ("depth", "", "sparse depth", "shown depth"):
        found = [item for item in allowed if _depth_role(item) == wanted]
        if wanted == "":
            found = [item for item in found if item.suffix in ONLY_DEPTH] or _deep_grey(found)
        if found:
            found = [item for item in found if item.suffix not in RAW_SUFFIXES] or found
            return _best_group(folder, found, "depth", note)
    return []


def _depth_role(item: Item) -> str:
    is_sparse = item.role == "depth" and (item.words | item.folder_words) & SPARSE
    return "sparse depth" if is_sparse else item.role


def _colors_of(folder: Path, pictures: list[Item], depths: list[Item], note: Note) -> list[Item]:
    """Return the colour pictures: those named so, else the pictures that are left over."""
    taken = {item.path for item in depths}
    allowed = [item for item in pictures if item.path not in taken and not _is_right(item, pictures)]
    for wanted in ("color", ""):
        found = [item for item in allowed if item.role == wanted and item.suffix in COLOR_SUFFIXES]
        depth_too = {item.path for item in _deep_grey(found)}
        found = [item for item in found if item.path not in depth_too and (wanted or not is_ours(item.path))]
        if found:
            return _best_group(folder, found, "colour", note, depths)
    videos = [item for item in allowed if item.suffix in VIDEO_SUFFIXES and item.role in ("color", "")]
    return videos[:1]


def _is_right(item: Item, pictures: list[Item]) -> bool:
    """Return whether this is the second camera's picture, with the first one's beside it."""
    left = RIGHT_VIEWS.get(item.stem)
    return left is not None and any(other.stem == left for other in pictures)


def _deep_grey(items: list[Item]) -> list[Item]:
    """Pictures of one channel of 16 bits, which are depth and nothing else. Those named alike are of one kind."""
    firsts: dict[str, bool] = {}
    for item in items:
        if _template(item) not in firsts:
            firsts[_template(item)] = is_deep_grey(item.path)
    return [item for item in items if firsts[_template(item)]]


def _template(item: Item) -> str:
    """Return what the file names of a series have in common."""
    return f"{item.path.parent}/{re.sub(r'[0-9]+', '#', item.stem)}"


def _best_group(folder: Path, items: list[Item], what: str, note: Note, partners: Sequence[Item] = ()) -> list[Item]:
    """Return files of one folder with similar names that fit their partners best; of equal keys the best suffix."""
    suffixes = DEPTH_SUFFIXES if what == "depth" else COLOR_SUFFIXES
    groups: dict[str, list[Item]] = {}
    for item in items:
        groups.setdefault(_template(item), []).append(item)
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

    ranked = sorted(groups.values(), key=rank)
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


def _is_mask_of(item: Item, depth: Item) -> bool:
    """Return whether a mask or a confidence is about the depth: it is named so, or it lies beside a network's depth."""
    if item.words & DEPTH or (item.words | item.folder_words) & CONFIDENCE:
        return True
    return item.stem == "mask" and item.path.parent == depth.path.parent


def is_container(path: Path) -> bool:
    """Whether a file may hold depth together with colour and camera."""
    return path.suffix.lower() in CONTAINERS
