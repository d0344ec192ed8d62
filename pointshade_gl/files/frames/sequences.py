"""Opens the frames of a folder or a file as a sequence, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ...notes.notes import Note
from ...notes.words import counted, option
from ..access.file_name_patterns import COLOR_SUFFIXES, DEPTH_SUFFIXES
from ..access.safe_paths import Folder
from ..containers.contents import Contents
from ..depth_models.model_options import how_to_make_depth
from ..index.folder_cameras import Cameras
from ..index.folder_poses import FoundPoses, find_poses
from ..index.folders import FrameFiles, check_folder, find_color, find_frames, is_container
from ..index.given_poses import given_poses
from .camera_choice import find_filed
from .frame_parts import Assembled, Parts, ReadOptions
from .frame_sequence import FrameSequence
from .registration import check_registration
from .unsupported_formats import check_readable, what_else


def open_frames(source: Path, allow_outside: bool, options: ReadOptions, note: Note) -> FrameSequence:
    """Open the frames of a folder or file. Raises OSError if there are none, ValueError for impossible content."""
    if options.depth_model is not None:
        from .photographs import open_photographs  # only here

        folder = source.parent if source.is_file() else check_folder(source)
        return open_photographs(Folder(folder, allow_outside), source, options, note)
    if not source.is_file():
        return open_folder(Folder(check_folder(source), allow_outside), options, note)
    check_readable(source)
    from ..containers.zip_folder import is_zip_folder, unpack_folder  # only here

    if is_zip_folder(source, options.max_pixels):
        return open_folder(Folder(unpack_folder(source, options.max_pixels)), options, note)
    place = Folder(source.parent, allow_outside)
    # a container may hold the colours itself, so it need not have any beside it
    color = find_color(place, source, (lambda _: None) if is_container(source) else note)
    return _from_files(place, [FrameFiles(source, color)], options, note)


def open_folder(place: Folder, options: ReadOptions, note: Note) -> FrameSequence:
    """Open the frames of a folder, likewise."""
    if options.depth_model is not None:
        return open_frames(place.path, place.allow_outside, options, note)
    files = find_frames(place, note, options.max_pixels)
    if not files and (held := _open_container(place.path, note, options.max_pixels)):
        return _from_container(place, place.path, held, options, note)
    missed = place.listing.not_whole(place.path)
    if not files and missed:
        raise OSError(f"{place.path} has no depth picture, but {missed[0]}")
    if missed:
        more = f" (and {counted(len(missed) - 1, 'more folder')} likewise)" if len(missed) > 1 else ""
        note(f"{missed[0]}{more}")
    if not files:
        raise FileNotFoundError(
            f"{place.path} has no depth picture: expected depth.png (or {', '.join(DEPTH_SUFFIXES[:6])}...) "
            f"or a folder depth/ in it, or pass {option('depth', 'FILE')}{_instead(place)}"
        )
    return _from_files(place, files, options, note)


def _instead(place: Folder) -> str:
    """What a folder holds instead of depth, and what to do with it, to end a sentence; "" if nothing is known."""
    folder, files = place.path, [item.path for item in place.listing.files(place.path, 1)]
    for path in files:
        if found := what_else(path):
            return f"; {path.relative_to(folder)} is {found}"
    photo = next((path for path in files if path.suffix.lower() in COLOR_SUFFIXES), None)
    if photo is None:
        return "; it is empty" if not files else ""
    return f"; {photo.relative_to(folder)} is a photograph: {how_to_make_depth()}"


def _open_container(path: Path, note: Note, max_pixels: float) -> Sequence[Contents] | None:
    from ..containers.opening import open_container  # only here: its readers are many

    return open_container(path, note, max_pixels)


def _from_files(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> FrameSequence:
    limit, first = options.max_pixels, files[0].depth
    held = _open_container(first, note, limit) if is_container(first) else None
    if held is not None and len(files) == 1 < len(held):
        return _from_container(place, first, held, options, note)
    cameras = find_filed(place, files, options, note)
    poses = FoundPoses([None] * len(files))
    if options.poses is not None:
        poses = given_poses(options.poses, place.path, files, note, limit)
    elif options.pose is None and len(files) > 1:
        poses = find_poses(place, files, note, limit)
    parts = []
    for one, pose in zip(files, poses.poses, strict=True):
        contents = None if held is None else partial(_only, one.depth, limit)
        if held and one is files[0]:  # whose notes are told
            contents = partial(held.__getitem__, 0)
        where = cameras.of(one.number), pose, one.valid, cameras.missing, one.number
        parts.append(Parts(one.depth, one.color, *where, contents, one.depth))
    parts = _without_lost(parts, place.path, note)
    sequence = FrameSequence(place, parts, options, note, poses.source)
    if sequence.posed > 1:
        known = cameras.of(0)
        guessed = options.depth_scale is None and (known is None or known.depth_scale is None)
        sequence.settle(may_scale=guessed, metric_poses=poses.metric)
    return sequence


def _from_container(
    place: Folder, path: Path, held: Sequence[Contents], options: ReadOptions, note: Note
) -> FrameSequence:
    """Return the frames of one file, whose colours and camera may lie beside it."""
    first = held[0]
    cameras = find_filed(place, [], options, note) if first.intrinsics is None else Cameras(None)
    poses = FoundPoses([None] * len(held))
    if options.poses is not None:
        entries = [FrameFiles(path / str(k), number=k) for k in range(len(held))]
        poses = given_poses(options.poses, path, entries, note, options.max_pixels)
    elif first.pose is not None:
        is_alone = len(held) == 1  # it is read with the rest
        poses = FoundPoses([None if is_alone else held[k].pose for k in range(len(held))], path.name)
    parts = [
        Parts(None, None, cameras.of(k), poses.poses[k], None, cameras.missing, k, partial(held.__getitem__, k), path)
        for k in range(len(held))
    ]
    sequence = FrameSequence(place, parts, options, note, poses.source)
    if sequence.posed > 1:
        sequence.settle(may_scale=False, metric_poses=poses.metric)
    return sequence


def _only(path: Path, max_pixels: float) -> Contents:
    """What a container with one frame holds."""
    held = _open_container(path, lambda _: None, max_pixels)
    if not held:
        raise ValueError(f"{path} holds no depth, unlike the first file beside it")
    return held[0]


def _without_lost(parts: list[Parts], folder: Path, note: Note) -> list[Parts]:
    """Leave out the frames whose pose was lost when they were recorded: ScanNet writes -inf."""
    good = [one for one in parts if one.pose is None or np.isfinite(one.pose).all()]
    if not good or len(good) == len(parts):
        return parts
    note(f"{folder}: {len(parts) - len(good)} of {len(parts)} frames have lost their pose (it is not finite): left out")
    return good


def first_readable(sequence: FrameSequence) -> tuple[int, Assembled]:
    """Return the first readable frame, and its index; else raises the first frame's error."""
    for index in dict.fromkeys((0, len(sequence) // 2, len(sequence) - 1)):
        try:
            read = sequence.assembled(index)
        except (ValueError, OSError):
            continue
        check_registration(read.frame, sequence.note)
        return index, read
    return 0, sequence.assembled(0)
