"""Finds the shadows that a depth picture casts onto itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .light_pairs import Array

MARGIN = 0.5  # samples below the horizon: so far is lit for certain; as far again is not
MOST = 4  # times the picture's sides: cells of the picture around the light


def visible_light(surfaces: Array, rays: Array, towards: tuple[float, float, float]) -> Array:
    """Return (h, w), 0..1, whether light from a direction reaches each sample past the others.

    In the angles around the direction of the light, its beams are straight rows, on which the distance from the axis
    through the eye stays the same. A sample lies in shadow where one nearer to the light is nearer to that axis.

    surfaces  (h, w, 4) normals and depth; 0 where unknown
    rays      (h, w, 3) from the camera through the samples, z = 1
    """
    height, width = surfaces.shape[:2]
    pixel = float(np.hypot(*(rays[-1, -1] - rays[0, 0])[:2]) / max(np.hypot(height - 1, width - 1), 1))
    if not pixel:
        return np.ones((height, width), np.float32)
    lengths = np.sqrt(np.square(rays) @ np.ones(3, np.float32))
    away = surfaces[..., 3] * lengths
    axes = _axes(np.array(towards), (rays[0, 0] + rays[-1, -1]) / 2).astype(np.float32)
    first, second, third = np.moveaxis(rays @ axes.T, -1, 0)
    cosine = np.clip(first / lengths, -1, 1)
    slant, sine = np.arccos(cosine), np.sqrt(1 - cosine**2)
    turn = np.arctan2(third, second)
    slants = _steps(slant, pixel, MOST * (height + width))
    turns = _steps(turn, pixel / max(float(sine.max()), 1e-3), MOST * (height + width))
    horizon = _horizon(away, rays, axes, slants, turns)
    column, row = (np.rint((at - steps[0]) / (steps[1] - steps[0])) for at, steps in ((slant, slants), (turn, turns)))
    nearest = horizon.take((row * horizon.shape[1] + column).astype(int))
    with np.errstate(invalid="ignore", divide="ignore"):
        below = (away - nearest / sine) / (away * pixel)
    below = np.clip(np.nan_to_num(below, nan=-1.0) / (2 * MARGIN) + 0.5, 0, 1)
    return np.where(surfaces[..., 3] > 0, 1 - below, np.float32(1))


def _axes(towards: NDArray[np.float64], view: Array) -> NDArray[np.float64]:
    """Return (3, 3): the direction of the light, the part of the view across it, and what is left."""
    first = towards / np.linalg.norm(towards)
    across = view - first * (first @ view)
    if np.linalg.norm(across) < 1e-6:
        across = np.cross(first, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    return np.stack([first, across, np.cross(first, across)])


def _steps(angles: Array, step: float, most: int) -> Array:
    """Return angles at even steps over a range; at least two."""
    low, high = float(angles.min()), float(angles.max())
    count = int(np.clip(np.ceil((high - low) / step), 1, most)) + 1
    return np.linspace(low, low + max(high - low, step), count, dtype=np.float32)


def _horizon(away: Array, rays: Array, axes: Array, slants: Array, turns: Array) -> Array:
    """Return (turns, slants) the least distance from the axis of what lies nearer to the light; infinite if nothing."""
    height, width = away.shape
    cosine, sine = np.cos(slants), np.sin(slants)
    sides = np.outer(np.cos(turns), axes[1]) + np.outer(np.sin(turns), axes[2])
    x, y, z = (cosine * axes[0, k] + sine * sides[:, k, None] for k in range(3))
    with np.errstate(divide="ignore", invalid="ignore"):
        column, row = (
            np.rint((way / z - rays[0, 0, k]) * ((count - 1) / (rays[-1, -1, k] - rays[0, 0, k])))
            for k, way, count in ((0, x, width), (1, y, height))
        )
        place = row * width + column
    inside = (z > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    depth = away.take(np.where(inside, place, 0).astype(int))
    least = np.full((len(turns), len(slants) + 1), np.inf, np.float32)
    least[:, 1:] = np.where(inside & (depth > 0), depth * sine, np.inf)
    return np.minimum.accumulate(least[:, :-1], 1)
