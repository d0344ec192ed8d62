"""Groups the files of a folder into frames: which depth and colour pictures belong together."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ...notes.notes import Note
from ...notes.words import near_path, option
from ..access.builtin import FRAMES, SCENES
from ..access.content import FilePath, followed
from ..access.file_name_patterns import (
    ANY_PICTURE,
    COLOR,
    COLOR_SUFFIXES,
    CONFIDENCE,
    CONTAINERS,
    DEPTH,
    DEPTH_SUFFIXES,
    NOT_PICTURES,
    ONLY_DEPTH,
    RAW_SUFFIXES,
    RIGHT_VIEWS,
    SHOWN_DEPTH,
    SPARSE,
    VALID,
    VIDEO_SUFFIXES,
)
from ..access.folder_listing import LEVELS, Item, key_of, words_of
from ..access.limits import MAX_PIXELS
from ..access.safe_paths import Folder, places_of
from ..pictures.picture_files import is_ours
from ..pictures.picture_heads import is_deep_grey
from .best_group import best_group, template
from .own_files import matches
from .pairing import find_partners
from .picture_lists import listed_pictures

_OF_THE_SYSTEM = (("/", "proc"), ("/", "sys"))  # links in them lead to the whole machine


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
    if followed(place).parts[:2] in _OF_THE_SYSTEM:
        raise OSError(f"{place} is a folder in which Linux shows its own state, and no pictures: pass another one")
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
    colors = colors or _colors_beside(place, folder, depths, note)
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
    real = followed(depth)
    looks = [(place.path, depth)] + ([(real.parent, real)] if depth.is_symlink() and place.root is None else [])
    for folder, file in looks:
        named = Item(file, file.name.lower())
        colors = _colors_in(place, folder, named) or _colors_beside(place, folder, [named], lambda _: None)
        same = next((item.path for item in colors if item.key == named.key), None)
        if len(colors) > 1 and not same:
            note(f"{folder} has {len(colors)} colour pictures: {colors[0].path.name} is taken")
        if colors:
            return same or colors[0].path
    note(f"no colour picture lies beside {depth.name} (color.*, rgb.*, image.*): the surface is light grey")
    return None


def find_photographs(place: Folder, note: Note) -> list[Path]:
    """The photographs of a folder in their order, or its video; those of one folder of it if it has none itself.

    Pictures that are named as anything but colours are left out, and those that this package drew.
    """
    folder = place.path
    for levels in range(1, LEVELS + 1):
        items = [item for item in place.listing.files(folder, levels) if item.role in ("color", "")]
        photos = [item for item in items if item.suffix in COLOR_SUFFIXES and not is_ours(item.path)]
        photos = [item for item in photos if place.root is None or place.check(item.path)]
        if photos:
            own = sorted({item.path.parent for item in photos}, key=lambda one: (not words_of(one.name) & COLOR, one))
            if len(own) > 1:
                note(f"{folder}: the photographs of {own[0].name} are taken, not those of {own[1].name}")
            return [item.path for item in sorted(photos, key=lambda item: item.order) if item.path.parent == own[0]]
        if videos := [item.path for item in items if item.suffix in VIDEO_SUFFIXES]:
            return videos[:1]
    return []


def _colors_in(place: Folder, folder: Path, depth: Item) -> list[Item]:
    """The colour pictures of a folder, for one depth picture of it; in a folder of depth only what is surely none."""
    items = [item for item in place.listing.files(folder, 1) if item.suffix in COLOR_SUFFIXES]
    if _folders_above(folder):
        items = [item for item in items if not item.words & SHOWN_DEPTH]
        if depth.role != "depth":  # depth/image_1.png, depth/image_2.png
            items = [item for item in items if (item.words - ANY_PICTURE | item.folder_words) & COLOR]
    return _colors_of(folder, items, [depth], lambda _: None)


def _colors_beside(place: Folder, folder: Path, depths: list[Item], note: Note) -> list[Item]:
    """The colour pictures beside a folder of depth pictures, but not those of other frames: with depth of their own."""
    for above, name in _folders_above(folder) if place.root is None else ():
        items = [item for item in place.listing.files(above, 1) if not item.name.startswith(f"{name}/")]
        others = {item.path.parent for item in items if item.level and item.role == "depth"}
        items = [item for item in items if item.suffix in COLOR_SUFFIXES and item.path.parent not in others]
        if colors := _colors_of(above, items, depths, note):
            return colors
    return []


def _folders_above(folder: Path) -> list[tuple[Path, str]]:
    """The folders above one of depth pictures, where their colours may be, and its name in each; none for others."""
    return [(one.parent, one.name.lower()) for one in places_of(folder) if words_of(one.name) & DEPTH]


def _depths_of(folder: Path, pictures: list[Item], note: Note) -> list[Item]:
    """Return the depth pictures: those named so, else those that cannot be anything else."""
    allowed = [item for item in pictures if item.suffix in DEPTH_SUFFIXES and not _is_right(item, pictures)]
    for wanted in ("depth", "", "sparse depth", "shown depth"):
        found = [item for item in allowed if _depth_role(item) == wanted]
        if wanted == "":
            found = [item for item in found if item.suffix in ONLY_DEPTH] or _deep_grey(found)
        if found:
            found = [item for item in found if item.suffix not in RAW_SUFFIXES] or found
            return best_group(folder, found, "depth", note)
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
            return best_group(folder, found, "colour", note, depths)
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
        if template(item) not in firsts:
            firsts[template(item)] = is_deep_grey(item.path)
    return [item for item in items if firsts[template(item)]]


def _is_mask_of(item: Item, depth: Item) -> bool:
    """Return whether a mask or a confidence is about the depth: it is named so, or it lies beside a network's depth."""
    if item.words & DEPTH or (item.words | item.folder_words) & CONFIDENCE:
        return True
    return item.stem == "mask" and item.path.parent == depth.path.parent


def is_container(path: Path) -> bool:
    """Whether a file may hold depth together with colour and camera."""
    return path.suffix.lower() in CONTAINERS
