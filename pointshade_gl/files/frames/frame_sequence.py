"""A sequence of frames, each read when it is asked for."""

from __future__ import annotations

import weakref
from collections.abc import Hashable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, overload

from ...notes.errors import Bug, error_text, is_expected
from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera
from ...scene.frame import Frame
from ..access.content import note_read
from ..access.file_name_patterns import VIDEO_SUFFIXES
from ..access.folder_listing import Listing
from ..access.safe_paths import Folder
from ..depth.depth_kinds import Coding, Decoded
from ..poses.pose_convention import FAILS, Reading, find_reading
from .assembly import assemble
from .film_scale import FilmScale, Laid
from .frame_parts import Assembled, Parts, ReadOptions

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
        film: tuple[FilmScale, Sequence[int], Sequence[Parts]] | None = None,
    ):
        self.folder, self.parts, self.note, self.poses_from, self.reading = place.path, parts, note, poses_from, reading
        self.posed = sum(one.pose is not None for one in parts)  # how many frames have a pose
        self._place, self._options = replace(place, listing=Listing()), options  # what was listed is not kept
        self._stream = stream or (object() if len(parts) > 1 else None)  # what its frames have in common
        if parts and isinstance(parts[0].color, Path) and parts[0].color.suffix.lower() in VIDEO_SUFFIXES:
            weakref.finalize(self, _end_video)
        self._coding = coding  # of the depth of the first frame that was read: the others are read like it
        note_read(file for one in parts for file in (one.path, one.color, one.valid))
        self._film = film if film or len(parts) < 2 or options.scale_frames == "keep" else self._as_film()

    @property
    def is_placed(self) -> bool:
        """It is known where frames are: by poses of their own, or by one that was given for all."""
        return self.posed > 0 or self._options.pose is not None

    def __len__(self) -> int:
        return len(self.parts)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FrameSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FrameSequence:
        if isinstance(index, slice):
            known = self._options, self.note, self.poses_from, self.reading, self._coding, self._stream
            film = self._film and (self._film[0], self._film[1][index], self._film[2])
            return FrameSequence(self._place, self.parts[index], *known, film)
        return self.assembled(index).frame

    def assembled(self, index: int, note: Note | None = None, with_color: bool = True) -> Assembled:
        """Return a frame, and how its files were understood: all as the first that was read. Raises as [k] does."""
        parts = self.parts[index]
        try:
            for path in (parts.path, parts.color, parts.valid):
                if isinstance(path, Path):
                    self._place.check(path)
            parts = parts if with_color else parts._replace(color=None)
            if self._film is None or self._film[0].is_over or not with_color:
                read = self._put_together(parts, note or self.note)
            else:
                with self._film[0].lock:
                    read = self._put_together(parts, note or self.note, partial(self._scale_of, index))
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

    def _put_together(self, parts: Parts, note: Note, scale_of: Any = None) -> Assembled:
        return assemble(parts, self._options, note, self.reading, self._coding, self._stream, scale_of)

    def _as_film(self) -> tuple[FilmScale, Sequence[int], Sequence[Parts]]:
        """Return what finds one scale for all frames, and which of its pictures each is."""
        is_networks = bool(self.parts[0].maker)
        return FilmScale(not self.posed or is_networks, is_networks, self.note), range(len(self)), self.parts

    def _scale_of(self, index: int, decoded: Decoded, colors: Any, camera: Camera) -> Laid:
        """Return how a frame is laid, after those before it in the film."""
        assert self._film is not None
        film, numbers, parts = self._film

        def read(number: int) -> None:
            scale_of = partial(self._scale_in_film, number)
            self._put_together(parts[number], self.note, scale_of)

        return film.of(numbers[index], decoded, colors, camera, read)

    def _scale_in_film(self, number: int, decoded: Decoded, colors: Any, camera: Camera) -> Laid:
        assert self._film is not None
        return self._film[0].of(number, decoded, colors, camera, lambda _: None)

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


def _naming(parts: Parts, error: Exception) -> str:
    """Return the error's sentence, with the file if it does not name one."""
    return str(error) if Path(parts.name).name in str(error) else f"{parts.name}: {error}"
