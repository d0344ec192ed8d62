"""Sorts points into cells, so that the neighbours of a point are nine ranges of a list."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

MOST = 1 << 20  # cells along an axis: what lies further out is in the cells at the border
MARGIN = 8  # empty cells between rows, so that none runs into the next
SAMPLE = 1 << 16  # points that the middle is taken from


class CellGrid:
    """Cells of one size, of which only those with points are kept.

    order   (n,) which point of the input each point is, sorted by cells: first x, then y, then z
    cells   (m,) the number of each occupied cell, ascending
    starts  (m + 1,) where its points begin
    """

    def __init__(self, positions: NDArray[np.float32], side: float):
        self.side = side
        self._low = np.median(positions[:: len(positions) // SAMPLE + 1], axis=0) if len(positions) else np.zeros(3)
        index = self._index_of(positions)
        self._first = index.min(1, initial=MOST) - MARGIN
        x, y, _ = (int(count) for count in index.max(1, initial=0) - self._first + 1)
        self._strides = 1, x, x * y
        keys = self._keys(index)
        self.order = sorted_order(keys)
        keys = keys[self.order]
        first = np.flatnonzero(np.append([True] * (len(keys) > 0), keys[1:] != keys[:-1]))
        self.cells = keys[first]
        self.starts = np.append(first, len(keys))

    @cached_property
    def cell_of(self) -> NDArray[np.int32]:
        """Return the place in `cells` of each point, in the order of the grid."""
        return np.repeat(np.arange(len(self.cells), dtype=np.int32), np.diff(self.starts))

    @cached_property
    def spans(self) -> NDArray[np.int32]:
        """Return (m, 9, 2): from where to where in `cells` the cells round each one lie, in its nine rows."""
        return self._spans(self.cells, 1)

    def keys_of(self, positions: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the cells that other points lie in."""
        return self._keys(self._index_of(positions))

    def ranges(self, keys: NDArray[np.int64] | None = None, reach: int = 1) -> NDArray[np.int32]:
        """Return (m, rows, 2): from where to where the points round cells lie, for each row of cells.

        keys   of the cells; None: those of the grid
        reach  how many cells away; 1: nine rows
        """
        return self.starts.astype(np.int32)[self.spans if keys is None else self._spans(keys, reach)]

    def _spans(self, keys: NDArray[np.int64], reach: int) -> NDArray[np.int32]:
        _, y, z = self._strides
        steps = range(-reach, reach + 1)
        offsets = [b * y + c * z for c in steps for b in steps]
        found = np.empty((len(keys), len(offsets), 2), np.int32)
        for k, offset in enumerate(offsets):
            found[:, k, 0] = np.searchsorted(self.cells, keys + (offset - reach))
            found[:, k, 1] = np.searchsorted(self.cells, keys + (offset + reach), "right")
        return found

    def _index_of(self, positions: NDArray[np.float32]) -> NDArray[np.int64]:
        index = np.empty((3, len(positions)), np.int64)
        for k in range(3):
            steps = (positions[:, k] - np.float32(self._low[k])) * np.float32(1 / self.side)
            np.clip(np.floor(steps, out=steps), -MOST // 2, MOST // 2 - 1, out=steps)
            index[k] = steps
        return index

    def _keys(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        _, y, z = self._strides
        x0, y0, z0 = self._first
        return (index[0] - x0) + (index[1] - y0) * y + (index[2] - z0) * z


def sorted_order(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the order that sorts keys from 0 on; equal ones stay in theirs. Numbers sort faster than their places."""
    bits = max(len(keys) - 1, 0).bit_length()
    if not len(keys) or int(keys.max()) >> (63 - bits):
        return np.argsort(keys, kind="stable")
    packed = (keys << bits) | np.arange(len(keys))
    packed.sort()
    return packed & ((1 << bits) - 1)
