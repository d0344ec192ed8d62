"""What a folder holds: the pictures of one frame, or the paired pictures of a sequence."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..notes import Note
from ..suggestions import near_path
from ..wording import option
from .builtin import FRAMES, SCENES
from .content import FilePath, read_text
from .limits import MAX_PIXELS, PARTS, check_limit
from .names import Folder

# If a folder holds several, the earlier ones win: for depth those that keep the most, for colour the lossless ones.
COLOR_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".ppm", ".webp", ".jpg", ".jpeg")
DEPTH_SUFFIXES = (".exr", ".npy", ".npz", ".pfm", ".tif", ".tiff", ".png", ".pgm", ".webp", ".bmp", ".jpg", ".jpeg")
COLOR_NAMES, DEPTH_NAMES = ("color", "rgb"), ("depth",)

_WORD = r"(?:^|[\W_])(?:{})(?=[\W_]|\d*$)"  # in a file's name: depth_0001, depth0001, 0001.depth; not depth16_raw
_WORDS = re.compile(_WORD.format("|".join(COLOR_NAMES + DEPTH_NAMES)))


class PictureFile(NamedTuple):
    """One picture of a sequence: its file, its name without the word depth or color, its time stamp if it has one."""

    path: Path
    key: str
    time: float | None


class Pair(NamedTuple):
    """The files of one frame; the time stamp is the depth's. Without a colour picture the surface is light grey."""

    depth: Path
    color: Path | None
    time: float | None


def check_folder(folder: FilePath) -> Path:
    """The folder as a path. Raises OSError if it is not one."""
    place = Path(folder)
    if place.is_file():
        raise NotADirectoryError(
            f"{place} is a file, expected a folder: "
            f"pass single files as {option('depth', 'FILE')} and {option('color', 'FILE')}"
        )
    if not place.is_dir():
        raise FileNotFoundError(f"there is no folder {place}{near_path(place, (*FRAMES, *SCENES))}")
    return place


def find_picture(
    folder: Path, names: tuple[str, ...], suffixes: tuple[str, ...], stem: str | None, note: Note
) -> Path | None:
    """The picture with one of the names. In a folder with such a name: the picture with the stem, else the first."""
    for name in names:
        found = sorted(
            (path for path in _pictures(folder, suffixes) if path.stem.lower() == name),
            key=lambda path: suffixes.index(path.suffix.lower()),
        )
        if len(found) > 1:
            note(f"{folder} has {', '.join(path.name for path in found)}: {found[0].name} is taken")
        if not found and (folder / name).is_dir():
            found = sorted(_pictures(folder / name, suffixes), key=lambda path: (path.stem != stem, _natural(path)))
            if found:
                note(f"{folder / name} is a sequence of {len(found)}: {found[0].name} is taken")
        if found:
            return found[0]
    return None


def find_pairs(place: Folder, note: Note, max_pixels: float = MAX_PIXELS) -> list[Pair]:
    """The frames of a sequence in their order; none for a folder with one frame or without any.

    Pictures are those that depth.txt and rgb.txt list (TUM), those of the folders depth/ and color/ (or rgb/), or files
    such as depth_0001.png and color_0001.png or 0001.depth.png. Depth and colour belong together by name, else by the
    nearest time stamp, else by order. Raises ValueError if none of these fits, or if a list names files elsewhere.
    """
    folder = place.path
    if any(path.stem.lower() in DEPTH_NAMES for path in _pictures(folder, DEPTH_SUFFIXES)):
        return []
    depths = _list_pictures(place, DEPTH_NAMES, DEPTH_SUFFIXES, max_pixels)
    colors = _list_pictures(place, COLOR_NAMES, COLOR_SUFFIXES, max_pixels)
    if not depths or not colors:
        return [Pair(item.path, None, item.time) for item in depths]
    partners = _partners(folder, depths, colors, note)
    alone = partners.count(None)
    if alone:
        note(f"{folder}: {alone} of {len(depths)} depth pictures have no colour picture and are left out")
    return [Pair(item.path, mate.path, item.time) for item, mate in zip(depths, partners, strict=True) if mate]


def _partners(
    folder: Path, depths: list[PictureFile], colors: list[PictureFile], note: Note
) -> list[PictureFile | None]:
    """For each depth picture its colour picture, None where there is none."""
    named = {item.key: item for item in colors}
    partners = [named.get(item.key) for item in depths]
    if 2 * (len(depths) - partners.count(None)) > min(len(depths), len(colors)):
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
    if len(depths) != len(colors):
        raise ValueError(
            f"{folder} has {len(depths)} depth and {len(colors)} colour pictures whose names do not show which belong "
            "together: give the two of a frame the same name"
        )
    note(f"{folder}: depth and colour are paired by order, their names do not match")
    return list(colors)


def nearest(wanted: np.ndarray, offered: np.ndarray) -> np.ndarray:
    """(n,) for each of n time stamps the index of the nearest of the m offered ones."""
    order = np.argsort(offered, kind="stable")
    right = np.searchsorted(offered[order], wanted).clip(1, len(offered) - 1) if len(offered) > 1 else np.zeros(1, int)
    left = np.maximum(right - 1, 0)
    is_left = np.abs(offered[order][left] - wanted) <= np.abs(offered[order][right] - wanted)
    return order[np.where(is_left, left, right)]


def _list_pictures(
    place: Folder, names: tuple[str, ...], suffixes: tuple[str, ...], max_pixels: float
) -> list[PictureFile]:
    folder = place.path
    for name in names:
        if (folder / f"{name}.txt").is_file():
            listed = _read_list(place, folder / f"{name}.txt", suffixes, max_pixels)
            if listed:
                return listed
        if (folder / name).is_dir():
            found = _pictures(folder / name, suffixes)
        else:
            word = re.compile(_WORD.format(name))
            found = [path for path in _pictures(folder, suffixes) if word.search(path.stem.lower())]
            found = [path for path in found if re.search(r"\d", _key(path))]
        if found:
            best = {_key(path): path for path in sorted(found, key=lambda path: -suffixes.index(path.suffix.lower()))}
            return [PictureFile(path, _key(path), _number(_key(path))) for path in sorted(best.values(), key=_natural)]
    return []


def _read_list(place: Folder, path: Path, suffixes: tuple[str, ...], max_pixels: float) -> list[PictureFile]:
    """The pictures of a text file with a time stamp and a file name a line; none if it holds anything else."""
    lines = read_text(place.check(path), max_pixels).splitlines()
    check_limit(len(lines), f"{path} has {len(lines)} lines", max_pixels, PARTS)
    found = []
    for line in lines:
        words = line.split("#")[0].split(maxsplit=1)
        time = _number(words[0]) if len(words) == 2 else None
        if time is None or not words[1].rstrip().lower().endswith(suffixes):
            continue
        try:
            file = place.named(words[1].rstrip())
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        found.append(PictureFile(file, _key(file), time))
    return found


def _key(path: Path) -> str:
    """What the pictures of one frame have in common: 0001 of depth_0001.png, frame-0001 of frame-0001.color.png."""
    return _WORDS.sub("", path.stem.lower()).strip("._- ")


def _number(text: str) -> float | None:
    number = float(text) if re.fullmatch(r"\d+(\.\d*)?", text) else math.inf
    return number if number < math.inf else None  # 400 digits are infinite, too


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sorts 2.png before 10.png."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def _pictures(folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    # macOS leaves hidden twins such as ._color.png on foreign disks
    files = (path for path in folder.iterdir() if path.suffix.lower() in suffixes and path.name[0] != ".")
    return [path for path in files if path.is_file()]
