"""Finds out how much finer the pixels of a depth picture are than its edges, and brings it back to their size.

Networks see photographs at about 500 pixels, and most programs enlarge what they give to the photograph's size. Then
every edge is a ramp, and a ramp is no surface. At the size at which depth was made, colours say where its edges run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_LINES = 256  # rows, and columns, that are looked at
_EDGE = 0.1  # of the range of 1/z: by so much it changes at an edge, at least
_END = 0.1  # of the steepest change at an edge: where it ends
_WIDEST = 1 / 32  # of a line: what is wider is a slanted surface
_FEWEST = 50  # edges
_SHARPEST = 10  # percent of the edges: these are as wide as the depth was enlarged, others are surfaces that bend away
# Widths in pixels. Of seven pictures, reduced to 518, 384 and 259 rows in four ways, the sharpest are 1 to 1.33 wide;
# enlarged 2 times, bilinear or cubic, 1.7 to 2.7; 6 times 4.6 to 9.
_OWN = 1.4
_USUAL = 1.25
_SMALLEST = 192  # pixels along the shorter side of what networks make, at least


def times_enlarged(depth: NDArray[np.floating]) -> int:
    """Return how many pixels along a side are one of the depth as it was made, from 1 on.

    depth  (h, w) z; 0 is missing
    """
    most = min(depth.shape) // _SMALLEST
    if most < 2:
        return 1
    rows, columns = _inverse_of_lines(depth), _inverse_of_lines(depth.T)
    known = rows[np.isfinite(rows)]
    if not known.size:
        return 1
    low, high = np.percentile(known, (2, 98))
    widths = np.concatenate([_edge_widths(lines, _EDGE * (high - low)) for lines in (rows, columns)])
    if widths.size < _FEWEST:
        return 1
    width = float(np.percentile(widths, _SHARPEST))
    return 1 if width < _OWN else min(max(2, round(width / _USUAL)), most)


def reduced(depth: NDArray[np.float32], times: int) -> NDArray[np.float32]:
    """Return depth (h, w) z, 0 is missing, with so many times fewer pixels along each side: means of 1/z."""
    from PIL import Image

    height, width = depth.shape
    size = max(1, round(width / times)), max(1, round(height / times))
    known = depth > 0
    inverse = np.divide(1, depth, out=np.zeros_like(depth), where=known)
    sums, shares = (
        np.asarray(Image.fromarray(part).resize(size, Image.Resampling.BOX))
        for part in (inverse, known.astype(np.float32))
    )
    return np.divide(shares, sums, out=np.zeros_like(sums), where=(shares >= 0.5) & (sums > 0))


def _inverse_of_lines(depth: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return 1/z in some of the rows; NaN is missing."""
    step = max(1, len(depth) // _LINES)
    lines = depth[step // 2 :: step]
    return np.divide(1, lines, out=np.full(lines.shape, np.nan, lines.dtype), where=lines > 0)


def _edge_widths(lines: NDArray[np.floating], least: float) -> NDArray[np.floating]:
    """Return how many pixels wide the edges along lines are: the whole change of 1/z over the steepest of a pixel.

    least  by how much 1/z changes at an edge
    """
    changes = np.diff(lines, axis=1)  # NaN beside what is missing
    reach = max(3, int(lines.shape[1] * _WIDEST))
    if changes.shape[1] <= 2 * reach + 2:
        return np.zeros(0)
    sizes = np.abs(changes)
    with np.errstate(invalid="ignore"):
        is_steepest = (sizes[:, 1:-1] >= sizes[:, :-2]) & (sizes[:, 1:-1] > sizes[:, 2:])
        is_steepest &= sizes[:, 1:-1] * reach > least
    row, column = np.nonzero(is_steepest[:, reach : -reach - 1])
    column += reach + 1
    steepest = changes[row, column]
    width, pixels = np.ones(len(row)), np.ones(len(row))
    for side in (-1, 1):
        goes_on = np.ones(len(row), bool)
        for k in range(1, reach + 1):
            share = changes[row, column + side * k] / steepest
            goes_on &= share > _END  # not where it is NaN
            width += np.where(goes_on, share, 0)
            pixels += goes_on
    return width[(pixels <= reach) & (np.abs(steepest) * width > least)]
