"""The points of PCD files."""

from __future__ import annotations

import numpy as np

from ...notes.notes import Note
from ..access.content import FilePath, naming
from ..arrays.pcd import read_pcd
from .field_names import found_in
from .found_points import FoundPoints
from .up_axis import is_before_camera

_NOWHERE = [0, 0, 0, 1, 0, 0, 0]  # the viewpoint of a file that says nothing


def read_pcd_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of a PCD file, row after row. Raises ValueError for one that is broken, or has no x, y and z."""
    pcd = read_pcd(path, max_pixels)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        found = found_in(pcd.columns, f"PCD, {pcd.header.coding}")
    view = pcd.header.viewpoint
    if len(view) == 7 and view != _NOWHERE and np.isfinite(view).all():
        found.seen_from = np.array(view[:3])
    found.up, found.up_from, found.up_is_guessed = "z", "usual in PCD files", True
    if is_before_camera(found.positions):
        found.up, found.up_from = "-y", "all of it lies in front of a camera at 0, 0, 0"
        found.seen_from = np.zeros(3) if found.seen_from is None else found.seen_from
    return found
