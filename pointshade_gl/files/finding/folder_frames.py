"""Groups the files of a folder into frames: which depth and colour pictures belong together."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...notes.notes import Note
from ...notes.words import near_path, option
from ..access import known_names
from ..access.content import MAX_PIXELS, PARTS, FilePath, check_limit, followed, read_text
from ..access.folders import LEVELS, Folder, ListedFile, key_of, numbers_in, places_of, words_of
from ..cameras.camera_files import read_transforms
from ..depth.depth_files import TEXT_SUFFIXES, is_table, read_levels
from ..pictures.picture_files import is_deep_grey, is_ours, read_image, shallowness

_DIGITS = re.compile(r"[0-9]+")


def template(item: ListedFile) -> str:
    """Return what the file names of a series have in common."""
    return f"{item.path.parent}/{_DIGITS.sub('#', item.stem)}"


def best_group(
    folder: Path, items: list[ListedFile], what: str, note: Note, partners: Sequence[ListedFile] = ()
) -> list[ListedFile]:
    """Return files of one folder with similar names that fit their partners best; of equal keys the best suffix."""
    suffixes = known_names.DEPTH_SUFFIXES if what == "depth" else known_names.COLOR_SUFFIXES
    groups: dict[str, list[ListedFile]] = {}
    for item in items:
        groups.setdefault(template(item), []).append(item)
    keys, numbers = {item.key for item in partners}, {item.numbers for item in partners if item.numbers}
    places = {item.path.parent for item in partners}

    def rank(group: list[ListedFile]) -> tuple[float, ...]:
        matched = sum(item.key in keys or item.numbers in numbers for item in group)
        together = any(group[0].path.parent.parent in (place, place.parent, place.parent.parent) for place in places)
        return (
            -min(matched, len(partners)),
            what == "depth" and shallowness(group[0].path),
            what == "depth" and bool(known_names.RAY_NAMES.search(group[0].name)),
            what == "depth" and not group[0].is_registered,
            group[0].level,
            -(group[0].path.parent in places),
            -together,
            group[0].stem not in (what, "color", "rgb"),
            len(group[0].words),
        )

    ranked = sorted(groups.values(), key=rank) if len(groups) > 1 else list(groups.values())
    best = ranked[0]
    if rivals := [] if partners else [group[0] for group in ranked[1:] if group[0].level == best[0].level]:
        taken, *others = (item.path.relative_to(folder).as_posix() for item in (best[0], *rivals))
        listed = ", ".join(others[:3]) + (f" and {len(others) - 3} more" if len(others) > 3 else "")
        note(f"{folder}: {taken} is taken as the {what}, not {listed}")
    if what == "colour" and partners and len(best) < len(partners):
        same = [group for group in ranked if group[0].path.parent == best[0].path.parent]
        best = [item for group in same for item in group]  # named one by one: kitchen.jpg, garden.jpg
    by_stem: dict[str, list[ListedFile]] = {}
    for item in best:
        by_stem.setdefault(item.stem, []).append(item)
    kept = []
    for forms in by_stem.values():  # of files that differ in their suffix the one that keeps the most
        forms.sort(key=lambda item: suffixes.index(item.suffix))
        plain = [item for item in forms if not _is_mapped(item.path)] if what != "depth" and len(forms) > 1 else []
        kept.append((plain or forms)[0])
    if len(kept) == 1 < len(best):
        note(f"{folder} has {', '.join(item.path.name for item in best)}: {kept[0].path.name} is taken")
    return kept


def _is_mapped(path: Path) -> bool:
    image = read_image(path)
    return image.ndim == 3 and image.dtype == np.uint8 and read_levels(image) is not None


def find_partners(
    folder: Path, depths: list[ListedFile], colors: list[ListedFile], note: Note
) -> list[ListedFile | None]:
    """For each depth picture its colour picture, None where there is none."""
    if colors[0].suffix in known_names.VIDEO_SUFFIXES:
        return [colors[0]] * len(depths)
    if len(depths) == len(colors) == 1:
        return [colors[0]]
    enough = min(len(depths), len(colors)) / 2
    if len(depths) > 1 and len({item.numbers[-1:] for item in depths}) == 1:  # r_0_depth_0001.png, r_1_depth_0001.png
        named = {item.numbers: item for item in colors}
        partners = [named.get(item.numbers[:-1]) for item in depths]
        if all(partners):
            return partners
    for same in (attrgetter("key"), attrgetter("numbers"), lambda item: item.numbers[-1:]):
        named = {same(item): item for item in colors if same(item)}
        if len({same(item) for item in depths}) < len(depths):
            continue
        partners = [named.get(same(item)) for item in depths]
        if len(depths) - partners.count(None) > enough and len(named) == len(colors):
            return partners
    times, color_times = ([item.time for item in items if item.time is not None] for items in (depths, colors))
    if len(times) == len(depths) and len(color_times) == len(colors):
        near = nearest(np.array(times), np.array(color_times))
        apart = np.abs(np.array(color_times)[near] - times)
        close = apart <= (np.median(np.abs(np.diff(times))) if len(times) > 1 else np.inf)
        if close.any():
            widest = apart[close].max()
            note(f"{folder}: depth and colour are paired by the nearest time stamp, up to {widest:.3g} apart")
            return [colors[i] if good else None for i, good in zip(near, close, strict=True)]
    if len(depths) == 1:
        return [colors[0]]
    if len(depths) != len(colors):
        got = f"{folder} has {len(depths)} depth and {len(colors)} colour pictures"
        way_out = "give the two of a frame the same name"
        raise ValueError(f"{got} whose names do not show which belong together: {way_out}")
    note(f"{folder}: depth and colour are paired by order, their names do not match")
    return list(colors)


def nearest(wanted: np.ndarray, offered: np.ndarray) -> np.ndarray:
    """(n,) for each of n time stamps the index of the nearest of the m offered ones."""
    order = np.argsort(offered, kind="stable")
    right = np.searchsorted(offered[order], wanted).clip(1, len(offered) - 1) if len(offered) > 1 else np.zeros(1, int)
    left = np.maximum(right - 1, 0)
    is_left = np.abs(offered[order][left] - wanted) <= np.abs(offered[order][right] - wanted)
    return order[np.where(is_left, left, right)]


_PICTURES = (*known_names.COLOR_SUFFIXES, *known_names.DEPTH_SUFFIXES)
_NUMBER = re.compile(r"\d{1,18}(\.\d{0,18})?")


def listed_pictures(
    place: Folder, items: list[ListedFile], max_pixels: float
) -> tuple[list[ListedFile], list[ListedFile]]:
    """The colour and the depth pictures that lists of the folder name; none without such a list."""
    top = {item.name: item.path for item in items if not item.level}
    for name, path in top.items():
        if known_names.TRANSFORMS.fullmatch(name):
            files = [(entry.color, entry.depth) for entry in read_transforms(path, max_pixels) if entry.depth]
            pairs = [[_item(place.named, text) for text in pair if text] for pair in files]
            pairs = [pair for pair in pairs if len(pair) == 2 and all(item.path.is_file() for item in pair)]
        elif known_names.PAIR_LISTS.fullmatch(name):
            pairs = [row for row in _read_list(place, path, max_pixels) if len(row) == 2]
        else:
            continue
        if pairs:
            is_swapped = pairs[0][0].role == "depth"
            return [pair[is_swapped] for pair in pairs], [pair[not is_swapped] for pair in pairs]
    colors, depths = (
        next((rows for name in names if name in top and (rows := _read_list(place, top[name], max_pixels))), [])
        for names in (known_names.COLOR_LISTS, known_names.DEPTH_LISTS)
    )
    return [row[0] for row in colors], [row[0] for row in depths]


def _item(named: Callable[[str], Path], text: str, time: str = "") -> ListedFile:
    """A picture that a list names, with the list's time stamp."""
    item = ListedFile(named(text), text.lower().replace("\\", "/").removeprefix("./"))
    if time:
        item.__dict__["time"] = float(time)
    return item


