"""Points of float32 without a header: x y z intensity (KITTI), with the ring (nuScenes), or x y z red green blue."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ..access.content import FilePath, read_bytes
from .found_points import FoundPoints, check_points

_COLUMNS = 4, 5, 6
_OTHERS = 3, 7  # columns of other files
_FARTHEST = 1000.0  # metres
_BRIGHTEST = 255.0
_LOOKED_AT = 4096  # points
_FEWEST = 4
HEAD = _LOOKED_AT * 6 * 4  # bytes that show what it is


def read_lidar_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of a scan. Raises ValueError for other numbers."""
    data = read_bytes(path, max_pixels)
    columns = lidar_columns(data[:HEAD], len(data))
    if columns is None:
        raise ValueError(
            f"{path} is no scan of a lidar: expected float32 x, y, z and intensity, as in KITTI; other numbers "
            "without a header can be saved as .npy"
        )
    table = np.frombuffer(data, "<f4").reshape(-1, columns)
    check_points(len(table), path, max_pixels)
    found = FoundPoints(f"float32, {columns} columns", table[:, :3], up="z", up_from="usual of lidars")
    if columns == 6:
        found.colors = table[:, 3:]
    else:
        found.intensity = table[:, 3]
    return found


def lidar_columns(head: bytes, size: int) -> int | None:
    """How many numbers a point has, from the beginning of a file of that size; None if it is no scan.

    Numbers beside the coordinates are 0 to 1, or 0 to 255.
    """
    numbers = np.frombuffer(head[: len(head) // 4 * 4], "<f4")
    if size % 4 or not np.isfinite(numbers).all() or not numbers.size or np.abs(numbers).max() > _FARTHEST:
        return None
    fitting = [one for one in _COLUMNS if size % (4 * one) == 0 and numbers.size >= _FEWEST * one]
    best = max((*fitting, *_OTHERS), key=lambda one: _apart(numbers, one))
    return best if best in fitting and _is_scan(_table(numbers, best)) else None


def _table(numbers: NDArray[np.float32], columns: int) -> NDArray[np.float32]:
    return numbers[: len(numbers) // columns * columns].reshape(-1, columns)


def _apart(numbers: NDArray[np.float32], columns: int) -> float:
    """How much the columns differ from each other, which they do most if there are so many."""
    if len(numbers) < columns:
        return 0.0
    table = _table(numbers, columns).astype(np.float64)
    return float(table.mean(0).var() + np.abs(table).mean(0).var())


def _is_scan(table: NDArray[np.float32]) -> bool:
    at, more = table[:, :3], table[:, 3:]
    is_whole = table.shape[1] != 5 or (more[:, 1] % 1 == 0).all()  # a ring's number
    sides = np.ptp(at, 0)
    return bool(is_whole and more.min() >= 0 and more.max() <= _BRIGHTEST and sides[:2].min() > 0)
