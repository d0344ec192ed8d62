"""What the columns of a table of points are, where nothing names them: their number and their values tell."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from .found_points import FoundPoints

COUNTS = (3, 4, 6, 7, 9)  # x y z, then an intensity, a colour, a normal, or two of them
_LOOKED_AT = 1000  # rows
_UNIT = 0.9  # of the normals have length 1


def found_by_number(table: NDArray[Any], form: str, name: str, note: Note) -> FoundPoints:
    """The points of a table (n, c). Raises ValueError for fewer than 3 columns."""
    count = table.shape[1]
    if count < 3:
        raise ValueError(f"it has {count} column{'s' if count > 1 else ''}, expected x, y, z and what belongs to them")
    found = FoundPoints(form, table[:, :3])
    some = table[:: -(-len(table) // _LOOKED_AT)] if len(table) else table
    match count:
        case 4:
            found.intensity = table[:, 3]
        case 6 if _are_normals(some[:, 3:]):
            found.normals = table[:, 3:]
        case 6:
            found.colors = table[:, 3:]
        case 7 if _are_colors(some[:, 3:6]) and not _are_colors(some[:, 4:]):
            found.colors, found.intensity = table[:, 3:6], table[:, 6]
        case 7:
            found.intensity, found.colors = table[:, 3], table[:, 4:]
        case 9 if _are_normals(some[:, 3:6]):
            found.normals, found.colors = table[:, 3:6], table[:, 6:]
        case 9:
            found.colors, found.normals = table[:, 3:6], table[:, 6:]
        case 3:
            pass
        case _:
            note(f"{name}: the first three of its {count} columns are read: nothing says what the others are")
    return found


def _are_normals(values: NDArray[Any]) -> bool:
    if values.dtype.kind != "f" or not len(values):
        return False
    return bool((np.abs(np.linalg.norm(values.astype(np.float64), axis=1) - 1) < 0.02).mean() > _UNIT)


def _are_colors(values: NDArray[Any]) -> bool:
    return bool(((values >= 0) & (values <= 255) & (values % 1 == 0)).all())
