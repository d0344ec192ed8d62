"""Organised point clouds: PCD files whose points lie in the rows and columns of a depth camera's picture."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ..access.content import FilePath, open_regular
from ..access.limits import MAX_PIXELS
from ..arrays.pcd import PCD_HEADER, Pcd, read_pcd, read_pcd_header
from .contents import Frames
from .networks import open_arrays
from .pinhole import MOST_OFF, fit_pinhole

_AXES = ("x", "y", "z")
_COLORS = ("rgb", "rgba")  # four bytes: blue, green, red, and one more


class _Held:
    """An array in memory, as one in a file."""

    def __init__(self, array: NDArray[Any]):
        self._array, self.shape, self.dtype = array, array.shape, array.dtype

    def part(self, index: tuple[int, ...]) -> NDArray[Any]:
        return self._array[index]


def open_pcd(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS) -> Frames:
    """The frame of an organised PCD file. Raises ValueError for any other."""
    pcd = read_pcd(path, max_pixels)
    points = _points(pcd)
    if points is None or not _is_seen(points):
        raise ValueError(f"{path} is a point cloud, no depth: `pointshade render` draws it, load_cloud reads it")
    arrays = {"points": _Held(points)}
    color = next((pcd.columns[name] for name in _COLORS if name in pcd.columns), None)
    if color is not None and color.dtype.itemsize == 4:
        blue_first = np.ascontiguousarray(color).view(np.uint8).reshape(*points.shape[:2], 4)
        arrays["color"] = _Held(np.ascontiguousarray(blue_first[..., 2::-1]))
    return open_arrays(str(path), dict(arrays), note, max_pixels)


def is_organised(path: FilePath, max_pixels: float = MAX_PIXELS) -> bool:
    """Whether a PCD file's points are a picture that a pinhole camera sees. Raises OSError, or ValueError if broken."""
    with open_regular(path) as file:
        header = read_pcd_header(file.read(PCD_HEADER))
        status = os.fstat(file.fileno())
    is_picture = min(header.width, header.height) > 1
    return is_picture and _fits(str(path), status.st_mtime_ns, status.st_size, max_pixels)


@lru_cache(64)
def _fits(path: str, changed: int, size: int, max_pixels: float) -> bool:
    points = _points(read_pcd(path, max_pixels))
    return points is not None and _is_seen(points)


def _points(pcd: Pcd) -> NDArray[Any] | None:
    """(h, w, 3), None for points that lie in no picture."""
    width, height, columns = pcd.header.width, pcd.header.height, pcd.columns
    if min(width, height) < 2 or any(name not in columns or columns[name].ndim > 1 for name in _AXES):
        return None
    return np.stack([columns[name] for name in _AXES], -1).reshape(height, width, 3)


@np.errstate(all="ignore")  # what is missing may be infinite, or anything else
def _is_seen(points: NDArray[Any]) -> bool:
    return points.dtype.kind == "f" and fit_pinhole(points)[1] < MOST_OFF