def _read_list(place: Folder, path: Path, max_pixels: float) -> list[list[ListedFile]]:
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


def matches(keys: Sequence[str], items: Iterable[ListedFile]) -> list[Path | None]:
    """For each frame, by its key, a file with the same key, numbers, last or first number. Empty if most have none."""
    items = [item for item in items if item.key]
    for same, is_part in _SAME:
        if is_part and len({same(key) for key in keys}) < len(keys):
            continue  # it does not distinguish frames
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


def own_files(
    items: Iterable[ListedFile], frames: Sequence[FrameFiles], words: frozenset[str],
    is_other: Callable[[ListedFile], Any],
) -> list[Path | None]:  # fmt: skip
    """For each frame a file called or laid as its own, or named like it alone. Empty if most of several have none."""
    some = [(item, bool((item.words | item.folder_words | {item.suffix[1:]}) & words)) for item in items]
    some = [(item, is_called) for item, is_called in some if is_called or item.suffix in known_names.FRAME_SUFFIXES]
    if len(some) < 2:
        return []  # before a frame is asked for its name
    keys = [one.key for one in frames]
    stems = set(keys)
    own = [item for item, is_called in some if is_called or item.stem in stems]
    own = [
        item for item in own if not ((item.suffix in known_names.ONLY_DEPTH and item.role == "depth") or is_other(item))
    ]
    found = matches(keys, own) if len(own) > 1 else []
    return found if len(set(found)) > 1 else []


