"""Converts normals from files to this package's axes: OpenCV's, unit length, towards the camera."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ..cameras.intrinsics import Numbers

# What their makers may have meant: x right, y down, z forward; the same away from the camera; y up and z backwards
_AXES = {"": (1, 1, 1), "away from the camera": (-1, -1, -1), "with OpenGL's axes": (1, -1, -1)}
_COARSE = 200  # rows and columns that are compared


def turn_normals(
    normals: NDArray[Any], depth: NDArray[Any], camera: Numbers | None, name: str, note: Note
) -> NDArray[np.float32]:
    """(h, w, 3) float32 in OpenCV's axes towards the camera, NaN where missing, from normals of the depth's size.

    Which axes the file has is found by comparing with the depth's own surface; without a camera OpenCV's are taken.
    """
    vectors = normals.astype(np.float32)
    lengths = np.linalg.norm(vectors, axis=2, keepdims=True)
    vectors = np.where((lengths > 0.5) & (lengths < 2), vectors / lengths, np.float32(np.nan))
    if camera is None:
        return vectors
    step = max(1, min(depth.shape) // _COARSE)
    surface = _of_surface(depth[::step, ::step].astype(np.float64), camera, step)
    some = vectors[::step, ::step][:-1, :-1]

    def agreement(axes: tuple[int, int, int]) -> float:
        cosines = np.sum(some * axes * surface, axis=2)
        known = cosines[np.isfinite(cosines)]
        return float(known.mean()) if known.size else 0.0

    said, axes = max(_AXES.items(), key=lambda entry: agreement(entry[1]))
    if said:
        note(f"{name}: its normals are {said}, and turned")
    return vectors * np.array(axes, np.float32)


def _of_surface(depth: NDArray[np.float64], camera: Numbers, step: int) -> NDArray[Any]:
    """(h-1, w-1, 3) normals of the triangles between neighbouring points, towards the camera."""
    fx, fy, cx, cy = camera
    rows, columns = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]] * step
    depth = np.where((depth > 0) & np.isfinite(depth), depth, np.nan)
    points = np.stack([(columns - cx) / fx * depth, (rows - cy) / fy * depth, depth], axis=2)
    along, down = points[:-1, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, :-1]
    normals = np.cross(along, down)
    normals *= -np.sign(np.sum(normals * points[:-1, :-1], axis=2, keepdims=True))
    return normals / np.linalg.norm(normals, axis=2, keepdims=True)
