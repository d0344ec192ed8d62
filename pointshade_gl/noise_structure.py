"""Tells fine structure from noise, block by block: leaves, fur and ornaments must not be averaged away."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Noise is as large between near pixels as between distant ones. Structure grows with their distance: its third
# differences more than its ring residuals. White noise has 1 for both, noise shared by neighbours up to 3 and 1.8.
GROWN, RING_GROWN = 3.0, 1.75  # strong evidence of structure, for depth that is not rounded
PARTLY_GROWN = 1.75  # of both kinds together: third differences grow at least as much
ROUNDED_RING, FRAME_RING = 2.2, 1.8  # the same for rounded depth, from a sensor as a rule: only rings are to be trusted
WEAK_GROWN, WEAK_RING = 1.7, 1.45  # enough beside strong evidence
SHARED_RING = 1.25  # depth that is not rounded: neighbours share noise only up to this growth
MOSTLY = 0.5  # share of strong blocks from which on weak evidence is enough everywhere


class Structure(NamedTuple):
    """(rows, columns) each: blocks that hold structure, and those where what grows with distance is no shared noise."""

    structured: Mask
    uneven: Mask


def neighbours3(values):
    """Return (9, rows, cols): every cell of a grid with its 8 neighbours, the border repeated."""
    padded = np.pad(values, 1, mode="edge")
    rows, cols = values.shape
    return np.stack([padded[i : i + rows, j : j + cols] for i in range(3) for j in range(3)])


def median3(values: Array, known: Mask) -> Array:
    """Return the 3x3 median of a grid (rows, cols); cells that are not known count as the median of all."""
    filled = np.where(known, values, np.median(values[known]) if known.any() else 0.0)
    return np.partition(neighbours3(filled), 4, axis=0)[4]


def find_structure(near: Array, levels: Array, coarse: Array, rounded: bool, smooth: Mask) -> Structure:
    """Which blocks hold structure.

    near     quartile of the noise between neighbours, of w
    levels   (rows, cols, 4) float32 from noise_blocks.frag with STRUCTURE
    rounded  depth is rounded
    smooth   blocks that are not asked: plateaus look like anything
    """
    far, ring, far_ring = (levels[..., k].astype(np.float64) for k in (0, 2, 3))
    known = (near > 0) & (far > 0) & (ring > 0) & (far_ring > 0)
    grown, ring_grown = _growth(near, far, known), _growth(ring, far_ring, known)
    if rounded:
        asked = known & ~smooth
        middle = np.median(ring_grown[asked]) if asked.any() else 0.0
        coarse_grown = np.median((coarse / np.where(known, near, 1))[asked & (coarse >= 0)]) if (asked & (coarse >= 0)).any() else 0.0
        everywhere = middle > FRAME_RING or (middle > WEAK_RING and coarse_grown > 5.0)
        strong, weak, shared = ring_grown > ROUNDED_RING, ring_grown > (WEAK_RING if everywhere else FRAME_RING), ring_grown < RING_GROWN
        if everywhere: strong=weak
    else:
        strong = (grown > GROWN) | (grown > PARTLY_GROWN) & (ring_grown > RING_GROWN)
        weak, shared = (grown > WEAK_GROWN) & (ring_grown > WEAK_RING), ring_grown < SHARED_RING
    strong, weak = strong & known & ~smooth, (weak | ~known) & (near > 0) & ~smooth
    beside = neighbours3(strong).any(0) | (np.count_nonzero(strong) > MOSTLY * np.count_nonzero(known & ~smooth))
    structured = strong | weak & beside
    global DEBUG
    ok = known & (coarse >= 0)
    DEBUG = dict(t7=np.median((coarse/np.where(known,near,1))[ok]) if ok.any() else 0., t7b=np.median((coarse/np.where(known,near,1))[ok&~smooth]) if (ok&~smooth).any() else 0., ringm=np.median(ring_grown[known&~smooth]) if (known&~smooth).any() else 0., growth=grown, rings=ring_grown, usable=known, structured=structured, strong=strong)
    return Structure(structured, structured if rounded else structured | (known & ~smooth & ~shared))


def _growth(near: Array, far: Array, known: Mask) -> Array:
    ratio = np.where(known, far, 1.0) / np.where(known, near, 1.0)
    return np.exp(median3(np.log(ratio), known))
