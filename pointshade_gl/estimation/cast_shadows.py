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
    lengths = np.linalg.norm(rays, axis=-1)
    away = surfaces[..., 3] * lengths
    axes = _axes(np.array(towards), rays.mean((0, 1))).astype(np.float32)
    along = (rays / lengths[..., None]) @ axes.T
    slant = np.arccos(np.clip(along[..., 0], -1, 1))
    turn = np.arctan2(along[..., 2], along[..., 1])
    slants = _steps(slant, pixel, MOST * (height + width))
    turns = _steps(turn, pixel / max(float(np.sin(slant).max()), 1e-3), MOST * (height + width))
    horizon = _horizon(away, rays, axes, slants, turns)
    column, row = (
        np.rint((at - steps[0]) / (steps[1] - steps[0])).astype(int) for at, steps in ((slant, slants), (turn, turns))
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        below = (away - horizon[row, column] / np.sin(slant)) / (away * pixel)
    return np.where(surfaces[..., 3] > 0, 1 - np.clip(np.nan_to_num(below, nan=-1.0) / (2 * MARGIN) + 0.5, 0, 1), 1)


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
    sine = np.sin(slants)[None, :, None]
    ways = np.cos(turns)[:, None, None] * axes[1] + np.sin(turns)[:, None, None] * axes[2]
    ways = np.cos(slants)[None, :, None] * axes[0] + sine * ways
    with np.errstate(divide="ignore", invalid="ignore"):
        places = [
            np.rint((ways[..., k] / ways[..., 2] - rays[0, 0, k]) * ((count - 1) / (rays[-1, -1, k] - rays[0, 0, k])))
            for k, count in ((0, width), (1, height))
        ]
    inside = (ways[..., 2] > 0) & (places[0] >= 0) & (places[0] < width) & (places[1] >= 0) & (places[1] < height)
    column, row = (np.where(inside, at, 0).astype(int) for at in places)
    depth = away[row, column]
    least = np.where(inside & (depth > 0), depth * sine[..., 0], np.inf)
    before = np.minimum.accumulate(least, 1)[:, :-1]
    return np.concatenate([np.full((len(turns), 1), np.inf), before], 1)