_OF_THE_SYSTEM = (("/", "proc"), ("/", "sys"))  # links in them lead to the whole machine


class FrameFiles(NamedTuple):
    depth: Path
    color: Path | None = None  # None: there is none, and the surface is light grey
    valid: Path | None = None  # a mask or the confidence of the depth, where there is one
    time: float | None = None  # the depth's time stamp, if it has one
    # counted from 0 among the frames: which picture of a video is the colour, which frame of a container
    number: int = 0

    @property
    def key(self) -> str:
        """What the names of its files have in common."""
        return key_of(self.depth.stem.lower())


def check_folder(folder: FilePath) -> Path:
    """The folder as a path. Raises OSError if it is not one."""
    place = Path(folder)
    if place.is_file():
        way_out = f"pass single files as {option('depth', 'FILE')} and {option('color', 'FILE')}"
        raise NotADirectoryError(f"{place} is a file, expected a folder: {way_out}")
    if not place.is_dir():
        what = "file" if place.suffix else "folder"
        meant = near_path(place, (*known_names.FRAMES, *known_names.SCENES))
        raise FileNotFoundError(f"there is no {what} {place}{meant}")
    if followed(place).parts[:2] in _OF_THE_SYSTEM:
        raise OSError(f"{place} is a folder in which Linux shows its own state, and no pictures: pass another one")
    return place


def find_frames(place: Folder, note: Note, max_pixels: float = MAX_PIXELS) -> list[FrameFiles]:
    """The frames of a folder in their order; none if it has no depth.

    Pictures are those that a list names (depth.txt and rgb.txt of TUM, associations.txt, transforms.json), else those
    whose names are known (see known_names.py), in the folder itself before those in folders of it. Depth and
    colour belong together by name, else by number, else by the nearest time stamp, else by order. Raises ValueError if
    none of these fits, or if a list names files elsewhere.
    """
    folder = place.path
    for levels in range(1, LEVELS + 1):
        items = place.listing.files(folder, levels)
        pictures = [item for item in items if item.suffix in (*_PICTURES, *known_names.VIDEO_SUFFIXES)]
        pictures = [item for item in pictures if not known_names.NOT_PICTURES.fullmatch(item.name)]
        if place.root is not None:
            pictures = [item for item in pictures if place.check(item.path)]
        listed_colors, listed_depths = listed_pictures(place, items, max_pixels)
        depths = listed_depths or _depths_of(folder, pictures, note) or _tables_of(items)
        if depths:
            break
    else:
        return []
    colors = listed_colors or _colors_of(folder, pictures, depths, note)
    colors = colors or _colors_beside(place, folder, depths, note)
    masks = [item for item in pictures if _is_mask_of(item, depths[0])]
    valid = (matches([item.key for item in depths], masks) if masks else []) or [None] * len(depths)
    if (
        not colors and not is_container(depths[0].path) and not _holds_color(depths[0].path)
    ):  # it may hold its colours itself
        note(f"{folder} has no colour picture (color.*, rgb.*, image.*): the surface is light grey")
    partners = find_partners(folder, depths, colors, note) if colors else [None] * len(depths)
    alone = partners.count(None) if colors else 0
    if alone:
        note(f"{folder}: {alone} of {len(depths)} depth pictures have no colour picture and are left out")
    kept = enumerate(one for one in zip(depths, partners, valid, strict=True) if one[1] or not colors)
    return [FrameFiles(one.path, mate.path if mate else None, mask, one.time, k) for k, (one, mate, mask) in kept]


