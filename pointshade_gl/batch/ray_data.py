"""A stage of Ray Data: rows with a frame or its path get its picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..frame import Frame
from ..look import Look
from ..view import View
from .map import Drawing, draw, view_of
from .on_ray import device_here

COLUMNS = ("path", "depth", "color", "intrinsics", "pose")


class Stage:
    """For `Dataset.map_batches`: adds to each row of a batch a column "picture", (h, w, 4) uint8: what `render` draws.

    A row has either "path", the folder or the file of a frame; or "depth", (h, w) metres, and if there are, "color",
    (h, w, 3|4) uint8, "intrinsics", (fx, fy, cx, cy), and "pose", (4, 4) camera-to-world.

    camera  of the rows without "intrinsics"
    look, view  as for `pointshade_gl.batch.map`

    It holds no renderer: each thread that calls it keeps one, on the GPU that Ray has handed to its process.

    Calling it raises ValueError, TypeError or OSError for a frame that cannot be drawn; the sentence names the row's
    path, or its number in the batch.
    """

    def __init__(self, look: Look | None = None, view: View | None = None, camera: Camera | None = None):
        self._view, self._camera = view_of(look, view), camera

    def __call__(self, batch: dict[str, NDArray[Any]]) -> dict[str, Any]:
        device = device_here()
        count = len(next(iter(batch.values()), ()))
        rows = [{name: batch[name][k] for name in COLUMNS if name in batch} for k in range(count)]
        return {**batch, "picture": _column([draw(Drawing(self._source(row), self._view), device)[0] for row in rows])}

    def _source(self, row: dict[str, Any]) -> Frame | str:
        if "path" in row:
            return str(row["path"])
        camera = self._camera
        ...
