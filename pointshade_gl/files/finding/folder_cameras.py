"""Finds the camera of a folder's frames, by file name and content, or as its maker keeps it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ...notes.notes import Note
from ...notes.words import cut
from ..access import known_names
from ..access.content import MAX_PIXELS, followed, parse_object, read_text
from ..access.folders import Folder, ListedFile, from_root, key_of, places_of
from ..arrays.named_numbers import named_of
from ..cameras.camera_files import read_intrinsics, read_transforms
from ..cameras.intrinsics import Intrinsics, from_named, shows_the_same
from ..pictures.picture_files import png_size
from .folder_frames import FrameFiles, matches, own_files

_PARENTS = 2  # folders above the frames' own in which their camera may lie: scene/seq-01, set/test/000048


class Cameras(NamedTuple):
    """What a folder states about the camera of each of its frames."""

    shared: Intrinsics | None  # the camera of all frames; None if it is unknown, or if each frame has one of its own
    own: Sequence[Intrinsics | None] = ()
    missing: str = ""  # why there is none: the files that were looked at, for a sentence; else ""

    def of(self, number: int) -> Intrinsics | None:
        """The camera of a frame, counted from 0."""
        return (self.own[number] if number < len(self.own) else None) or self.shared


def find_cameras(place: Folder, frames: Sequence[FrameFiles], note: Note, max_pixels: float = MAX_PIXELS) -> Cameras:
    """Find the cameras of a folder's frames; a note names the file. Raises ValueError for a bad intrinsics.json."""
    items = _not_of_others(place.listing.files(place.path, 2, known_names.CAMERA_SUFFIXES), frames, place)
    own = _one_each(items, frames, note, max_pixels)
    if own:
        return Cameras(None, own)
    failed: list[str] = []
    of_color = False  # whether the first depth's name says that it was projected into the colour camera
    if frames:
        depth = frames[0].depth
        name = depth.relative_to(place.path) if depth.is_relative_to(place.path) else depth.name
        of_color = known_names.REGISTERED.search(str(name).lower()) is not None
    for item in [*_nearest(_by_rank(items, of_color), frames), *_in_parents(place, frames)]:
        try:
            found = read_intrinsics(place.check(item.path), note, max_pixels, of_color)
        except (ValueError, OSError) as error:
            if item.name == "intrinsics.json":
                raise
            failed.append(f"{item.path.name} ({cut(str(error).removeprefix(str(item.path)).strip(': '), 120)})")
            continue
        if item.name != "intrinsics.json":
            note(f"the camera is read from {item.path}")
        own = _in_transforms(item, frames, max_pixels) or _by_frame(item, frames, max_pixels)
        return Cameras(found, own)
    known = _of_data_set(place, items, frames, note, max_pixels)
    return Cameras(known, (), f" (not understood: {', '.join(failed[:2])})" if failed else "")


