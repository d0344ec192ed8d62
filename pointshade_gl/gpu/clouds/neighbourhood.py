"""What a pass over points of a cloud reads: the points that are asked for, and all points sorted by cells."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..core.images import confine
from ..core.memory import Owner
from ..core.passes import FullscreenPass
from .cell_grid import CellGrid

WIDTH = 4096  # CLOUD_WIDTH of common/cloud_moments.glsl
ROWS = 256  # of a texture that are drawn at once: drivers end passes that take long


class Neighbourhood(Owner):
    """Textures of a cell grid and of the points that are asked for; each value one after the other, WIDTH in a row.

    queries  (n, 4) float32: the points that are asked for; None: all of the grid
    """

    def __init__(
        self,
        context: moderngl.Context,
        grid: CellGrid,
        points: NDArray[np.float32],
        queries: NDArray[np.float32] | None = None,
    ):
        super().__init__(context)
        with self._all_or_nothing():
            keys, cell_of = None, grid.cell_of
            if queries is not None:
                keys, cell_of = np.unique(grid.keys_of(queries), return_inverse=True)
            self.count = len(points if queries is None else queries)
            self.points = self.texture(points)
            self.queries = self.points if queries is None else self.texture(queries)
            self._cells = self.texture(cell_of.astype(np.int32)[:, None])
            self._ranges = self.texture(grid.ranges(keys).reshape(-1, 2))

    def texture(self, values: NDArray[Any]) -> moderngl.Texture:
        return value_texture(self, values)

    def run(self, work: FullscreenPass, radius: float, most: int, **inputs: Any) -> list[NDArray[np.float32]]:
        """Return what a pass writes for each point that is asked for: two (n, 4)."""
        own = Owner(self._context)
        try:
            size = self.queries.size
            made = [own._allocate(self._context.texture, size, 4, dtype="f4") for _ in range(2)]
            target = own._allocate(self._context.framebuffer, made, None)
            textures = {
                "query_map": self.queries, "cell_map": self._cells, "range_map": self._ranges, "point_map": self.points,
            }  # fmt: skip
            textures |= {name: inputs.pop(name) for name in list(inputs) if isinstance(inputs[name], moderngl.Texture)}
            for row in range(0, size[1], ROWS):
                confine(target, (0, row, WIDTH, min(ROWS, size[1] - row)))
                work.draw(target, dict(textures), count=self.count, radius=radius, most=most, **inputs)
            return [read_values(one, self.count) for one in made]
        finally:
            own.release()


def read_values(texture: moderngl.Texture, count: int) -> NDArray[np.float32]:
    """Return the first values (n, components) of a float32 texture."""
    values = np.frombuffer(texture.read(alignment=1), np.float32)
    return values.reshape(-1, texture.components)[:count].copy()


def value_texture(owner: Owner, values: NDArray[Any]) -> moderngl.Texture:
    """Return a texture of float32 or int32 values (n, 1 to 4), WIDTH in a row, that belongs to the owner."""
    count, components = values.shape
    rows, kind = max(-(-count // WIDTH), 1), "i4" if values.dtype == np.int32 else "f4"
    texture = owner._allocate(owner._context.texture, (WIDTH, rows), components, dtype=kind)
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    full = count // WIDTH
    if full:
        texture.write(np.ascontiguousarray(values[: full * WIDTH]), (0, 0, WIDTH, full))
    if count % WIDTH:
        texture.write(np.ascontiguousarray(values[full * WIDTH :]), (0, full, count % WIDTH, 1))
    return texture
