"""Examines a point cloud: what its file holds and how it is read, for `pointshade info`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...checks.arguments import check_path
from ...scene.cloud import PointCloud
from ..access.content import FilePath
from .cloud_colors import choices
from .load import CloudOptions, read_cloud
from .placing import main_box, spacing_of


def cloud_facts(path: FilePath, **options: Any) -> dict[str, Any]:
    """What was found; numbers are plain, lengths in the file's units, so that programs can read it as JSON.

    options  those of `load_cloud`, except notes. Raises as it does.
    """
    notes: list[str] = []
    cloud, found = read_cloud(check_path(path), CloudOptions(**options), notes.append)
    low, high = (_plain(end + cloud.origin) for end in main_box(cloud.positions)) if len(cloud) else ([], [])
    return {
        "file": str(path),
        "format": found.form,
        "points": len(cloud),
        "extent": [_rounded(b - a) for a, b in zip(low, high, strict=True)],
        "box": [low, high],
        "spacing": _rounded(spacing_of(cloud.positions)),
        "stored_as": str(cloud.positions.dtype),
        "origin": _plain(cloud.origin),
        "up": {"axis": cloud.up, "why": found.up_from},
        "front": cloud.front,
        "colors": cloud.colors is not None,
        "normals": _share(cloud),
        "sizes": cloud.sizes is not None,
        "seen_from": _places(cloud),
        "color_by": choices(found),
        "assumed": notes,
    }


def _share(cloud: PointCloud) -> float:
    """Of the points that have a normal."""
    return 0.0 if cloud.normals is None else round(float(cloud.normals.any(1).mean()), 4)


def _places(cloud: PointCloud) -> list[list[float]]:
    """Where scanners stood, in the file's coordinates."""
    if cloud.seen_from is None:
        return []
    return [_plain(place + cloud.origin) for place in np.unique(np.atleast_2d(cloud.seen_from), axis=0)]


def _plain(numbers: np.ndarray) -> list[float]:
    return [float(one) for one in numbers]


def _rounded(number: float) -> float:
    return float(f"{number:.4g}")
