"""The frames of a folder as a sequence, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import overload

import numpy as np

from ..frame import Frame
from ..notes import Note
from ..wording import option
from .agreement import FAILS, Reading, find_reading
from .assembly import Assembled, Parts, ReadOptions, assemble
from .cameras import Cameras, find_cameras
from .folders import FrameFiles, find_frames
from .known import DEPTH_SUFFIXES
from .names import Folder
from .poses import FoundPoses, find_poses

_APART = 0.1  # metres, or what a turn of 6 degrees changes: views that are compared are so far apart
_COMPARED = 3


class FolderSequence(Sequence[Frame]):
    """The frames of a folder, each read when it is asked for; slices are sequences too.

    [k] raises ValueError or OSError, in one sentence, for a frame that cannot be read.
    """

    def __init__(
        self,
        place: Folder,
        files: Sequence[FrameFiles],
        cameras: Cameras,
        poses: FoundPoses,
        options: ReadOptions,
        note: Note,
        reading: Reading | None = None,
    ):
        self.folder, self.files, self.reading, self.poses_from = place.path, files, reading, poses.source
        self._place, self._cameras, self._poses, self._options, self._note = place, cameras, poses.poses, options, note

    def __len__(self) -> int:
        return len(self.files)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FolderSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FolderSequence:
        if isinstance(index, slice):
            poses = FoundPoses(self._poses[index], self.poses_from)
            return FolderSequence(
                self._place, self.files[index], self._cameras, poses, self._options, self._note, self.reading
            )
        return self.assembled(index).frame

    def assembled(self, index: int, note: Note | None = None, with_color: bool = True) -> Assembled:
        """A frame, and how its files were understood. Raises as [k] does."""
        one = self.files[index]
        try:
            for path in (one.depth, one.color, one.valid):
                if path:
                    self._place.check(path)
            parts = Parts(
                one.depth,
                one.color if with_color else None,
                self._cameras.of(one.number),
                self._poses[index],
                one.valid,
                self._cameras.missing,
                one.number,
            )
            read = assemble(parts, self._options, note or self._note, self.reading)
        except (ValueError, TypeError) as error:
            if len(self.files) == 1:
                raise
            raise ValueError(f"frame {index}: {_naming(one.depth, error)}") from None
        except OSError as error:
            raise OSError(f"frame {index}: {_naming(one.depth, error)}") from None

        posed = sum(pose is not None for pose in self._poses)
        found = read.found._replace(frames=len(self), shown=index, poses=posed, poses_from=self.poses_from)
        return read._replace(found=found)

    @property
    def has_poses(self) -> bool:
        return any(pose is not None for pose in self._poses)

    def settle(self, may_scale: bool) -> None:
        """Finds out how poses and camera are to be understood, from frames that see the same. Tells what it changes."""
        apart = self._apart()
        try:
            frames = [self.assembled(index, lambda _: None, with_color=False).frame for index in apart]
        except (ValueError, OSError):
            return  # told when they are asked for
        found = find_reading(frames, may_scale)
        if found is None:
            return
        if found.reading != Reading():
            self.reading = found.reading
            self._note(
                f"{self.folder}: the views lie over each other only if {found.reading}, so they are read like that "
                f"(their depths differ by {found.error:.1%} instead of {found.error_as_written:.0%})"
            )
        elif found.error > FAILS:
            self._note(
                f"{self.folder}: by their poses the views do not lie over each other (their depths differ by "
                f"{found.error:.0%}): are {option('depth_scale')}, camera and poses right?"
            )

    def _apart(self) -> list[int]:
        """The first frame, and the next ones that were taken from elsewhere."""
        found: list[int] = []
        for index, pose in enumerate(self._poses[:5000]):
            if pose is None or not np.isfinite(pose).all():
                continue
            last = self._poses[found[-1]] if found else None
            if last is None or abs(pose - last).max() > _APART:
                found.append(index)
            if len(found) == _COMPARED:
                break
        return found


def open_folder(place: Folder, options: ReadOptions, note: Note) -> FolderSequence:
    """The frames of a folder, one or many. Raises OSError if it has none, ValueError for files that hold nonsense."""
    limit = options.max_pixels
    files = find_frames(place, note, limit)
    if not files:
        raise FileNotFoundError(
            f"{place.path} has no depth picture: expected depth.png (or {', '.join(DEPTH_SUFFIXES[:6])}...) "
            f"or a folder depth/ in it, or pass {option('depth', 'FILE')}"
        )
    cameras = find_filed(place, files, options, note)
    poses = FoundPoses([None] * len(files))
    if options.pose is None and len(files) > 1:
        poses = find_poses(place.path, files, note, limit)
    sequence = FolderSequence(place, files, cameras, poses, options, note)
    if sequence.has_poses:
        known = cameras.of(0)
        sequence.settle(may_scale=options.depth_scale is None and (known is None or known.depth_scale is None))
    return sequence


def find_filed(place: Folder, files: Sequence[FrameFiles], options: ReadOptions, note: Note) -> Cameras:
    """The cameras that lie in a folder. If the caller gives one, intrinsics.json may still say what the depth is."""
    if options.intrinsics is None and options.fov is None:
        return find_cameras(place, files, note, options.max_pixels)
    if not (place.path / "intrinsics.json").is_file():
        return Cameras(None)
    cameras = find_cameras(place, (), lambda _: None, options.max_pixels)
    filed = cameras.shared
    if filed and options.fov is not None:
        filed = replace(filed, alternatives=())
    return Cameras(filed)


def first_readable(sequence: FolderSequence) -> tuple[int, Assembled]:
    """One frame, and its index, that shows that camera and options are right. Raises the first frame's error else."""
    for index in (0, len(sequence) // 2, len(sequence) - 1):
        try:
            return index, sequence.assembled(index)
        except (ValueError, OSError):
            continue
    return 0, sequence.assembled(0)


def _naming(depth: Path, error: Exception) -> str:
    """The error's sentence, with the file if it does not name one."""
    return str(error) if depth.name in str(error) else f"{depth}: {error}"
