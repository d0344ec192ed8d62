"""The shadow that the frame's own surface casts: what no picture saw casts none. Rays are marched through the frame."""

from __future__ import annotations

import numpy as np

from .files import Truth
from .lamps import Lamp
from .measures import looked_up

STRIDE = 0.25  # source pixels from one step of a ray to the next
TOGETHER = 64  # steps of all rays at once
OWN = 2.0  # source pixels round a point in which no surface shades it


def shaded_by_shell(truth: Truth, lamp: Lamp, points: np.ndarray) -> np.ndarray:
    """(n,) whether the way from points (n, 3) to the lamp crosses a pixel's square on its tangent plane."""
    ends = np.array(lamp.position) if lamp.position is not None else points - 1e3 * np.array(lamp.direction)
    way = np.broadcast_to(ends, points.shape) - points
    own = OWN * points[:, 2] / truth.camera.fx / np.linalg.norm(way, axis=-1)
    steps = pixels_along(truth, points, way)
    found, left = np.zeros(len(points), bool), np.arange(len(points))
    for first in range(0, int(steps.max(initial=0)), TOGETHER):
        left = left[first < steps[left]]
        share = np.minimum((first + np.arange(TOGETHER + 1)) / steps[left, None], 1)
        along = in_picture(points[left], way[left], own[left], share)
        places = points[left, None] + along[..., None] * way[left, None]
        crossed = crosses(truth, places[:, :-1], places[:, 1:]).any(-1)
        found[left[crossed]] = True
        left = left[~crossed & in_sight(truth, places[:, -1])]
    return found


def last_share(points: np.ndarray, way: np.ndarray) -> np.ndarray:
    """(n,) how far along its way a ray stays before the camera."""
    end = points[:, 2] + way[:, 2]
    near = 0.02 * points[:, 2]
    return np.where(end < near, (near - points[:, 2]) / np.minimum(way[:, 2], -1e-9), 1)


def in_picture(points: np.ndarray, way: np.ndarray, own: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(n, k) shares of the way, for shares (n, k) of its picture from `own` to its end: 1/z is linear there."""
    last = last_share(points, way)
    z0, z1 = points[:, 2] + own * way[:, 2], points[:, 2] + last * way[:, 2]
    across = share * z0[:, None] / (share * z0[:, None] + (1 - share) * z1[:, None])
    return own[:, None] + (last - own)[:, None] * across


def pixels_along(truth: Truth, points: np.ndarray, way: np.ndarray) -> np.ndarray:
    """(n,) steps that a ray needs until it leaves the picture, or ends."""
    c, last = truth.camera, last_share(points, way)
    end = points + last[:, None] * way
    du = c.fx * np.abs(end[:, 0] / end[:, 2] - points[:, 0] / points[:, 2])
    dv = c.fy * np.abs(end[:, 1] / end[:, 2] - points[:, 1] / points[:, 2])
    return np.ceil(np.hypot(du, dv) / STRIDE).astype(int)


def crosses(truth: Truth, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(n, k) whether the ways from before to after (n, k, 3) cross the plane of the pixel in their middle."""
    row, column, known = looked_up(truth, (before + after) / 2)
    place, normal = truth.source.points[row, column], truth.source.normals[row, column]
    one, other = ((normal * (ends - place)).sum(-1) for ends in (before, after))
    return known & (one * other < 0)


def in_sight(truth: Truth, points: np.ndarray) -> np.ndarray:
    c = truth.camera
    u, v = c.fx * points[:, 0] / points[:, 2] + c.cx, c.fy * points[:, 1] / points[:, 2] + c.cy
    return (u > -1) & (u < c.width) & (v > -1) & (v < c.height)
