"""Merges the points of several frames of one thing: where frames agree, the one that sees a place best keeps it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import moved
from ..scene.frame import Frame
from .multi_view import nearest_others

STEP = 1.25  # factor between two densities of points that count as equal, so that neighbours decide alike
AROUND = 1  # pixels beside a point in which another frame's point takes its place
Mask = NDArray[np.bool_]


class FramePoints(NamedTuple):
    """The points of a frame.

    surface     (h, w, 4) unit normal and depth, camera axes; depth 0 where there is no point
    is_trusted  (h, w) whether other frames do not contradict a point
    """

    frame: Frame
    surface: NDArray[np.float32]
    is_trusted: Mask


def kept_once(every: Sequence[FramePoints], band: float) -> list[Mask]:
    """Return which points of each frame are kept, (h, w): trusted ones, and of those that lie on one place one.

    A place that several frames see keeps the points of the frame that has them most densely there. What that leaves
    open at borders is closed with the points of others.

    band  share of 1/z within which two frames see the same surface
    """
    known = [(one.surface[..., 3] > 0) & one.is_trusted for one in every]
    ranks = [_rank(one, k, len(every)) for k, one in enumerate(every)]
    others = nearest_others([one.frame for one in every])
    kept = [mask.copy() for mask in known]
    for k, one in enumerate(every):
        at = np.flatnonzero(known[k])
        own, worse = ranks[k].ravel()[at], np.zeros(len(at), np.bool_)
        for j, seen, pixels in _seen_by(one, at, every, others[k], band):
            worse[seen] |= known[j].ravel()[pixels] & (ranks[j].ravel()[pixels] > own[seen])
        kept[k].ravel()[at[worse]] = False
    for k, one in enumerate(every):
        at = np.flatnonzero(known[k] & ~kept[k])
        stands = np.zeros(len(at), np.bool_)
        for j, seen, pixels in _seen_by(one, at, every, others[k], band):
            stands[seen] |= _widened(kept[j]).ravel()[pixels]
        kept[k].ravel()[at[~stands]] = True
    return kept


def _rank(one: FramePoints, number: int, count: int) -> NDArray[np.int32]:
    """Return how densely a frame's points lie, (h, w), in steps; of equal frames the first has the higher rank."""
    height, width = one.surface.shape[:2]
    camera, z = one.frame.camera, np.where(one.surface[..., 3] > 0, one.surface[..., 3], np.float64(1))
    x, y = camera.ray_at(np.arange(width)[None, :], np.arange(height)[:, None])
    nx, ny, nz = np.moveaxis(one.surface[..., :3], -1, 0)
    facing = np.abs(nx * x + ny * y + nz) / np.sqrt(x * x + y * y + 1)
    density = abs(camera.fx * camera.fy) * np.maximum(facing, 0.02) / z**2
    steps = np.floor(np.log(density) / np.log(STEP)).astype(np.int32)
    return steps * count + (count - 1 - number)


def _seen_by(
    one: FramePoints, at: NDArray[np.intp], every: Sequence[FramePoints], others: Sequence[int], band: float
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.intp]]]:
    """Yield for each other frame which of the points `at` lie on its surface, and in which of its pixels."""
    width = one.surface.shape[1]
    z = one.surface[..., 3].ravel()[at].astype(np.float64)
    x, y = one.frame.camera.ray_at(at % width, at // width)
    points = np.stack([x * z, y * z, z], -1)
    for j in others:
        other = every[j]
        there = moved(points, np.linalg.inv(other.frame.pose) @ one.frame.pose)
        height, width = other.surface.shape[:2]
        front = np.maximum(there[:, 2], 1e-9)
        camera = other.frame.camera
        u = np.rint(camera.fx * there[:, 0] / front + camera.cx)
        v = np.rint(camera.fy * there[:, 1] / front + camera.cy)
        seen = np.flatnonzero((there[:, 2] > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height))
        pixels = v[seen].astype(np.intp) * width + u[seen].astype(np.intp)
        depth = other.surface[..., 3].ravel()[pixels]
        agrees = (depth > 0) & (np.abs(1 - depth / front[seen]) < band * depth / front[seen] + 1e-12)
        yield j, seen[agrees], pixels[agrees]


def _widened(mask: Mask) -> Mask:
    """Return where a mask is true, or a pixel beside it is."""
    wide = np.pad(mask, AROUND)
    height, width = mask.shape
    shifts = range(2 * AROUND + 1)
    return np.logical_or.reduce([wide[v : v + height, u : u + width] for v in shifts for u in shifts])
