"""What depth cameras with two eyes lose: what the other eye does not see behind near objects."""

from __future__ import annotations

import numpy as np


def shadow(depth: np.ndarray, shift: float) -> np.ndarray:
    """(h, w) bool: the pixels that an eye to the right does not see behind what lies right of them.

    shift  focal length times baseline: pixels times metres
    """
    seen_at = np.arange(depth.shape[1]) - shift / np.where(depth > 0, depth, np.inf)
    leftmost = np.full(depth.shape, np.inf)  # of all that lie right of a pixel
    leftmost[:, :-1] = np.minimum.accumulate(np.where(depth > 0, seen_at, np.inf)[:, :0:-1], 1)[:, ::-1]
    return (depth > 0) & (seen_at > leftmost - 0.5)  # a point is a pixel wide
