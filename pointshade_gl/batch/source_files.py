"""What a source of a batch consists of: its frames, and the state of the files that each is made of.

Folders are listed, files are not opened: a batch of which everything is done ends at once.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ..files.access.content import MAX_PIXELS, note_read
from ..files.access.folders import LEVELS, Folder, Listing
from ..files.access.known_names import CAMERA_SUFFIXES, POSE_SUFFIXES, builtin_folder, builtin_scene
from ..files.clouds.recognise import is_cloud
from ..files.finding.folder_frames import find_frames, is_container
from ..files.frame_sources import SCENE_FILES, is_scene
from ..files.frames.frame_parts import ReadOptions
from ..files.frames.sequences import open_frames
from ..files.gltf.buffers import read_container
from .inputs import Source, is_about_frames


class Part(NamedTuple):
    """What one output is made of.

    number  of the frame in its sequence; None: all of it, or a scene
    input   the file that says most about it, such as its depth picture
    state   a digest of the names, sizes and times of the files that it is made of
    """

    number: int | None
    input: str
    state: str


def parts_of(source: Source, reading: dict[str, Any], output: Path, listing: Listing) -> list[Part]:
    """The frames of a source in their order; one part for a scene or a point cloud.

    reading  options of `load_frame`
    output   the batch's folder: what lies in it is no part of a source
    listing  looks at each folder once, as `find_sources` did

    Raises OSError if there are none, ValueError for files that hold nonsense.
    """
    named = [reading.get(name) for name in ("intrinsics", "depth_model")]
    given = [Path(one) for one in named if isinstance(one, str) and Path(one).is_file()]
    if is_scene(source.path):
        path = builtin_scene(source.path)
        note_read([path, *given])
        if output.is_relative_to(path.parent.resolve()):  # its pictures may be in the way
            with suppress(ValueError, OSError):  # told when it is read
                read_container(path, MAX_PIXELS)
        return [Part(None, str(path), _state([path, *given, *_beside_scene(path.parent, output, listing)]))]
    path = builtin_folder(source.path)
    if is_cloud(path):
        note_read([path])
        return [Part(None, str(path), _state([Path(path)]))]
    frames = _frames_of(path, dict(reading), listing)
    taken = {file for _, files in frames for file in files}
    note_read((*taken, *given))
    beside = _state([file for file in (*given, *_beside_frames(path, output, listing)) if file not in taken])
    return [Part(number, str(files[0]), _state(files, beside)) for number, files in frames]


def whole_of(source: Source, parts: list[Part]) -> Part:
    """All frames of a source as one part: of a film."""
    if len(parts) == 1:
        return parts[0]._replace(number=None)
    return Part(None, source.path, _digest(part.state for part in parts))


def _frames_of(path: Path, reading: dict[str, Any], listing: Listing) -> list[tuple[int, list[Path]]]:
    """The number of each frame, and its files."""
    outside = reading.pop("allow_outside", False)
    options = ReadOptions(**reading)
    if path.is_dir() and options.depth_model is None:
        found = find_frames(Folder(path, outside, listing=listing), _unheard, options.max_pixels)
        if len(found) > 1 or (found and not is_container(found[0].depth)):
            return [(one.number, [file for file in (one.depth, one.color, one.valid) if file]) for one in found]
    opened = open_frames(path, outside, options, _unheard).parts
    return [(one.number, [file for file in (one.path, one.color) if isinstance(file, Path)]) for one in opened]


def _beside_frames(path: Path, output: Path, listing: Listing) -> list[Path]:
    """Files of cameras and poses, and lists."""
    folder, levels = (path, LEVELS) if path.is_dir() else (path.parent, 0)
    items = listing.files(folder, levels, {*CAMERA_SUFFIXES, *POSE_SUFFIXES})
    return [item.path for item in items if is_about_frames(item.name) and not _is_in(output, item.path)]


@lru_cache(1)
def _beside_scene(folder: Path, output: Path, listing: Listing) -> list[Path]:
    """All files that a scene of a folder may name."""
    items = [item for item in listing.files(folder, LEVELS) if item.suffix not in SCENE_FILES]
    return [item.path for item in items if not _is_in(output, item.path)]


def _is_in(folder: Path, path: Path) -> bool:
    return str(path).startswith(f"{folder}{os.sep}")


def _state(files: Iterable[Path], more: str = "") -> str:
    """A digest of names, sizes and times."""
    told = []
    for path in files:
        try:
            status = path.stat()
        except OSError:  # told when it is read
            told.append(f"{path} missing")
        else:
            told.append(f"{path} {status.st_size} {status.st_mtime_ns}")
    return _digest([*told, more])


def _digest(texts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(texts).encode(errors="surrogateescape")).hexdigest()[:16]


def _unheard(_: str) -> None:
    """Notes are told when frames are read."""