def _nearest(items: Sequence[ListedFile], frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """Sort by the number of folders shared with the first frame, most first: a folder may hold several data sets."""
    if not frames:
        return list(items)
    here = {*from_root(frames[0].depth).parents}
    shared = cache(lambda folder: len(here & {folder, *folder.parents}))
    return sorted(items, key=lambda item: -shared(from_root(item.path.parent)))


def _not_of_others(items: Sequence[ListedFile], frames: Sequence[FrameFiles], place: Folder) -> list[ListedFile]:
    """Without the files of folders with pictures of their own, where frames lie beside those: another frame's."""
    if not frames or frames[0].depth.parent != place.path:
        return list(items)
    others = {
        item.path.parent for item in place.listing.files(place.path, 2, known_names.PICTURE_SUFFIXES) if item.level
    }
    return [item for item in items if item.path.parent not in others]


def _by_rank(items: Sequence[ListedFile], of_color: bool = False) -> list[ListedFile]:
    """Files that may hold a camera: the best known names first, those nearest to the folder first among them."""
    found = []
    for item in items:
        if not known_names.NOT_A_CAMERA.search(item.name):
            rank = next((k for k, name in enumerate(known_names.CAMERAS) if name.fullmatch(item.name)), None)
            if rank is not None:
                other = r"depth" if of_color else r"colou?r|rgb"
                found.append((rank, item.level, bool(re.search(other, item.name)), item))
    found.sort(key=lambda one: (one[2] and one[0] > 0, one[0], one[1]))
    return [one[-1] for one in found]


def _in_parents(place: Folder, frames: Sequence[FrameFiles]) -> list[ListedFile]:
    """The same in the folders above, nearest first; then where links lead to, of the folder and of the first frame."""
    found: list[ListedFile] = []
    above = [one for here in places_of(place.path) for one in list(here.parents)[:_PARENTS]]
    if frames and frames[0].depth.is_symlink():
        above += list(followed(frames[0].depth).parents)[: _PARENTS + 1]
    for one in dict.fromkeys(above):
        if one != one.parent:
            items = place.listing.files(one, 0, known_names.CAMERA_SUFFIXES)
            found += [item for item in _by_rank(items) if not known_names.TRANSFORMS.fullmatch(item.name)]
    return found


def _one_each(
    items: Sequence[ListedFile], frames: Sequence[FrameFiles], note: Note, max_pixels: float
) -> list[Intrinsics | None]:
    """Return for each frame the camera in a file of its own; empty if fewer than half of several frames have one."""
    files = own_files(items, frames, known_names.FRAME_CAMERAS, lambda item: known_names.NOT_A_CAMERA.search(item.name))
    try:
        found = [read_intrinsics(path, lambda _: None, max_pixels) if path else None for path in files]
    except (ValueError, OSError):
        return []  # of another kind, such as poses
    if found:
        note(f"each frame has its camera in a file such as {next(path for path in files if path)}")
    return found


def _in_transforms(item: ListedFile, frames: Sequence[FrameFiles], max_pixels: float) -> list[Intrinsics | None]:
    """The frames' own cameras in a transforms.json, where it has them."""
    if not known_names.TRANSFORMS.fullmatch(item.path.name.lower()):
        return []
    entries = read_transforms(item.path, max_pixels)
    named = {Path(name).stem: one.camera for one in entries for name in (one.color, one.depth) if name and one.camera}
    return [named.get((one.color or one.depth).stem, named.get(one.depth.stem)) for one in frames] if named else []


def _by_frame(item: ListedFile, frames: Sequence[FrameFiles], max_pixels: float) -> list[Intrinsics | None]:
    """The frames' own cameras in a JSON that has an object for each, by name or number: ScanNet++, BOP."""
    if item.suffix != ".json" or len(frames) < 2:
        return []
    data = parse_object(read_text(item.path, max_pixels), item.path, max_pixels)
    values = {key_of(name.lower()): one for name, one in data.items() if isinstance(one, dict)}
    if not values:
        return []
    files = [ListedFile(item.path.with_name(key), key) for key in values]
    named = [path.name if path else "" for path in matches([one.key for one in frames], files)]
    found = [from_named(named_of(values.get(name, {})), str(item.path)) for name in named]
    return [one[0] if one else None for one in found] if len(set(named)) > 1 else []


def _of_data_set(
    place: Folder, items: Sequence[ListedFile], frames: Sequence[FrameFiles], note: Note, max_pixels: float
) -> Intrinsics | None:
    """The published camera of a data set that is recognised by the names of its folder and files."""
    folder = place.path
    lists = [item for item in items if not item.level and re.fullmatch(r"(rgb|depth|assoc\w*)\.txt", item.name)]
    heads = [read_text(item.path, max_pixels)[:400] for item in lists]
    names = [item.path.name for item in place.listing.files(folder, 1) if item.suffix in (".freiburg",)]
    names += [item.path.name for item in lists]
    files = [(path, 3) for one in frames[:1] for path in (one.depth, one.color) if path]
    names += ["/".join(one.parts[-most:]) for path, most in [(folder, 2), *files] for one in places_of(path)]
    seen = "\n".join([*names, *heads]).lower()
    first = next((one.depth for one in frames[:9] if one.depth.is_file()), None)  # one may be missing
    size = None if first is None else png_size(first)
    for known in known_names.DATA_SETS:
        is_like = size is not None and known.is_resized and shows_the_same(known.size, size)
        if (size in (None, known.size) or is_like) and re.search(known.known_by, seen):
            numbers = ",".join(f"{number:g}" for number in known.numbers)
            note(
                f"no camera is in {folder}, which looks like {known.title}: its published camera ({numbers}) "
                f"and {known.depth_scale:g} depth units per metre are taken"
            )
            return Intrinsics(known.title, known.numbers, known.size, known.depth_scale)
    return None
