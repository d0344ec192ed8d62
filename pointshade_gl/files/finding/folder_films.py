"""Finds films of depth, and the films of colours that belong to them, by their names and their pictures."""

from __future__ import annotations

import re
from pathlib import Path

from ...notes.notes import Note
from ...notes.words import option
from ..access import known_names
from ..access.content import MAX_PIXELS
from ..access.folders import Folder, ListedFile, words_of
from ..depth.depth_film import film_coding
from ..pictures.video import count_pictures
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
