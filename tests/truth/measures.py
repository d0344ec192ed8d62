"""How far a picture is from its truth: decibels, shadows, holes, spill. Masks are (h, w) bool."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import Hits, TracedSurface, decode, encode

from .files import Truth, View

SAME = 0.003  # of z: as near is a point to a tangent plane on which it lies
STEP = 0.015  # of z: two surfaces that are farther apart are different
CREASE = np.cos(np.radians(20))
FAR, CONTACT = 1e4, 1e-3  # distance of a directional light; nearer surfaces than CONTACT do not shade a point


def looked_up(truth: Truth, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points (..., 3): row and column of the nearest source pixel, and whether there is one that is not empty."""
    c, z = truth.camera, np.where(points[..., 2] > 0, points[..., 2], 1)
    u = np.rint(c.fx * points[..., 0] / z + c.cx).astype(int)
    v = np.rint(c.fy * points[..., 1] / z + c.cy).astype(int)
    inside = (points[..., 2] > 0) & (u >= 0) & (u < c.width) & (v >= 0) & (v < c.height)
    row, column = np.clip(v, 0, c.height - 1), np.clip(u, 0, c.width - 1)
    return row, column, inside & (truth.source.depth[row, column] > 0)


def seen_by_frame(truth: Truth, view: View) -> np.ndarray:
    """Pixels whose true point lies on the tangent plane of the source pixel nearest to it."""
    row, column, known = looked_up(truth, view.points)
    place, normal = truth.source.points[row, column], truth.source.normals[row, column]
    ray = view.points / np.maximum(view.points[..., 2:], 1e-9)
    slant = (normal * ray).sum(-1)
    z = (normal * place).sum(-1) / np.where(np.abs(slant) > 1e-6, slant, 1e-6)
    return (view.depth > 0) & known & (np.abs(z - view.points[..., 2]) < SAME * view.points[..., 2])


def edges(view: View, reach: int = 2) -> np.ndarray:
    """Pixels within `reach` of a step of depth, of a crease, or of the empty background."""
    z, found = view.depth, np.zeros(view.depth.shape, bool)
    for axis in (0, 1):
        a, b = np.arange(z.shape[axis] - 1), np.arange(1, z.shape[axis])
        one, other = np.take(view.points, a, axis), np.take(view.points, b, axis)
        n, m = np.take(view.normals, a, axis), np.take(view.normals, b, axis)
        depth = np.maximum(np.take(z, a, axis), np.take(z, b, axis))
        off = np.minimum(np.abs((n * (other - one)).sum(-1)), np.abs((m * (other - one)).sum(-1)))
        broken = ((n * m).sum(-1) < CREASE) | (off > SAME * depth)
        broken |= (np.take(z, a, axis) > 0) != (np.take(z, b, axis) > 0)
        rows, columns = np.nonzero(broken)
        found[rows, columns] = True
        found[rows + (axis == 0), columns + (axis == 1)] = True
    return grown(found, reach - 1)


def grown(mask: np.ndarray, by: int) -> np.ndarray:
    """The mask with `by` rings of neighbours more, corners included."""
    for _ in range(by):
        wide = np.pad(mask, 1)
        mask = wide[1:-1, 1:-1].copy()
        for row in (0, 1, 2):
            for column in (0, 1, 2):
                mask |= wide[row : row + mask.shape[0], column : column + mask.shape[1]]
    return mask


def decibels(actual: np.ndarray, truth: np.ndarray, where: np.ndarray) -> float:
    """actual (h, w, 3|4) uint8 against truth (h, w, 3) linear, both as sRGB."""
    error = actual[where][:, :3].astype(float) - encode(np.clip(truth[where], 0, 1))
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-6)))


def linear(image: np.ndarray) -> np.ndarray:
    return decode(image[..., :3].astype(float))


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Intersection over union; 1 of two empty masks."""
    return float((one & other).sum() / max((one | other).sum(), 1)) if (one | other).any() else 1.0


def occluder(hits: Hits, light: ps.Light, surfaces: Sequence[TracedSurface]) -> tuple[np.ndarray, np.ndarray]:
    """Which hits lie in the shadow of a surface, (h, w), and the points that shade them, (h, w, 3)."""
    if light.position is not None:
        origin = np.array(light.position)
    else:
        origin = -FAR * np.array(light.direction) / np.linalg.norm(np.array(light.direction))
    rays = hits.points - origin
    nearest = np.full(hits.depth.shape, np.inf)
    for surface in surfaces:
        nearest = np.minimum(nearest, surface.meet(origin, rays)[0])
    shaded = (hits.surface >= 0) & (nearest * np.linalg.norm(rays, axis=-1) < np.linalg.norm(rays, axis=-1) - CONTACT)
    return shaded, origin + np.where(shaded, nearest, 1)[..., None] * rays
