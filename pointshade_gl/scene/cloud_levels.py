"""Chooses how many points of a cloud a view needs: level k is an even sample of one in 2^k."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .camera import Eye
from .placed import Placed
from .point_cloud import PointCloud
from .rotation import moved

PER_PIXEL = 2.0  # points for each pixel that the cloud covers, those behind included
MOST_DRAWN = 1 << 24  # points, whatever the view
SAMPLE = 4096  # points that tell what a cloud covers
CELL = 16  # pixels along a side of the cells in which they are counted
SEED = 20010  # of the samples
CHUNK = 1 << 24


def level_of(placed: Placed, eye: Eye) -> int:
    """Return the level of a placed cloud that an eye needs: 0 is all points."""
    cloud: PointCloud = placed.content
    if not len(cloud):
        return 0
    least = max(math.ceil(math.log2(len(cloud) / MOST_DRAWN)), 0)
    if not cloud.thins:
        return least
    covered, share = _seen(placed, eye)
    wanted = PER_PIXEL * covered / share if share else 1.0
    return max(math.floor(math.log2(max(len(cloud) / wanted, 1)) + 0.5), least)


def _seen(placed: Placed, eye: Eye) -> tuple[float, float]:
    """Return how many pixels the cloud covers, roughly, and the share of its points that are in view."""
    cloud, camera = placed.content, eye.camera
    some = cloud.positions[:: -(-len(cloud) // SAMPLE)] + cloud.origin
    x, y, z = moved(some, np.linalg.inv(eye.pose) @ placed.world).T
    ahead = z > eye.near
    u, v = (camera.fx * x[ahead] / z[ahead] + camera.cx + 0.5, camera.fy * y[ahead] / z[ahead] + camera.cy + 0.5)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    columns = -(-camera.width // CELL)
    cells = (v[inside] // CELL).astype(int) * columns + (u[inside] // CELL).astype(int)
    return float(len(np.unique(cells)) * CELL**2), float(np.count_nonzero(inside) / len(some))


def points_at(cloud: PointCloud, level: float) -> NDArray[np.int64] | None:
    """Return which points of a cloud a level has, in order; None for all. Each level is part of those below it."""
    if level == 0:
        return None
    random = np.random.default_rng(SEED)
    found: list[NDArray[np.int64]] = []
    for first in range(0, len(cloud), CHUNK):
        drawn = random.random(min(CHUNK, len(cloud) - first), np.float32) < 0.5**level
        found.append(np.flatnonzero(drawn) + first)
    return np.concatenate(found)
