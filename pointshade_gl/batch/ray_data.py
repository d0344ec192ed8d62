"""A stage of Ray Data: rows with a frame or its path get its picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import as_given, check_numbers, check_type
from ..checks.foreign_arrays import way_to
from ..notes.notes import print_note
from ..scene.appearance import Look
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.viewpoint import View
from .map import Drawing, check_view, draw
from .on_ray import device_here


class Stage:
    """A stage of `map_batches` of a Ray Dataset: each row gets its "picture", (h, w, 4) uint8, as `render` draws it.

    A row has a "path", of a frame's folder or file; or "depth", (h, w) floats in metres, and beside it, if there are,
    "color", (h, w, 3|4) uint8, "intrinsics", (fx, fy, cx, cy), and "pose", (4, 4) camera-to-world.

    It keeps no renderer, so it may be called from any thread: each thread has its own, on the GPU that Ray has handed
    to the process.

    Parameters
    ----------
    look : Look, optional
        As for `batch.map`.
    view : View, optional
        As for `batch.map`.
    camera : Camera, optional
        Of rows without intrinsics.

    Raises
    ------
    ValueError
        Where it is called with a row that cannot be drawn.
    """

    def __init__(self, look: Look | None = None, view: View | None = None, camera: Camera | None = None):
        self._view = check_view(look, view)
        self._camera = None if camera is None else check_type(camera, Camera, "camera")

    def __call__(self, batch: dict[str, Any]) -> dict[str, Any]:
        device = device_here()
        rows = [dict(zip(batch, values, strict=True)) for values in zip(*batch.values(), strict=True)]
        return {**batch, "picture": _column([self._picture(k, row, device) for k, row in enumerate(rows)])}

    def _picture(self, number: int, row: dict[str, Any], device: int) -> NDArray[np.uint8]:
        try:
            drawn = draw(Drawing(self._source(row), self._view), device)
        except (ValueError, TypeError, OSError) as error:
            raise ValueError(f"row {number} of a batch: {error}") from error
        for sentence in drawn.notes:
            print_note(sentence)
        return drawn.picture

    def _source(self, row: dict[str, Any]) -> Frame | str:
        if "path" in row:
            return str(row["path"])
        if "depth" not in row:
            raise ValueError(f"it has {', '.join(row)}: expected path or depth")
        depth = as_given(row["depth"], "depth must have shape (h, w)")
        if depth.ndim != 2:
            raise ValueError(f"depth must have shape (h, w), got {depth.shape}{way_to(depth.shape, 'depth', depth)}")
        camera = self._camera
        if "intrinsics" in row:
            complaint = "intrinsics must be four numbers (fx, fy, cx, cy)"
            fx, fy, cx, cy = check_numbers(row["intrinsics"], 4, complaint)
            camera = Camera(fx, fy, cx, cy, depth.shape[1], depth.shape[0])
        if camera is None:
            raise ValueError("it has no intrinsics: add a column (fx, fy, cx, cy), or pass camera to the stage")
        return Frame(row.get("color"), depth, camera, row.get("pose"))


def _column(pictures: list[NDArray[np.uint8]]) -> NDArray[Any]:
    """One array; of pictures of several sizes, an array of arrays."""
    if len({picture.shape for picture in pictures}) == 1:
        return np.stack(pictures)
    column = np.empty(len(pictures), object)
    column[:] = pictures
    return column
