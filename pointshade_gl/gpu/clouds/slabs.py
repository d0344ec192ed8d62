"""Normals of clouds of any size: in slabs, each with a border from its neighbours."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.cloud_estimates import estimate_spacing
from .cloud_planes import find_planes
from .fit_radius import WIDEST

MOST = 8 << 20  # points of a slab
SAMPLE = 1 << 20  # points that the borders of slabs are found from


class CloudNormals(NamedTuple):
    """What is known of each point.

    normals     (n, 3) unit, 0 0 0 without a plane
    confidence  (n,) of the normal, 0 to 1
    spacing     (n,) of the surface there
    """

    normals: NDArray[np.float32]
    confidence: NDArray[np.float32]
    spacing: NDArray[np.float32]


def planes_of_slabs(
    context: moderngl.Context,
    positions: NDArray[np.floating[Any]],
    normals: NDArray[np.float32] | None = None,
    noise: float | None = None,
    most: int = MOST,
) -> CloudNormals:
    """Return the planes of a cloud, in its order. Only one slab at a time is on the GPU.

    positions  (n, 3) float32 or float64: each slab counts from its own middle
    normals    (n, 3) those that are known, others 0
    """
    count = len(positions)
    found = CloudNormals(np.zeros((count, 3), "f4"), np.zeros(count, "f4"), np.zeros(count, "f4"))
    for inside, around in _slabs(positions, most):
        if not len(around):
            continue
        local = positions[around]
        local = (local - np.rint(local.mean(0))).astype(np.float32)
        planes = find_planes(context, local, None if normals is None else normals[around], noise)
        places = around[planes.order]
        kept = inside[places]
        places = places[kept]
        found.normals[places] = planes.planes[kept, :3]
        found.spacing[places] = planes.planes[kept, 3]
        found.confidence[places] = planes.details[kept, 3]
    return found


def _slabs(positions: NDArray[np.floating[Any]], most: int) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.integer]]]:
    """Yield for each slab which points are inside, (n,) bool, and which lie inside or near it, their numbers."""
    count = len(positions)
    if count <= most:
        yield np.ones(count, bool), np.arange(count)
        return
    some = positions[:: -(-count // SAMPLE)]
    axis = int(np.argmax(np.subtract(*np.quantile(some, (0.99, 0.01), axis=0))))
    parts = -(-count // most)
    edges = np.quantile(some[:, axis], np.linspace(0, 1, parts + 1))
    edges[0], edges[-1] = -np.inf, np.inf
    along = positions[:, axis]
    border = WIDEST * estimate_spacing((positions - some.mean(0)).astype(np.float32)).length
    for low, high in pairwise(edges):
        inside = (along >= low) & (along < high)
        yield inside, np.flatnonzero((along >= low - border) & (along < high + border))
