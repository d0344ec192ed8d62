"""Several frames of one thing as one surface: each part from the frame that sees it best, the mean of all that see it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..estimation.multi_view import nearest_others
from ..scene.camera import Camera

OVERLAP = 2  # pixels by which parts reach over one another, so that no seam gapes
TURNED = 0.17  # least cosine between normals of one surface

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]


class Member(NamedTuple):
    """One of the frames.

    surface  (h, w, 4) normal and depth, negative at rims, 0 where no point is trusted
    colors   (.., .., 3) linear, in the exposure of all; those of another size than the surface stay what they are
    good     (h, w) how good points are, 0 to 1
    camera   that took it
    pose     (4, 4) camera-to-world in the frames' own unit
    """

    surface: Floats
    colors: Floats
    good: Floats
    camera: Camera
    pose: NDArray[np.float64]

    @property
    def is_colored(self) -> bool:
        """Whether each point has a colour of its own."""
        return self.colors.shape[:2] == self.surface.shape[:2]

    @property
    def known(self) -> Flags:
        return self.surface[..., 3] != 0

    def rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3), of depth 1."""
        fx, fy, cx, cy = self.camera.intrinsics
        x, y = pixels.T
        return np.stack([(x - cx) / fx, (y - cy) / fy, np.ones(len(x))], -1)


class Points(NamedTuple):
    """Points of one frame: their pixels, and what is known there."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    rays: NDArray[np.float64]
    places: NDArray[np.float64]
    normals: NDArray[np.float64]


def merged(members: Sequence[Member], frames: Sequence[object], band: float) -> list[Member]:
    """The frames with the points of which no other frame shows more: normals, depths and colours are means.

    band  share of 1/z within which two frames see the same surface
    """
    others = nearest_others(frames)
    means, kept = [], [member.known for member in members]
    weights = [_weights(member) for member in members]
    for k, member in enumerate(members):
        points = _points(member)
        best, mean = _met(points, [(j, members[j], weights[j], kept[j]) for j in others[k]], member, weights[k], band)
        own = weights[k][points.rows, points.columns]
        mask = np.zeros(member.known.shape, np.bool_)
        mask[points.rows, points.columns] = best <= own
        kept[k] = mask
        means.append(mean)
    return [
        mean._replace(surface=np.where((_grown(mask) & mean.known)[..., None], mean.surface, np.float32(0)))
        for mean, mask in zip(means, kept, strict=True)
    ]


def _weights(member: Member) -> Floats:
    """(h, w): how well each point is seen: how good it is, and how many pixels a piece of its surface has."""
    points = _points(member)
    weights = np.zeros(member.known.shape, np.float32)
    facing = np.abs(np.einsum("nk,nk->n", points.normals, points.rays)) / np.linalg.norm(points.rays, axis=1)
    density = facing * np.square(member.camera.fx / points.places[:, 2])
    weights[points.rows, points.columns] = density * np.maximum(member.good[points.rows, points.columns], 1e-3)
    return weights


def _points(member: Member) -> Points:
    rows, columns = np.nonzero(member.known)
    rays = member.rays(np.stack([columns, rows], -1).astype(np.float64))
    values = member.surface[rows, columns].astype(np.float64)
    return Points(rows, columns, rays, rays * np.abs(values[:, 3:]), values[:, :3])


def _met(
    points: Points, others: Sequence[tuple[int, Member, Floats, Flags]], member: Member, own: Floats, band: float
) -> tuple[NDArray[np.float64], Member]:
    """For each point the most weight that a kept point of another frame has there, and the frame with means."""
    at = points.rows, points.columns
    total = own[at].astype(np.float64)
    best = np.zeros(len(total))
    normals, off = total[:, None] * points.normals, np.zeros(len(total))
    colors = total[:, None] * member.colors[at] if member.is_colored else None
    for _, other, weights, kept in others:
        way = np.linalg.inv(other.pose) @ member.pose
        there = points.places @ way[:3, :3].T + way[:3, 3]
        found, pixels, excess = _agreeing(there, other, points.normals @ way[:3, :3].T, band)
        place = pixels[:, 1], pixels[:, 0]
        weight = weights[place].astype(np.float64)
        best[found] = np.maximum(best[found], np.where(kept[place], weight, 0))
        weight *= 1 - np.square(excess / band)
        total[found] += weight
        normals[found] += weight[:, None] * (other.surface[place][:, :3] @ way[:3, :3])
        off[found] += weight * excess
        if colors is not None and other.is_colored:
            colors[found] += weight[:, None] * other.colors[place]
        elif colors is not None:
            colors[found] += weight[:, None] * member.colors[points.rows[found], points.columns[found]]
    surface = member.surface.copy()
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    surface[points.rows, points.columns, :3] = normals
    surface[points.rows, points.columns, 3] *= 1 + off / total
    mean = member.colors.copy()
    if colors is not None:
        mean[at] = colors / total[:, None]
    return best, member._replace(surface=surface, colors=mean)


def _agreeing(
    there: NDArray[np.float64], other: Member, normals: NDArray[np.float64], band: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Which points another frame shows, too; at which of its pixels (n, 2); and by which share it has them farther."""
    fx, fy, cx, cy = other.camera.intrinsics
    height, width = other.known.shape
    with np.errstate(divide="ignore", invalid="ignore"):
        place = there[:, :2] / there[:, 2:] * (fx, fy) + (cx, cy)
        inside = (there[:, 2] > 0) & (place > -0.5).all(1) & (place < (width - 0.5, height - 0.5)).all(1)
    index = np.flatnonzero(inside)
    pixels = np.rint(place[index]).astype(np.intp)
    values = other.surface[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    depth, ray = np.abs(values[:, 3]), other.rays(place[index])
    rays = other.rays(pixels.astype(np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.einsum("nk,nk->n", values[:, :3], rays) / np.einsum("nk,nk->n", values[:, :3], ray)
        excess = depth * along / there[index, 2] - 1
    faces = np.einsum("nk,nk->n", values[:, :3], normals[index]) > TURNED
    same = (depth > 0) & faces & (np.abs(excess) < band)
    return index[same], pixels[same], excess[same]


def _grown(mask: Flags) -> Flags:
    """The mask with the pixels up to OVERLAP beside it."""
    for _ in range(OVERLAP):
        wide = np.pad(mask, 1)
        mask = wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
    return mask
