"""Finds where the points of one frame lie in another, and by how much depth and brightness differ there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .reduced_frame import Brightness, ReducedFrame

LEAST_COSINE = 0.7  # between the normals of two points that may be the same
DARKEST, BRIGHTEST = 0.1, 0.97  # brightness beyond which nothing is compared: clipped, or only noise
FEWEST = 20  # of values of which a median is trusted
Floats = NDArray[np.floating]


class Placed(NamedTuple):
    """Points of a frame where its pose puts them."""

    numbers: NDArray[np.intp]  # (n,) of the points in the frame
    points: Floats  # (n, 3) world
    normals: Floats  # (n, 3) world


class Matches(NamedTuple):
    """Points of one frame that lie on the surface of another, n of them.

    Differences are in shares of the depth, in the first frame less the second.
    """

    points: Floats  # (n, 3) the other's, world: what is symmetric fixes no turn, exactly
    depth: Floats  # (n,) z in the other frame
    apart: Floats  # (n,) along the other's normal, over depth
    normals: Floats  # (n, 3) the other's, world
    cosines: Floats  # (n,) between both normals
    brighter: Floats  # (n,) the other's brightness less the point's; NaN where not compared
    slopes: Floats  # (n, 3) derivative of `brighter` by the point's place, world
    seen: int  # points of the first frame that the other should show: nothing in it lies before them


def placed(frame: ReducedFrame, pose: Floats, step: int) -> Placed:
    """Return every step-th point of a frame, and of its columns, in the world. pose: (4, 4) camera-to-world."""
    numbers = frame.samples(step)
    turn = pose[:3, :3].astype(np.float32)
    points = frame.points[numbers] @ turn.T + pose[:3, 3].astype(np.float32)
    return Placed(numbers, points, frame.normals[numbers] @ turn.T)


def find_matches(
    points: Placed, own: Brightness | None, target: ReducedFrame, pose: Floats, gate: float, level: int
) -> Matches | None:
    """Return the points that lie on the surface of another frame; None if there are none.

    own    the brightness of the points' frame at this level of blur; None without colours
    pose   (4, 4) camera-to-world of the other frame
    gate   share of the depth within which a point may lie on its surface
    """
    turn, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
    camera = target.camera
    at = (points.points - place) @ turn
    with np.errstate(all="ignore"):
        u, v = camera.pixel_at(at[:, 0], at[:, 1], at[:, 2])
        inside = (at[:, 2] > 0) & (u > -0.5) & (v > -0.5) & (u < camera.width - 0.5) & (v < camera.height - 0.5)
    some: NDArray[np.intp] = np.flatnonzero(inside)
    pixels = np.rint(v[some]).astype(np.intp) * camera.width + np.rint(u[some]).astype(np.intp)
    there, normals = target.points[pixels], target.normals[pixels]
    is_known = there[:, 2] > 0
    some, there, normals = some[is_known], there[is_known], normals[is_known]
    if not len(some):
        return None
    at, depth = at[some], at[some, 2]
    apart = np.einsum("nk,nk->n", normals, at - there) / depth
    behind = depth / there[:, 2] - 1
    world = normals @ turn.T
    cosines = np.einsum("nk,nk->n", world, points.normals[some])
    near = (np.abs(behind) < gate) & (np.abs(apart) < gate) & (cosines > LEAST_COSINE)
    kept = np.flatnonzero(near)
    brighter, slopes = np.full(len(kept), np.nan, np.float32), np.zeros((len(kept), 3), np.float32)
    if own is not None and target.brightness is not None:
        places = u[some[kept]], v[some[kept]]
        brighter, slopes = _brighter(own.value[points.numbers[some[kept]]], target, level, *places, at[kept])
        slopes = slopes @ turn.T
    surface = there[kept] @ turn.T + place
    result = surface, depth[kept], apart[kept], world[kept], cosines[kept], brighter, slopes
    return Matches(*result, int(np.count_nonzero(behind < gate)))


def _brighter(own: Floats, target: ReducedFrame, level: int, u: Floats, v: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Return by how much another frame is brighter than points, exposures matched, and its slope in its camera axes.

    u, v  where the points lie in its picture; at (n, 3): in its camera axes
    """
    camera, shown = target.camera, target.blurred(level)
    left = np.clip(np.floor(u).astype(np.intp), 0, camera.width - 2)
    top = np.clip(np.floor(v).astype(np.intp), 0, camera.height - 2)
    corner, x, y = top * camera.width + left, u - left, v - top
    above = shown.value[corner] * (1 - x) + shown.value[corner + 1] * x
    below = shown.value[corner + camera.width] * (1 - x) + shown.value[corner + camera.width + 1] * x
    theirs = above * (1 - y) + below * y
    is_shown = (np.minimum(own, theirs) > DARKEST) & (np.maximum(own, theirs) < BRIGHTEST)
    with np.errstate(all="ignore"):
        gain = float(np.median(theirs[is_shown] / own[is_shown])) if is_shown.sum() >= FEWEST else 1.0
        across, along, z = at[:, 0] / at[:, 2], at[:, 1] / at[:, 2], at[:, 2]
        pixel = corner + (x > 0.5) + camera.width * (y > 0.5)
        by_u, by_v = shown.along_u[pixel] * camera.fx / z, shown.along_v[pixel] * camera.fy / z
    slopes = np.stack([by_u, by_v, -(by_u * across + by_v * along)], -1).astype(np.float32)
    return np.where(is_shown, theirs - gain * own, np.nan).astype(np.float32), slopes