def find_color(place: Folder, depth: Path, note: Note) -> Path | None:
    """The colour picture of a folder that belongs to a depth picture, which the caller has named."""
    real = followed(depth)
    looks = [(place.path, depth)] + ([(real.parent, real)] if depth.is_symlink() and place.root is None else [])
    for folder, file in looks:
        named = ListedFile(file, file.name.lower())
        colors = _colors_in(place, folder, named) or _colors_beside(place, folder, [named], lambda _: None)
        same = next(iter(matches([named.key], colors)), None)
        if len(colors) > 1 and not same:
            note(f"{folder} has {len(colors)} colour pictures: {colors[0].path.name} is taken")
        if colors:
            return same or colors[0].path
    if not _holds_color(depth):
        note(f"no colour picture lies beside {depth.name} (color.*, rgb.*, image.*): the surface is light grey")
    return None


def _holds_color(depth: Path) -> bool:
    if depth.suffix.lower() not in (".npy", *known_names.INSIDE):
        return False
    from ..containers.opening import holds_color  # only here

    with suppress(OSError, ValueError):  # reported when it is read
        return holds_color(depth)
    return False


def find_photographs(place: Folder, note: Note) -> list[Path]:
    """The photographs of a folder in their order, or its video; those of one folder of it if it has none itself.
    Pictures that are named as anything but colours are left out, and those that this package drew."""
    folder = place.path
    for levels in range(1, LEVELS + 1):
        items = [item for item in place.listing.files(folder, levels) if item.role in ("color", "")]
        photos = [item for item in items if item.suffix in known_names.COLOR_SUFFIXES and not is_ours(item.path)]
        photos = [item for item in photos if place.root is None or place.check(item.path)]
        if photos:
            own = sorted(
                {item.path.parent for item in photos}, key=lambda one: (not words_of(one.name) & known_names.COLOR, one)
            )
            if len(own) > 1:
                note(f"{folder}: the photographs of {own[0].name} are taken, not those of {own[1].name}")
            return [item.path for item in sorted(photos, key=lambda item: item.order) if item.path.parent == own[0]]
        if videos := [item.path for item in items if item.suffix in known_names.VIDEO_SUFFIXES]:
            return videos[:1]
    return []


def _colors_in(place: Folder, folder: Path, depth: ListedFile) -> list[ListedFile]:
    """The colour pictures of a folder, for one depth picture of it; in a folder of depth only what is surely none."""
    items = [item for item in place.listing.files(folder, 1) if item.suffix in known_names.COLOR_SUFFIXES]
    if _folders_above(folder):
        items = [item for item in items if not item.words & known_names.SHOWN_DEPTH]
        if depth.role != "depth":  # depth/image_1.png, depth/image_2.png
            items = [
                item for item in items if (item.words - known_names.ANY_PICTURE | item.folder_words) & known_names.COLOR
            ]
    return _colors_of(folder, items, [depth], lambda _: None)


def _colors_beside(place: Folder, folder: Path, depths: list[ListedFile], note: Note) -> list[ListedFile]:
    """The colour pictures beside a folder of depth pictures, but not those of other frames: with depth of their own."""
    for above, name in _folders_above(folder) if place.root is None else ():
        items = [item for item in place.listing.files(above, 1) if not item.name.startswith(f"{name}/")]
        others = {item.path.parent for item in items if item.level and item.role == "depth"}
        items = [item for item in items if item.suffix in known_names.COLOR_SUFFIXES and item.path.parent not in others]
        if colors := _colors_of(above, items, depths, note):
            return colors
    twins = place.listing.twins(depths[0].path.parent, known_names.COLOR_SUFFIXES) if place.root is None else []
    twins = [item for item in twins if not known_names.NOT_PICTURES.fullmatch(item.name)]
    return _colors_of(twins[0].path.parents[twins[0].level], twins, depths, note) if twins else []


def _folders_above(folder: Path) -> list[tuple[Path, str]]:
    """The folders above one of depth pictures, where their colours may be, and its name in each; none for others."""
    return [(one.parent, one.name.lower()) for one in places_of(folder) if words_of(one.name) & known_names.DEPTH]


def _depths_of(folder: Path, pictures: list[ListedFile], note: Note) -> list[ListedFile]:
    """Return the depth pictures: those named so, else those that cannot be anything else."""
    allowed = [item for item in pictures if item.suffix in known_names.DEPTH_SUFFIXES and not _is_right(item, pictures)]
    for wanted in ("depth", "", "sparse depth", "shown depth"):
        found = [item for item in allowed if _depth_role(item) == wanted]
        if wanted == "":
            found = [item for item in found if item.suffix in known_names.ONLY_DEPTH] or _deep_grey(found)
        if found:
            found = _without_shown(found)
            return best_group(folder, found, "depth", note)
    return []


