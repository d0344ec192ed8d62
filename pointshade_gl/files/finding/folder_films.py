"""Films of depth, and the films of colours that belong to them: found by name and picture, read in greys, hues or the
colours of a map; alone, or beside the colours."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import option
from ..access import known_names
from ..access.content import MAX_PIXELS, FilePath
from ..access.folders import Folder, ListedFile, words_of
from ..depth.depth_coding import what_instead
from ..depth.depth_files import read_levels
from ..pictures.video import count_pictures, pixel_format, read_video_frame
from .folder_frames import FrameFiles

_ROLE = re.compile(r"(?<![a-z])(depth(map|s)?|disp(arity)?|vis|src|input|rgb|colou?r|video|gr[ae]y)(?![a-z])")


def find_film(place: Folder, source: Path | None, note: Note, max_pixels: float = MAX_PIXELS) -> list[FrameFiles]:
    """The pictures of a film of depth, or of one that holds depth beside its colours; none without any. source: one of
    the two films; None is the first of the folder. Raises ValueError for a broken film of depth."""
    films = place.listing.files(place.path, 0 if source else 1, known_names.VIDEO_SUFFIXES)
    named = [ListedFile(source, source.name.lower())] if source else films
    if source and words_of(place.path.name) & (known_names.DEPTH | known_names.COLOR):  # depth/clip.mp4, rgb/clip.mp4
        films = place.listing.files(place.path.parent, 1, known_names.VIDEO_SUFFIXES)
    depths = [one for one in named if _is_depth(one)]
    if source and not depths:
        depths = [one for one in films if _is_depth(one) and _stem(one) == _stem(named[0])]
    if depths and (_is_called_depth(depths[0]) or film_coding(depths[0].path, True, max_pixels)):
        if len(depths) > 1:
            note(f"{place.path}: {depths[0].path.name} is taken as the depth, not {depths[1].path.name}")
        depth, color = depths[0].path, named[0] if source and not _is_depth(named[0]) else _color_of(depths[0], films)
        return film_pictures(depth, color.path if color else None, True, note, max_pixels)
    for one in named:
        try:
            found = film_coding(one.path, False, max_pixels)
        except ValueError:  # without the extra, or broken: what to do with a film is said elsewhere
            return []
        if found is not None:
            return film_pictures(one.path, one.path, False, note, max_pixels)
    return []


def film_pictures(
    depth: Path, color: Path | None, is_depth: bool, note: Note, max_pixels: float = MAX_PIXELS
) -> list[FrameFiles]:
    """The pictures of a film of depth with those of a film of colours, or one picture of colours for all. is_depth: it
    is depth by its name, or said to be."""
    coding = film_coding(depth, is_depth, max_pixels)
    if coding is not None:
        coding.note(depth.name, note)
        color = depth if coding.half else color
    count = count_pictures(depth, max_pixels)
    if color is None:
        note(f"no film of colours lies beside {depth.name}: the surface is light grey")
    elif color != depth:
        note(f"the depth is {depth.name}, the colours are {color.name}; pass {option('color', 'FILE')} for others")
        is_film = color.suffix.lower() in known_names.VIDEO_SUFFIXES
        several = count_pictures(color, max_pixels) if is_film else count
        if several != count:
            note(f"{depth.name} has {count} pictures, {color.name} {several}: those that both have are taken, by order")
        count = min(count, several)
    return [FrameFiles(depth, color, number=k) for k in range(count)]


def _is_depth(film: ListedFile) -> bool:
    """Whether a film is called for depth, or lies in a folder that is."""
    is_color = words_of(film.path.stem) & known_names.COLOR
    return _is_called_depth(film) or bool(not is_color and words_of(film.path.parent.name) & known_names.DEPTH)


def _is_called_depth(film: ListedFile) -> bool:
    return bool(words_of(film.path.stem) & (known_names.DEPTH | {"vis"}))


def _color_of(depth: ListedFile, films: list[ListedFile]) -> ListedFile | None:
    """The film of the same name, without the words for what it is; else the only one of colours."""
    others = [one for one in films if not _is_depth(one)]
    same = [one for one in others if _stem(one) == _stem(depth)]
    return same[0] if same else others[0] if len(others) == 1 else None


def _stem(film: ListedFile) -> str:
    return re.sub(r"[\W_]+", "", _ROLE.sub("", film.stem))


_DEEP = re.compile(r"(?:gray|p|p0)(\d\d)(?:le|be)")  # gray16le, yuv420p10le, p010le
_GREY = 12  # steps between the channels of a grey, after compression
_SHARE = 0.95  # of the pixels must be so
_FULL, _NONE = 200, 60  # the largest channel of a hue is above, the smallest below
_VARIED = 64  # of 1530 hues, between the 2nd and the 98th percentile of a picture
HUES = 1530  # steps from red over yellow, green, cyan, blue and magenta back to red
_RED = 8  # steps from both ends: where Record3D puts what is missing
RECORD3D = HUES / 3  # values a metre: its hues reach from 0 to 3 m
_OTHER = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}  # halves of a picture


class FilmCoding(NamedTuple):
    """How the pictures of a film hold depth."""

    form: str  # grey, hues, map
    levels: int  # different values, at most
    half: str = ""  # of each picture that is depth, beside the colours in the other; "" is all of it

    @property
    def kind(self) -> str | None:
        """What a file states, as far as the form does."""
        return "z" if self.form == "hues" else None

    @property
    def scale(self) -> float | None:
        return RECORD3D if (self.form, self.half) == ("hues", "left") else None

    def note(self, name: str, note: Note) -> None:
        """Say how the film is read."""
        where = f"the {self.half} half of {name} is" if self.half else f"{name} is"
        if self.form == "hues":
            unit = f"{option('depth_scale')} ({HUES} / metres from red to red)"
            what = "Record3D's, in hues from 0 to 3 m" if self.scale else "in hues, red is near and the unit unknown"
            note(f"{where} taken as depth, {what}; pass {unit} or {option('depth_kind', 'inverse')} if that is wrong")
        elif self.half:
            way_out = f"pass two films as {option('color', 'FILE')} and {option('depth', 'FILE')} if they are not"
            note(f"{where} taken as the depth of the colours in the other; {way_out}")


def film_coding(path: FilePath, is_depth: bool, max_pixels: float = MAX_PIXELS) -> FilmCoding | None:
    """How a film holds depth, by its first picture; None for a film of photographs. is_depth: it is depth by its name,
    or said to be: else a film of greys is one of photographs."""
    state = Path(path).stat()
    return _coding(Path(path), (state.st_mtime_ns, state.st_size), is_depth, max_pixels)


@lru_cache(16)
def _coding(path: Path, version: tuple[int, int], is_depth: bool, max_pixels: float) -> FilmCoding | None:
    """version  is another one when the file was written again"""
    picture = read_video_frame(path, 0, max_pixels)
    deep = _DEEP.search(pixel_format(path))
    bits = int(deep[1]) if deep else 8
    if is_depth and (form := _form_of(picture)):
        return FilmCoding(form, HUES if form == "hues" else 2**bits)
    for half in _OTHER:
        part = _half(picture, half)
        form, other = _form_of(part), _form_of(_half(picture, _OTHER[half]))
        if form and not other and not (form == "grey" and what_instead(part[..., 1])):
            return FilmCoding(form, HUES if form == "hues" else 2**bits, half)
    return None


def read_film_depth(path: FilePath, number: int, max_pixels: float = MAX_PIXELS) -> NDArray[Any]:
    """(h, w) values of a picture of a film, from 0; (h, w, 3) uint8 in the colours of a map. Raises ValueError."""
    coding = film_coding(path, True, max_pixels)
    if coding is None:
        way_out = f"pass depth in greys, hues or the colours of a map as {option('depth', 'FILE')}"
        raise ValueError(f"{path} is a film of photographs, not of depth: {way_out}")
    if coding.form == "grey" and coding.levels > 256:
        deep = _half(read_video_frame(path, number, max_pixels, is_deep=True), coding.half)
        return deep if coding.levels == 2**16 else deep // np.uint16(2**16 // coding.levels)
    picture = _half(read_video_frame(path, number, max_pixels), coding.half)
    if coding.form == "hues":
        return _from_hues(picture, drop_red=coding.scale is not None)
    return picture[..., 1] if coding.form == "grey" else picture


def read_film_color(path: FilePath, number: int, max_pixels: float = MAX_PIXELS) -> NDArray[np.uint8]:
    """(h, w, 3) of a film that holds depth and colours beside each other."""
    coding = film_coding(path, True, max_pixels)
    return _half(read_video_frame(path, number, max_pixels), _OTHER[coding.half] if coding and coding.half else "")


def _half(picture: NDArray[Any], name: str) -> NDArray[Any]:
    height, width = picture.shape[0] // 2, picture.shape[1] // 2
    if name in ("left", "right"):
        return picture[:, :width] if name == "left" else picture[:, -width:]
    return picture[:height] if name == "top" else picture[-height:] if name == "bottom" else picture


def _form_of(picture: NDArray[np.uint8]) -> str:
    """Return "grey", "hues" or "map"; "" for a photograph."""
    low, high = picture.min(axis=2), picture.max(axis=2)
    if np.mean(high.astype(int) - low < _GREY) > _SHARE:
        return "grey"
    seen = high > _NONE  # what is missing is black
    if np.mean((high > _FULL)[seen] & (low < _NONE)[seen]) > _SHARE:
        hues = _from_hues(picture, drop_red=False)
        first, last = np.nanquantile(hues, (0.02, 0.98))
        return "hues" if last - first > _VARIED else ""
    return "map" if read_levels(picture) is not None else ""


def _from_hues(picture: NDArray[np.uint8], drop_red: bool) -> NDArray[np.float32]:
    """(h, w) steps on the circle of hues, NaN where a colour is none (Sonoda and Grunnet-Jepsen, Intel, 2021)."""
    red, green, blue = np.moveaxis(picture.astype(np.float32), 2, 0)
    low, high = picture.min(axis=2), picture.max(axis=2)
    span = np.maximum(high.astype(np.float32) - low, 1)
    sixth = np.where(
        red >= np.maximum(green, blue),
        (green - blue) / span % 6,
        np.where(green >= blue, 2 + (blue - red) / span, 4 + (red - green) / span),
    )
    steps = (sixth * (HUES / 6)).astype(np.float32)
    missing = high <= _NONE
    if drop_red:
        missing |= (steps < _RED) | (steps > HUES - _RED)
    return np.where(missing, np.float32(np.nan), steps)
