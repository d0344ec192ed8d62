"""What the INPUTs of a batch hold, found by the names of files, and the state of these files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from ..files.access import known_names as known
from ..files.access.content import MAX_PIXELS, note_read
from ..files.access.folders import LEVELS, Folder, ListedFile, Listing, from_root, words_of
from ..files.clouds.load_cloud import CLOUD_SUFFIXES, is_cloud
from ..files.finding.folder_frames import check_folder, find_frames, is_container
from ..files.frames.frame_parts import ReadOptions
from ..files.frames.sequences import open_frames
from ..files.gltf.buffers import read_container
from ..files.input_kinds import Kind

_ALONE = (".r3d", ".heic", ".heif")  # files of which each is a source, where no depth lies beside them
_OF_SEQUENCES = known.DEPTH | known.COLOR | known.SHOWN_DEPTH | known.NEITHER  # words for their folders
_OF_SEQUENCES |= known.SPARSE | known.FRAME_CAMERAS | known.FRAME_POSES
_LISTS = {*known.COLOR_LISTS, *known.DEPTH_LISTS}
_UNPACKED = {"metadata", "metadata.json"}  # Record3D's


class Source(NamedTuple):
    """A scene, a sequence, a single frame or a point cloud."""

    path: str  # absolute, or a built-in name
    name: PurePosixPath  # of its output, or of the folder of its outputs, relative to the batch's folder

    @property
    def kind(self) -> Kind:
        return Kind.of(self.path)


def find_sources(inputs: Sequence[str], output: Path, listing: Listing) -> list[Source]:
    """All sources in the inputs: each itself, or those in its folders, however deep. What lies in `output` is not read.

    Their names begin with that of their input, and go on as their folders do. Inputs of the same name have those of the
    folders before it that differ.

    listing  looks at each folder once, here and in `parts_of`

    Raises OSError for an input that does not exist, ValueError for an empty text.
    """
    if not all(inputs):
        raise ValueError("an INPUT is an empty text, expected a folder or a file: is a variable of the shell not set?")
    found: list[Source] = []
    for path, name in _named(map(_absolute, inputs)).items():
        if path in (*known.FRAMES, *known.SCENES) or Path(path).is_file():
            found.append(Source(path, name))
        else:
            folder = check_folder(path)
            real, out = os.path.realpath(folder), os.path.realpath(output)
            found += _below(folder, name, real, {out}, listing) or [Source(path, name)]
    return found


def not_whole(inputs: Sequence[str], listing: Listing) -> list[tuple[str, str]]:
    """The name of an input, and a sentence, for each folder in it of which something is left out."""
    named = _named(map(_absolute, inputs)).items()
    return [(str(name), sentence) for path, name in named for sentence in listing.not_whole(Path(path))]


@lru_cache(1024)  # folders have files of the same names
def is_about_frames(name: str) -> bool:
    """Whether a file is called like one of cameras or poses, or like a list of pictures."""
    patterns = (*known.CAMERAS, *known.POSES, known.TRANSFORMS, known.PAIR_LISTS)
    return name in _LISTS or any(pattern.fullmatch(name) for pattern in patterns)


def _absolute(text: str) -> str:
    """The path from the root; a built-in name stays."""
    return text if text in (*known.FRAMES, *known.SCENES) else str(from_root(Path(text)))


def _named(paths: Iterable[str]) -> dict[str, PurePosixPath]:
    """The name of each path: its last part, files without their suffix, and as many before it as all of them need."""
    names = {path: PurePosixPath(Path(path).as_posix().lstrip("/") or "input") for path in dict.fromkeys(paths)}
    names = {path: name.with_suffix("") if Path(path).is_file() else name for path, name in names.items()}
    longest = max((len(name.parts) for name in names.values()), default=1)
    for count in range(1, longest + 1):
        short = {path: PurePosixPath(*name.parts[-count:]) for path, name in names.items()}
        if len(set(short.values())) == len(short):
            return short
    return names


def _below(folder: Path, name: PurePosixPath, real: str, passed: set[str], listing: Listing) -> list[Source]:
    """The sources of a folder: itself, if it holds a frame or a sequence, else those in its folders. real: its path
    with links followed. passed: such paths of folders that are not entered: those above it, and that of the outputs."""
    if real in passed:
        return []
    files, inside = listing.files(folder, 0), listing.folders(folder)
    scenes = [item.path for item in files if item.suffix in known.SCENE_SUFFIXES]
    if scenes:
        return [Source(str(path), name / path.stem) for path in scenes]
    parts = [path for path in inside if words_of(path.name.lower()) & _OF_SEQUENCES and _is_part(path, listing)]
    if _has_depth(files) or _has_depth(_of(parts, folder, listing)) or _is_listed(folder, files, listing):
        return [Source(str(folder), name)]
    found = [
        source
        for path in inside
        if path not in parts
        for source in _below(path, name / path.name, _real(path, real), passed | {real}, listing)
    ]
    if clouds := _clouds(files, name):
        return clouds + found
    if len(found) > 1 or (found and not files and sum(bool(listing.files(path, LEVELS - 1)) for path in inside) <= 1):
        return found
    if _UNPACKED & {item.name for item in files} or _has_frames(folder, listing):
        return [Source(str(folder), name)]
    if found:  # beside it perhaps camera and poses
        return found
    return [Source(str(item.path), name / item.path.stem) for item in files if item.suffix in _ALONE]


def _clouds(files: list[ListedFile], name: PurePosixPath) -> list[Source]:
    """The point clouds among the files of a folder, found by their names; by all of it where others begin so."""
    maybe = [item for item in files if item.suffix in (*CLOUD_SUFFIXES, ".pcd")]
    paths = [item.path for item in maybe if item.suffix != ".pcd" or is_cloud(str(item.path))]
    stems = [path.stem for path in paths]
    return [Source(str(path), name / (path.stem if stems.count(path.stem) == 1 else path.name)) for path in paths]


def _real(path: Path, above: str) -> str:
    """The path with links followed, for that of the folder above."""
    return os.path.realpath(path) if path.is_symlink() else os.path.join(above, path.name)  # noqa: PTH118 - it is text


def _of(parts: list[Path], folder: Path, listing: Listing) -> Iterator[ListedFile]:
    """The files in some folders of a folder, by their names in it."""
    tops = tuple(f"{path.name.lower()}/" for path in parts)
    return (item for item in listing.files(folder, LEVELS) if item.name.startswith(tops)) if parts else iter(())


def _is_part(folder: Path, listing: Listing) -> bool:
    """Whether a folder holds a part of frames: not both depth and other pictures, whatever its own name."""
    items = listing.files(folder, LEVELS - 1)
    roles = {item.role for item in items if item.suffix in (*known.PICTURE_SUFFIXES, *known.DEPTH_SUFFIXES)}
    return bool(items) and not ("depth" in roles and roles & {"color", ""})


def _has_depth(items: Iterable[ListedFile]) -> bool:
    return any(
        item.role == "depth" and item.suffix in known.DEPTH_SUFFIXES and not known.NOT_PICTURES.fullmatch(item.name)
        for item in items
    )


def _is_listed(folder: Path, files: list[ListedFile], listing: Listing) -> bool:
    names = [item.name for item in files]
    lists = known.TRANSFORMS, known.PAIR_LISTS
    is_list = any(name in _LISTS or any(pattern.fullmatch(name) for pattern in lists) for name in names)
    return is_list and _has_frames(folder, listing)


def _has_frames(folder: Path, listing: Listing) -> bool:
    try:
        return bool(find_frames(Folder(folder, listing=listing), lambda _: None))
    except (ValueError, OSError):
        return True  # reported when it is read


class SourcePart(NamedTuple):
    """What one output is made of."""

    number: int | None  # of the frame in its sequence; None: all of it, or a scene
    input: str  # its main file, such as its depth picture
    state: str  # a digest of the names, sizes and times of the files that it is made of


def parts_of(source: Source, reading: dict[str, Any], output: Path, listing: Listing) -> list[SourcePart]:
    """The frames of a source in their order; one part for a scene or a point cloud.

    reading  options of `load_frame`
    output   the batch's folder: what lies in it is no part of a source
    listing  looks at each folder once, as `find_sources` did

    Raises OSError if there are none, ValueError for files that hold nonsense.
    """
    named = [reading.get(name) for name in ("intrinsics", "depth_model")]
    given = [Path(one) for one in named if isinstance(one, str) and Path(one).is_file()]
    kind = source.kind
    if kind is Kind.SCENE:
        path = known.builtin_scene(source.path)
        note_read([path, *given])
        if output.is_relative_to(path.parent.resolve()):  # its pictures may be in the way
            with suppress(ValueError, OSError):  # reported when it is read
                read_container(path, MAX_PIXELS)
        return [SourcePart(None, str(path), _state([path, *given, *_beside_scene(path.parent, output, listing)]))]
    path = known.builtin_folder(source.path)
    if kind is Kind.CLOUD:
        note_read([path])
        return [SourcePart(None, str(path), _state([Path(path)]))]
    frames = _frames_of(path, dict(reading), listing)
    taken = {file for _, files in frames for file in files}
    note_read((*taken, *given))
    beside = _state([file for file in (*given, *_beside_frames(path, output, listing)) if file not in taken])
    return [SourcePart(number, str(files[0]), _state(files, beside)) for number, files in frames]


def whole_of(source: Source, parts: list[SourcePart]) -> SourcePart:
    """All frames of a source as one part: of a film."""
    if len(parts) == 1:
        return parts[0]._replace(number=None)
    return SourcePart(None, source.path, _digest(part.state for part in parts))


def _frames_of(path: Path, reading: dict[str, Any], listing: Listing) -> list[tuple[int, list[Path]]]:
    outside = reading.pop("allow_outside", False)
    options = ReadOptions(**reading)
    if path.is_dir() and options.depth_model is None:
        found = find_frames(Folder(path, outside, listing=listing), lambda _: None, options.max_pixels)
        if len(found) > 1 or (found and not is_container(found[0].depth)):
            return [(one.number, [file for file in (one.depth, one.color, one.valid) if file]) for one in found]
    opened = open_frames(path, outside, options, lambda _: None).parts
    return [(one.number, [file for file in (one.path, one.color) if isinstance(file, Path)]) for one in opened]


def _beside_frames(path: Path, output: Path, listing: Listing) -> list[Path]:
    folder, levels = (path, LEVELS) if path.is_dir() else (path.parent, 0)
    items = listing.files(folder, levels, {*known.CAMERA_SUFFIXES, *known.POSE_SUFFIXES})
    return [item.path for item in items if is_about_frames(item.name) and not _is_in(output, item.path)]


@lru_cache(1)
def _beside_scene(folder: Path, output: Path, listing: Listing) -> list[Path]:
    """All files that a scene of a folder may name."""
    items = [item for item in listing.files(folder, LEVELS) if item.suffix not in known.SCENE_SUFFIXES]
    return [item.path for item in items if not _is_in(output, item.path)]


def _is_in(folder: Path, path: Path) -> bool:
    return str(path).startswith(f"{folder}{os.sep}")


def _state(files: Iterable[Path], more: str = "") -> str:
    stated = []
    for path in files:
        try:
            status = path.stat()
        except OSError:  # reported when it is read
            stated.append(f"{path} missing")
        else:
            stated.append(f"{path} {status.st_size} {status.st_mtime_ns}")
    return _digest([*stated, more])


def _digest(texts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(texts).encode(errors="surrogateescape")).hexdigest()[:16]
