"""Opens the frames of a folder or a file as a sequence, each read when it is asked for."""

from __future__ import annotations

import weakref
from collections.abc import Hashable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import overload

import numpy as np

from ...messages.bugs import Bug, error_text, is_expected
from ...messages.formatting import counted, option
from ...messages.notes import Note
from ...scene.frame import Frame
from ..access.file_name_patterns import COLOR_SUFFIXES, DEPTH_SUFFIXES, VIDEO_SUFFIXES
from ..access.folder_listing import Listing
from ..access.safe_paths import Folder
from ..containers.contents import Contents
from ..depth.depth_kinds import Coding
from ..depth_models.model_options import how_to_make_depth
from ..index.folder_cameras import Cameras, find_cameras
from ..index.folder_poses import FoundPoses, find_poses
from ..index.folders import FrameFiles, check_folder, find_color, find_frames, is_container
from ..poses.pose_convention import FAILS, Reading, find_reading
from .assembly import assemble
from .frame_parts import Assembled, Parts, ReadOptions
from .registration import check_registration
from .unsupported_formats import check_readable, what_else

_APART = 0.1  # metres, or what a turn of 6 degrees changes: views that are compared are so far apart
_COMPARED = 3


class FrameSequence(Sequence[Frame]):
    """Frames, each read when it is asked for; slices are sequences too.

    [k] raises ValueError or OSError, in one sentence, for a frame that cannot be read.
    """

    def __init__(
        self,
        place: Folder,
        parts: Sequence[Parts],
        options: ReadOptions,
        note: Note,
        poses_from: str = "",
        reading: Reading | None = None,
        coding: Coding | None = None,
        stream: Hashable = None,
    ):
        self.folder, self.parts, self.note, self.poses_from, self.reading = place.path, parts, note, poses_from, reading
        self.posed = sum(one.pose is not None for one in parts)  # how many frames have a pose
        self._place, self._options = replace(place, listing=Listing()), options  # what was listed is not kept
        self._stream = stream or (object() if len(parts) > 1 else None)  # what its frames have in common
        if parts and isinstance(parts[0].color, Path) and parts[0].color.suffix.lower() in VIDEO_SUFFIXES:
            weakref.finalize(self, _end_video)
        self._coding = coding  # of the depth of the first frame that was read: the others are read like it

    def __len__(self) -> int:
        return len(self.parts)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FrameSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FrameSequence:
        if isinstance(index, slice):
            known = self._options, self.note, self.poses_from, self.reading, self._coding, self._stream
            return FrameSequence(self._place, self.parts[index], *known)
        return self.assembled(index).frame

    def assembled(self, index: int, note: Note | None = None, with_color: bool = True) -> Assembled:
        """Return a frame, and how its files were understood: all as the first that was read. Raises as [k] does."""
        parts = self.parts[index]
        try:
            for path in (parts.path, parts.color, parts.valid):
                if isinstance(path, Path):
                    self._place.check(path)
            parts = parts if with_color else parts._replace(color=None)
            read = assemble(parts, self._options, note or self.note, self.reading, self._coding, self._stream)
            if note is None:
                self._coding = self._coding or read.coding
        except Exception as error:
            if len(self) == 1 or isinstance(error, MemoryError):
                raise
            if isinstance(error, OSError):
                raise OSError(f"frame {index}: {_naming(parts, error)}") from None
            if is_expected(error):
                raise ValueError(f"frame {index}: {_naming(parts, error)}") from None
            raise Bug(f"frame {index}: {error_text(error)}") from error
        found = read.found._replace(frames=len(self), shown=index, poses=self.posed, poses_from=self.poses_from)
        return read._replace(found=found)

    def settle(self, may_scale: bool, metric_poses: bool) -> None:
        """Find out how poses and camera are to be understood, from frames that see the same. A note tells any change.

        may_scale     the unit of the depth was guessed
        metric_poses  the unit of the poses is the metre; else it is anything
        """
        try:
            frames = [self.assembled(k, lambda _: None, with_color=False).frame for k in self._apart()]
        except (ValueError, OSError):
            return  # reported when they are asked for
        found = find_reading(frames, may_scale, metric_poses)
        if found is None:
            return
        if found.reading != Reading():
            self.reading = found.reading
            self.note(
                f"{self.folder}: the views lie over each other only if {found.reading}, so they are read like that "
                f"(their depths differ by {found.error:.1%} instead of {found.error_as_written:.0%})"
            )
        elif found.error > FAILS:
            self.note(
                f"{self.folder}: by their poses the views do not lie over each other (their depths differ by "
                f"{found.error:.0%}): are {option('depth_scale')}, camera and poses right?"
            )

    def _apart(self) -> list[int]:
        """Return the first frame, and the next ones that were taken from elsewhere."""
        found: list[int] = []
        for index, one in enumerate(self.parts[:5000]):
            last = self.parts[found[-1]].pose if found else None
            if one.pose is not None and (last is None or abs(one.pose - last).max() > _APART):
                found.append(index)
            if len(found) == _COMPARED:
                break
        return found


def _end_video() -> None:
    """End the process that decodes a video, with the sequence."""
    from ..pictures.video import close_video  # only here

    close_video()


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
    if options.pose is None and len(files) > 1:
        poses = find_poses(place, files, note, limit)
    parts = []
    for one, pose in zip(files, poses.poses, strict=True):
        contents = None if held is None else partial(_only, one.depth, limit)
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
    poses = [held[k].pose for k in range(len(held))] if len(held) > 1 and first.pose is not None else [None] * len(held)
    parts = [
        Parts(None, None, cameras.of(k), poses[k], None, cameras.missing, k, partial(held.__getitem__, k), path)
        for k in range(len(held))
    ]
    sequence = FrameSequence(place, parts, options, note, path.name if first.pose is not None else "")
    if sequence.posed > 1:
        sequence.settle(may_scale=False, metric_poses=True)
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


def find_filed(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> Cameras:
    """Return the cameras in a folder; beside a caller's camera intrinsics.json may still state what the depth is."""
    if options.intrinsics is None and options.fov is None:
        return find_cameras(place, files, note, options.max_pixels)
    if not (place.path / "intrinsics.json").is_file():
        return Cameras(None)
    try:
        return Cameras(find_cameras(place, (), lambda _: None, options.max_pixels).shared)
    except ValueError:
        note(f"{place.path / 'intrinsics.json'} is no camera file, and is not used")
        return Cameras(None)


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


def _naming(parts: Parts, error: Exception) -> str:
    """Return the error's sentence, with the file if it does not name one."""
    return str(error) if Path(parts.name).name in str(error) else f"{parts.name}: {error}"
