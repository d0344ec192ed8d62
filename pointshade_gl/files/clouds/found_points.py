"""What a file says about the points of a cloud: columns of numbers as they are stored, nothing scaled or left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...scene.cloud import Up
from ..access.limits import check_limit

ColorBy = Literal["rgb", "intensity", "class", "height"]
COLOR_BY: tuple[ColorBy, ...] = get_args(ColorBy)
_COLUMNS = ("positions", "normals", "colors", "intensity", "classes", "sizes", "confidence", "seen_from")


@dataclass
class FoundPoints:
    """The points of a file. None = the file does not say.

    form        what the file is, for a report
    positions   (n, 3) numbers
    normals     (n, 3)
    colors      (n, 3) of any scale
    intensity   (n,) of any scale
    classes     (n,) whole numbers, as LAS counts them
    sizes       (n,) radii
    confidence  (n,)
    seen_from   (3,) or (n, 3) float64: where the scanner stood
    origin      what the caller's own program wrote as the origin of the positions, which still contain it
    up          which axis points up, how that is known, and whether there is doubt
    front       which axis points towards the viewer, as seen with that up
    """

    form: str
    positions: NDArray[Any]
    normals: NDArray[Any] | None = None
    colors: NDArray[Any] | None = None
    intensity: NDArray[Any] | None = None
    classes: NDArray[Any] | None = None
    sizes: NDArray[Any] | None = None
    confidence: NDArray[Any] | None = None
    seen_from: NDArray[np.float64] | None = None
    origin: NDArray[np.float64] | None = None
    up: Up | None = None
    up_from: str = ""
    up_is_guessed: bool = False
    front: Up | None = None

    def __len__(self) -> int:
        return len(self.positions)

    def select(self, rows: NDArray[Any]) -> None:
        """Keep these rows only: their numbers, or a mask."""
        count = len(self)
        for name in _COLUMNS:
            column = getattr(self, name)
            if column is not None and column.shape[0] == count and (name != "seen_from" or column.ndim == 2):
                setattr(self, name, column[rows])


def check_points(count: int, name: object, max_pixels: float) -> None:
    """Raises ValueError for more points than the limit: as many as a picture may have pixels."""
    check_limit(count, f"{name} has {count} points", max_pixels)


def side_by_side(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """(n, c) of columns (n,). Fields of one type that follow each other in rows are copied together: 6 times faster."""
    first, count = columns[0], len(columns[0])
    step, width = first.dtype.itemsize, first.dtype.itemsize * len(columns)
    starts = [one.__array_interface__["data"][0] for one in columns]
    follow = all(start == starts[0] + k * step for k, start in enumerate(starts))
    alike = all(one.dtype == first.dtype and one.strides == first.strides for one in columns)
    if not (count and follow and alike and first.strides[0] >= width):
        return np.stack(columns, -1)
    shape, strides = (count, len(columns)), (first.strides[0], step)
    rows = np.lib.stride_tricks.as_strided(first, shape, strides, writeable=False)
    return rows.view(f"V{width}").copy().view(first.dtype).reshape(shape)
