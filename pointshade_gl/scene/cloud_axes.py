"""Turns point clouds to the axes that other programs expect, and says in words what axes are."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .point_cloud import UPS, PointCloud, Up, direction_of

CloudAxes = Literal["opencv", "opengl", "blender"]
CLOUD_AXES: dict[CloudAxes, tuple[Up, Up]] = {  # what is up, and what points towards the viewer
    "opencv": ("-y", "-z"),
    "opengl": ("y", "z"),
    "blender": ("z", "-y"),
}
USUAL_FRONT: dict[Up, Up] = {"-y": "-z", "y": "z", "z": "-y", "-z": "-y", "x": "-y", "-x": "-y"}  # by what is up
_VIEWER = re.compile(r"\b([xyz]) (towards|away from) the viewer\b")


def turned(cloud: PointCloud, axes: CloudAxes) -> PointCloud:
    """Return a cloud in other axes, with all that lies or points somewhere; numbers change places and signs only."""
    up, front = CLOUD_AXES[axes]
    turn = _axes_of(up, front) @ _axes_of(cloud.up, cloud.front or USUAL_FRONT[cloud.up]).T
    changed: dict[str, Any] = {
        name: _turned(getattr(cloud, name), turn) for name in ("positions", "normals", "seen_from", "origin")
    }
    return replace(cloud, **changed, up=up, front=front if cloud.front else None)


def axes_in_words(up: Up, front: Up) -> str:
    """Return such as "x right, y up, z towards the viewer"."""
    words = {}
    for axis, ends in (
        (up, ("up", "down")),
        (front, ("towards the viewer", "away from the viewer")),
        (_right_of(up, front), ("right", "left")),
    ):
        words[axis[-1]] = ends[axis.startswith("-")]
    return ", ".join(f"{axis} {words[axis]}" for axis in "xyz")


def front_in_words(text: str) -> Up | None:
    """Return which axis points towards the viewer, from what `axes_in_words` says; None where it says nothing."""
    found = _VIEWER.search(text)
    axis = found and f"{'-' if found[2] == 'away from' else ''}{found[1]}"
    return next((up for up in UPS if up == axis), None)


def _axes_of(up: Up, front: Up) -> NDArray[np.float64]:
    """Return (3, 3) columns: what is right, up and towards the viewer."""
    return np.stack([direction_of(_right_of(up, front)), direction_of(up), direction_of(front)], -1)


def _right_of(up: Up, front: Up) -> Up:
    right = np.cross(direction_of(up), direction_of(front))
    return next(axis for axis in UPS if np.array_equal(direction_of(axis), right))


def _turned(vectors: NDArray[Any] | None, turn: NDArray[np.float64]) -> NDArray[Any] | None:
    return None if vectors is None else vectors @ turn.T.astype(vectors.dtype)
