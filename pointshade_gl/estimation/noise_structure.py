"""Distinguishes fine structure (leaves, fur, ornaments) from depth noise, by blocks: it must not be smoothed away."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Noise is as large between near pixels as between distant ones; structure grows with their distance. Growth here is
# that of third differences (of the level) and of ring residuals, from neighbours to pixels 3 apart, and from ring
# to wider ring. White noise has 1 for both, noise that neighbours share up to 3 and 1.8.
GROWN, PARTLY_GROWN, RING_GROWN = 2.5, 1.75, 1.75  # the first alone, or the others together
WEAK_GROWN, WEAK_RING = 1.7, 1.45  # both together, beside blocks that are certain
SHARED_RING = 1.25  # from here on, what grows with distance is not noise that neighbours share
# Rounded depth comes from sensors, whose neighbours do share noise: only rings count, and more of them are needed.
ROUNDED_RING, ROUNDED_WEAK_RING = 2.2, 1.8
FRAME_RING, FRAME_GROWN, FRAME_COARSE = 2.05, 3.6, 4.5  # medians of a rounded frame that is busy everywhere: the first
# alone, or the weak one and another; the last is the growth to COARSE pixels
NOTHING = 1e-30  # the quantiles of noise_levels.glsl are never exactly zero
MOSTLY = 0.5  # share of certain blocks from which on the weak evidence is enough everywhere


class Structure(NamedTuple):
    """Where depth varies by fine structure, not by noise; (rows, columns) of blocks each.

    found   blocks that hold structure: their own level is not that of the noise
    uneven  blocks where growth with distance is structure, not noise that neighbours share
    noise   share of the level measured between neighbours that is noise, 0 to 1
    """

    found: Mask
    uneven: Mask
    noise: Array


def neighbours3(values):
    """Return (9, rows, cols): every cell of a grid with its 8 neighbours, the border repeated."""
    padded = np.pad(values, 1, mode="edge")
    rows, cols = values.shape
    return np.stack([padded[i : i + rows, j : j + cols] for i in range(3) for j in range(3)])


def median3(values: Array, known: Mask) -> Array:
    """Return the 3x3 median of a grid (rows, cols); cells that are not known count as the median of all."""
    filled = np.where(known, values, np.median(values[known]) if known.any() else 0.0)
    return np.partition(neighbours3(filled), 4, axis=0)[4]


def find_structure(near: Array, levels: Array, coarse: Array, rounded: bool, hidden: Mask) -> Structure:
    """Return which blocks of a frame hold structure.

    near     (rows, columns) quartile of the noise of w between neighbours, negative where it could not be measured
    levels   (rows, columns, 4) from noise_blocks.frag with MEASURED 2
    coarse   as near, between pixels COARSE apart
    rounded  depth is rounded
    hidden   blocks where rounding or repeated lines would hide structure
    """
    far, ring, far_ring = (levels[..., k] for k in (0, 2, 3))
    known = np.minimum(np.minimum(near, far), np.minimum(ring, far_ring)) > NOTHING
    grown, ring_grown = _growth(near, far, known), _growth(ring, far_ring, known)
    asked = (near > NOTHING) & ~hidden
    if rounded:
        seen = known & asked
        both = seen & (coarse >= 0)
        busy = _is_busy(ring_grown[seen], grown[seen], coarse[both] / near[both])
        certain = ring_grown > (WEAK_RING if busy else ROUNDED_RING)
        likely, uneven = ring_grown > (WEAK_RING if busy else ROUNDED_WEAK_RING), np.full(known.shape, busy)
    else:
        certain = (grown > GROWN) | (grown > PARTLY_GROWN) & (ring_grown > RING_GROWN)
        likely, uneven = (grown > WEAK_GROWN) & (ring_grown > WEAK_RING), ring_grown > SHARED_RING
    certain, likely, uneven = certain & known & asked, (likely | ~known) & asked, uneven & known & asked
    beside = neighbours3(certain).any(0) | (np.count_nonzero(certain) > MOSTLY * np.count_nonzero(known & asked))
    found = certain | likely & beside
    left = np.sqrt(np.clip((GROWN**2 - grown**2) / (GROWN**2 - 1), 0, 1))
    return Structure(found, found | uneven, np.where(uneven & (not rounded), left, 1.0))


def _growth(near: Array, far: Array, known: Mask) -> Array:
    ratio = np.where(known, far, 1.0).astype(np.float64) / np.where(known, near, 1.0)
    return np.exp(median3(np.log(ratio), known))


def _is_busy(*growths: Array) -> bool:
    """Return whether a rounded frame shows structure everywhere, from growth with distance of ring residuals, of third
    differences, and of third differences to COARSE pixels."""
    ring, grown, coarse = (float(np.median(values)) if values.size else 0.0 for values in growths)
    return ring > FRAME_RING or (ring > WEAK_RING and (grown > FRAME_GROWN or coarse > FRAME_COARSE))
