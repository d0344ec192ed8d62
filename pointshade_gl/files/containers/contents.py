"""What a container file, one that brings depth together with colour, camera, pose or mask, holds for one frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ..cameras.intrinsics import Intrinsics

SURE = 0.1  # of the median confidence: what has less is not used


@dataclass(frozen=True, eq=False)
class Contents:
    """One frame out of a container: its own values, nothing scaled. None = the file does not say.

    depth        (h, w) raw numbers
    color        (h', w', 3|4)
    intrinsics   in this package's pixels (centres at integers); `size` is the picture they belong to
    pose         (4, 4) camera-to-world, OpenCV axes, unchecked
    valid        (h, w), False where the file's mask or confidence says that the depth is not to be used
    normals      (h, w, 3) unit, OpenCV camera axes, towards the camera, NaN where missing
    depth_kind   one of `depth_kinds.KINDS`, also where the camera is unknown; the intrinsics repeat it
    depth_scale  raw values per metre, likewise
    """

    depth: NDArray[Any]
    color: NDArray[np.uint8] | None = None
    intrinsics: Intrinsics | None = None
    pose: NDArray[np.float64] | None = None
    valid: NDArray[np.bool_] | None = None
    normals: NDArray[np.float32] | None = None
    depth_kind: str | None = None
    depth_scale: float | None = None


class Frames(Sequence[Contents]):
    """Frames that are read when they are asked for, from any thread."""

    def __init__(self, count: int, read: Callable[[int], Contents]):
        self._count, self._read = count, read

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> Contents: ...
    @overload
    def __getitem__(self, index: slice) -> list[Contents]: ...
    def __getitem__(self, index: int | slice) -> Contents | list[Contents]:
        """Raises IndexError beyond the end, ValueError for a frame that cannot be read."""
        chosen = range(self._count)[index]
        return self._read(chosen) if isinstance(chosen, int) else [self._read(k) for k in chosen]
