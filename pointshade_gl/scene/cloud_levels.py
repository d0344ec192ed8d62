"""Chooses how many points of a cloud a view needs: level k is an even sample of one in 2^k."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .bounds import sphere_round
from .camera import Eye
from .placed import Placed
from .point_cloud import PointCloud

PER_PIXEL = 2.0  # points for each pixel that the cloud's sphere covers
MOST_DRAWN = 1 << 24  # points, whatever the view
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
    centre, radius = sphere_round(placed.main_corners)
    away = float(np.linalg.norm(centre - eye.pose[:3, 3]))
    if away <= radius:
        return least
    camera = eye.camera
    covered = math.pi * abs(camera.fx * camera.fy) * radius**2 / (away**2 - radius**2)
    return max(math.floor(math.log2(max(len(cloud) / (PER_PIXEL * covered), 1)) + 0.5), least)


def points_at(cloud: PointCloud, level: int) -> NDArray[np.int64] | None:
    """Return which points of a cloud a level has, in their order; None for all. Each level is a part of the one before."""
    if level == 0:
        return None
    random, found = np.random.default_rng(SEED), []
    for first in range(0, len(cloud), CHUNK):
        drawn = random.random(min(CHUNK, len(cloud) - first), np.float32) < 0.5**level
        found.append(np.flatnonzero(drawn) + first)
    return np.concatenate(found)
