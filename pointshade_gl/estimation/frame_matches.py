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

    numbers: NDArray[np.intp]  # (n,) of the points in their frame
    pixels: NDArray[np.intp]  # (n,) of the other frame, where they lie
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


def count_seen(points: Placed, target: ReducedFrame, pose: Floats, gate: float) -> int:
    """Return how many points another frame should show, as `find_matches` counts them."""
    found = _project(points, target, pose)
    return int(np.count_nonzero(found.behind < gate))


def find_matches(
    points: Placed, own: Brightness | None, target: ReducedFrame, pose: Floats, gate: float, level: int
) -> Matches | None:
    """Return the points that lie on the surface of another frame; None if it shows none of them.

    own    the brightness of the points' frame at this level of blur; None without colours
    pose   (4, 4) camera-to-world of the other frame
    gate   share of the depth within which a point may lie on its surface
    """
    found = _project(points, target, pose)
    if not len(found.behind):
        return None
    turn, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
    near = np.flatnonzero(np.abs(found.behind) < gate)
    pixels, at, some = found.pixels[near], found.at[near], found.some[near]
    planes = target.planes[pixels]
    apart = (np.einsum("nk,nk->n", planes[:, :3], at) - planes[:, 3]) / at[:, 2]
    normals = planes[:, :3] @ turn.T
    cosines = np.einsum("nk,nk->n", normals, points.normals[some])
    kept = np.flatnonzero((np.abs(apart) < gate) & (cosines > LEAST_COSINE))
    pixels, at, numbers = pixels[kept], at[kept], points.numbers[some[kept]]
    brighter, slopes = np.full(len(kept), np.nan, np.float32), np.zeros((len(kept), 3), np.float32)
    if own is not None and target.brightness is not None:
        brighter, slopes = _brighter(own.value[numbers], target, level, pixels, at)
        slopes = slopes @ turn.T
    surface = target.points[pixels] @ turn.T + place
    result = numbers, pixels, surface, at[:, 2], apart[kept], normals[kept], cosines[kept], brighter, slopes
    return Matches(*result, int(np.count_nonzero(found.behind < gate)))


class _Projected(NamedTuple):
    """Points where another frame knows its surface, n of them."""

    some: NDArray[np.intp]  # which points
    pixels: NDArray[np.intp]
    at: Floats  # (n, 3) in the other's camera axes
    behind: Floats  # how far behind its surface, a share of the surface's depth


def _project(points: Placed, target: ReducedFrame, pose: Floats) -> _Projected:
    turn, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
    camera, at = target.camera, (points.points - place) @ turn
    with np.errstate(all="ignore"):
        u, v = camera.pixel_at(at[:, 0], at[:, 1], at[:, 2])
        inside = (at[:, 2] > 0) & (u > -0.5) & (v > -0.5) & (u < camera.width - 0.5) & (v < camera.height - 0.5)
    some: NDArray[np.intp] = np.flatnonzero(inside)
    pixels = np.rint(v[some]).astype(np.intp) * camera.width + np.rint(u[some]).astype(np.intp)
    depth = target.points[pixels, 2]
    known = np.flatnonzero(depth > 0)
    some, pixels = some[known], pixels[known]
    at = at[some]
    return _Projected(some, pixels, at, at[:, 2] / depth[known] - 1)


def _brighter(
    own: Floats, target: ReducedFrame, level: int, pixels: NDArray[np.intp], at: Floats
) -> tuple[Floats, Floats]:
    """Return by how much another frame is brighter than points, exposures matched, and its slope in its camera axes.

    pixels  where the points lie in its picture; at (n, 3): in its camera axes
    """
    camera, shown = target.camera, target.blurred(level).maps[pixels]
    u, v = camera.pixel_at(at[:, 0], at[:, 1], at[:, 2])
    row, column = np.divmod(pixels, camera.width)
    theirs = shown[:, 0] + shown[:, 1] * (u - column) + shown[:, 2] * (v - row)
    is_shown = (np.minimum(own, theirs) > DARKEST) & (np.maximum(own, theirs) < BRIGHTEST)
    gain = float(np.median(theirs[is_shown] / own[is_shown])) if np.count_nonzero(is_shown) >= FEWEST else 1.0
    across, along, z = at[:, 0] / at[:, 2], at[:, 1] / at[:, 2], at[:, 2]
    by_u, by_v = shown[:, 1] * camera.fx / z, shown[:, 2] * camera.fy / z
    slopes = np.stack([by_u, by_v, -(by_u * across + by_v * along)], -1).astype(np.float32)
    return np.where(is_shown, theirs - gain * own, np.nan).astype(np.float32), slopes
