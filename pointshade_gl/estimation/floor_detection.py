"""Detects a floor in a frame: a large, nearly level plane below all other points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..scene.frame import Frame

Points = NDArray[np.float64]  # (n, 3)

SAMPLES = 4000  # points that are looked at
TRIES = 150  # planes through three points each
NEAR = 0.01  # by this share of its distance a point may lie off its plane
ROUNDS = 3  # of fitting, and of planes one below the other
SHARE = 0.1  # of all points that a floor has at least
BELOW = 0.01  # of all points that may lie below it,
THICK = 0.002  # by more than its noise and this share of their distance: a board on a floor is none
TOP = 0.9  # of its points lie below the ground that continues it: its own noise must not shade that


def shown_floor(frame: Frame, up: NDArray[np.float64], lean: float) -> NDArray[np.float64] | None:
    """Return a frame's floor, (4,): its unit normal, and the height of the camera above it; None without one.

    up    (3,) unit; all in the frame's axes
    lean  degrees between the floor's normal and up, at most
    """
    points, steepest = _samples(frame), math.cos(math.radians(lean))
    rest = points
    for _ in range(ROUNDS):
        plane = _largest_plane(rest, up, steepest)
        if plane is None or len(_on(points, plane)) < SHARE * len(points):
            return None
        heights = _heights(points, plane)
        own = heights[np.abs(heights) < _reach(points)]
        noise = 4 * 1.4826 * float(np.median(np.abs(own)))  # how far most points of the plane lie off it
        if (heights < -noise - THICK * points[:, 2]).mean() <= BELOW:
            return plane - (0, 0, 0, np.quantile(own, TOP))
        rest = points[heights < -_reach(points)]
    return None


def _samples(frame: Frame) -> Points:
    """Some of the points, evenly spread over the picture."""
    known = np.argwhere(frame.depth > 0)
    v, u = known[:: max(len(known) // SAMPLES, 1)].T
    return frame.camera.unproject(frame.depth[v, u], np.stack([u, v], -1))


def _largest_plane(points: Points, up: NDArray[np.float64], steepest: float) -> NDArray[np.float64] | None:
    """Return the plane, (4,), on which most points lie, among those that are level enough."""
    if len(points) < 3:
        return None
    a, b, c = points[np.random.default_rng(0).integers(0, len(points), (3, TRIES))]
    normals = np.cross(b - a, c - a)
    normals *= np.sign(normals @ up)[:, None] / np.maximum(np.linalg.norm(normals, axis=-1), 1e-12)[:, None]
    level = normals @ up >= steepest
    planes = np.column_stack([normals, -(normals * a).sum(-1)])[level]
    if not len(planes):
        return None
    best = planes[np.argmax([len(_on(points, plane)) for plane in planes])]
    for _ in range(ROUNDS):
        best = _fitted(_on(points, best), up)
    return best if best[:3] @ up >= steepest else None


def _fitted(points: Points, up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit a plane, (4,), to points by least squares."""
    middle = points.mean(0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    normal = normal if normal @ up > 0 else -normal
    return np.append(normal, -normal @ middle)


def _heights(points: Points, plane: NDArray[np.float64]) -> NDArray[np.float64]:
    return points @ plane[:3] + plane[3]


def _reach(points: Points) -> NDArray[np.float64]:
    return NEAR * points[:, 2]


def _on(points: Points, plane: NDArray[np.float64]) -> Points:
    return points[np.abs(_heights(points, plane)) < _reach(points)]
