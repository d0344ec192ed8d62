"""The frames of a folder as a sequence, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, overload

from ..frame import Frame
from .folders import Pair
from .frames import load_frame
from .poses import Poses


class FolderSequence(Sequence[Frame]):
    """The frames of a folder, each read when it is asked for; slices are sequences too.

    [k] raises ValueError or OSError, in one sentence, for a frame that cannot be read.
    """

    def __init__(self, folder: Path, pairs: Sequence[Pair], poses: Poses, options: dict[str, Any]):
        self.folder = folder
        self._pairs, self._poses, self._options = pairs, poses, options

    def __len__(self) -> int:
        return len(self._pairs)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FolderSequence: ...
    def __getitem__(self, index: int | slice) -> Frame | FolderSequence:
        if isinstance(index, slice):
            return FolderSequence(self.folder, self._pairs[index], self._poses[index], self._options)
        depth, color, _ = self._pairs[index]
        pose = self._poses[index]
        try:
            return load_frame(self.folder, **{"depth": depth, "color": color, "pose": pose} | self._options)
        except (ValueError, TypeError) as error:
            raise ValueError(f"frame {index}: {_naming(depth, error)}") from None
        except OSError as error:
            raise OSError(f"frame {index}: {_naming(depth, error)}") from None


def first_readable(sequence: FolderSequence) -> Frame:
    """One frame that shows that camera and options are right. Raises the first frame's error if there is none."""
    for index in (0, len(sequence) // 2, len(sequence) - 1):
        try:
            return sequence[index]
        except (ValueError, OSError):
            continue
    return sequence[0]


def _naming(depth: Path, error: Exception) -> str:
    """The error's sentence, with the file if it does not name one."""
    return str(error) if depth.name in str(error) else f"{depth}: {error}"
