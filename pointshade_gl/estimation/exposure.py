"""Finds the exposure at which a lit picture is as bright as the photograph that its colours come from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.values import linear_to_srgb

Array = NDArray[np.float32]
MOST = 12.0  # stops: lamps in watts are that far from 1
HALVINGS = 13  # of the range: to 0.003 stops


def stops_to_match(lit: Array, photograph: Array) -> float:
    """Return the stops, to two digits, by which light is multiplied so that the medians of both are as bright.

    lit, photograph  (h, w, 4) linear light of the same surfaces, not cut off at 1, and 1; 0 where there is none.
                     Those that no light reaches do not count.
    """
    reached = (lit[..., :3].max(-1) > 0) & (photograph[..., 3] > 0)
    light, own = (np.ascontiguousarray(one[reached, :3].T) for one in (lit, photograph))
    if not reached.any() or not (wanted := brightness(own)) > 0:
        return 0.0
    low, high = -MOST, MOST
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if brightness(light * np.float32(2**middle)) < wanted:
            low = middle
        else:
            high = middle
    return round((low + high) / 2, 2)


def brightness(light: Array) -> float:
    """Return the median of the means of the channels, sRGB from 0 to 1, of linear light (3, n)."""
    return float(np.median(linear_to_srgb(np.minimum(light, np.float32(1))).mean(0)))
