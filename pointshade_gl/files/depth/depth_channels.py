"""Decodes depth whose bytes are spread over colour channels: 16 bits in two, 24 in three, a float in four.

HO-3D (Hampali 2020) and NOCS (Wang 2019) have 16 bits, CARLA 24 of 1000 m (Dosovitskiy 2017), TartanAir V2 floats.
Only the right order of bytes is smooth: where the higher byte goes one up, the lower one starts again.
"""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ROWS = 120  # looked at
_FEWEST = 30  # places where the higher byte changes by one
_CARRIED = 0.3  # of these the two together change by less than _STEP; in photographs hardly any
_STEP = 128
_BETTER = 2.0  # times as often as in the other order
CARLA = (2**24 - 1) / 1000  # values a metre


def find_channels(image: NDArray[np.uint8]) -> tuple[int, ...] | None:
    """The channels of (h, w, 3|4) that hold the bytes of one number, the lowest first; None for any other picture."""
    some = image[:: max(1, image.shape[0] // _ROWS)].astype(np.int32)
    varied = [k for k in range(image.shape[2]) if np.ptp(some[..., k])]
    if image.shape[2] == 4 and (found := _float_order(image)):
        return found
    if len(varied) not in (2, 3):
        return None
    orders = tuple(permutations(varied)) if len(varied) == 2 else ((0, 1, 2), (2, 1, 0))
    (other, _), (share, order) = sorted((_carried(some[..., one[-2]], some[..., one[-1]]), one) for one in orders)
    return order if share > _CARRIED and share > _BETTER * other else None


def _carried(low: NDArray[np.int32], high: NDArray[np.int32]) -> float:
    """Return how often the lower byte starts again where the higher one changes by one between neighbours."""
    up, whole = np.diff(high, axis=1), np.diff(low + 256 * high, axis=1)
    one = np.abs(up) == 1
    return float(np.mean(np.abs(whole[one]) < _STEP)) if np.count_nonzero(one) >= _FEWEST else 0.0


def _float_order(image: NDArray[np.uint8]) -> tuple[int, ...] | None:
    """The order that makes floats from 1 cm to 10 km of four bytes: blue first, as OpenCV has it, or as they are."""
    for order in ((2, 1, 0, 3), (0, 1, 2, 3)):
        values = join_channels(image, order)
        known = values[(values != 0) & np.isfinite(values)]
        if known.size and np.mean((known > 0.01) & (known < 10_000)) > 0.9:
            return order
    return None


def join_channels(image: NDArray[Any], channels: tuple[int, ...]) -> NDArray[Any]:
    """(h, w) uint16 of two channels, uint32 of three, float32 of four, the lowest byte first."""
    if len(channels) == 4:
        return np.ascontiguousarray(image[..., list(channels)]).view("<f4")[..., 0].astype(np.float32)
    values = sum(image[..., channel].astype(np.uint32) << 8 * k for k, channel in enumerate(channels))
    return np.asarray(values, np.uint16 if len(channels) == 2 else np.uint32)