def _tables_of(items: list[ListedFile]) -> list[ListedFile]:
    """Return depth as text, of names that are alike, where there is no other."""
    tables = [item for item in items if item.suffix in TEXT_SUFFIXES and item.role == "depth" and is_table(item.path)]
    return [item for item in tables if template(item) == template(tables[0])]


def _without_shown(items: list[ListedFile]) -> list[ListedFile]:
    """Without bare numbers where there is a picture of depth; but instead of a picture for the eye of the same name."""
    bare = {(item.path.parent, item.stem): item for item in items if item.suffix in known_names.RAW_SUFFIXES}
    pictures = [item for item in items if item.suffix not in known_names.RAW_SUFFIXES]
    if not bare or not pictures:
        return items
    twins = [bare.get((one.path.parent, one.stem)) for one in pictures]
    return [twin if twin and shallowness(one.path) else one for one, twin in zip(pictures, twins, strict=True)]


def numbers_of(path: Path, note: Note) -> Path:
    """A file of depth; for a viewer's picture for the eye the bare numbers beside it, with a note."""
    bare = (path.with_suffix(suffix) for suffix in known_names.RAW_SUFFIXES)
    found = next((one for one in bare if one.is_file() and one != path), None)
    if found is None or path.suffix.lower() not in known_names.COLOR_SUFFIXES or not shallowness(path):
        return path
    note(f"{path.name} is a picture for the eye: the numbers are read from {found.name}")
    return found


def _depth_role(item: ListedFile) -> str:
    is_sparse = item.role == "depth" and (item.words | item.folder_words) & known_names.SPARSE
    return "sparse depth" if is_sparse else item.role


def _colors_of(folder: Path, pictures: list[ListedFile], depths: list[ListedFile], note: Note) -> list[ListedFile]:
    """Return the colour pictures: those named so, else the pictures that are left over."""
    taken = {item.path for item in depths}
    allowed = [item for item in pictures if item.path not in taken and not _is_right(item, pictures)]
    allowed = _not_of_others(allowed, depths)
    for wanted in ("color", ""):
        found = [item for item in allowed if item.role == wanted and item.suffix in known_names.COLOR_SUFFIXES]
        depth_too = {item.path for item in _deep_grey(found)}
        found = [item for item in found if item.path not in depth_too and (wanted or not is_ours(item.path))]
        if found:
            return best_group(folder, found, "colour", note, depths)
    videos = [item for item in allowed if item.suffix in known_names.VIDEO_SUFFIXES and item.role in ("color", "")]
    return videos[:1]


def _not_of_others(pictures: list[ListedFile], depths: list[ListedFile]) -> list[ListedFile]:
    """Without pictures in folders that have depth of their own, and below the depth but in folders for colours."""
    of_depth = {item.path.parent for item in pictures if item.level and item.role == "depth"}
    others = of_depth and of_depth - {item.path.parent for item in depths}
    if others:
        pictures = [item for item in pictures if item.path.parent not in others]
    first, level = depths[0].path.parent, depths[0].level

    def is_below(item: ListedFile) -> bool:
        return item.level > level and first in item.path.parents[1:] and not item.folder_words & known_names.COLOR

    return [item for item in pictures if not is_below(item)]


def _is_right(item: ListedFile, pictures: list[ListedFile]) -> bool:
    """Return whether this is the second camera's picture, with the first one's beside it."""
    left = known_names.RIGHT_VIEWS.get(item.stem)
    return left is not None and any(other.stem == left for other in pictures)


def _deep_grey(items: list[ListedFile]) -> list[ListedFile]:
    """Pictures of one channel of 16 bits, which are depth and nothing else. Those named alike are of one kind."""
    firsts: dict[str, bool] = {}
    for item in items:
        if template(item) not in firsts:
            firsts[template(item)] = is_deep_grey(item.path)
    return [item for item in items if firsts[template(item)]]


def _is_mask_of(item: ListedFile, depth: ListedFile) -> bool:
    """Whether it is a mask or confidence of the depth: it is named so, or it is the mask beside a network's depth."""
    words = item.words | item.folder_words
    is_named = item.words & known_names.DEPTH or words & known_names.CONFIDENCE
    return bool(words & known_names.VALID and is_named) or (
        item.stem == "mask" and item.path.parent == depth.path.parent
    )


def is_container(path: Path) -> bool:
    """Whether a file may hold depth together with colour and camera."""
    return path.suffix.lower() in known_names.CONTAINERS
