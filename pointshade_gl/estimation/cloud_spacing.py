"""The spacing of a point cloud: how far apart the points of its surface are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAMPLE = 1 << 14  # points
ASKED = 256  # of these, whose nearest neighbours are looked for
NEAREST = 16


def estimate_spacing(positions: NDArray[np.float32]) -> float:
    """Return sqrt(area / n) of the surface that the points sample, by a part of them; 0 if all lie in one place.

    Of the part each place counts once: points that lie twice in a cloud make it no denser.
    """
    rng = np.random.default_rng(0)
    count = len(positions)
    some = positions if count <= SAMPLE else positions[rng.integers(0, count, SAMPLE)]
    some = np.unique(some.astype(np.float64), axis=0)
    if len(some) < 2:
        return 0.0
    asked = some[rng.choice(len(some), min(ASKED, len(some)), replace=False)]
    nearest = min(NEAREST, len(some) - 1)
    squares = sum((asked[:, k, None] - some[:, k]) ** 2 for k in range(3))
    reach = np.sqrt(np.median(np.partition(squares, nearest, axis=1)[:, nearest]))
    return float(reach * np.sqrt(np.pi / nearest * min(len(some) / count, 1)))
