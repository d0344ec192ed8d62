"""Frames whose depth is smaller than their colours, with the truth at the colours' size."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.scenes import box, pose_at
from pointshade_gl.bench.tracing import Hits, TracedSurface, encode, moved_surface, plane, sphere, trace

RATIO = 7.5  # pixels of the colours along a sample of the depth
DEPTH = 160, 120
COLOR = 1200, 900
LARGE = ps.Camera(984, 984, 599.5, 449.5, *COLOR)
SMALL = LARGE.resized(*DEPTH)


class Known(NamedTuple):
    """A frame, and what a perfect camera would have seen: from where the frame was taken, and from the side."""

    frame: ps.Frame
    hits: Hits
    surfaces: list[TracedSurface]


def painted(surface: TracedSurface, seed: int, contrast: float) -> TracedSurface:
    """With two colours of its own that alternate in checks; contrast is that between surfaces."""
    rng = np.random.default_rng(seed)
    base = 0.5 + contrast * rng.uniform(-0.4, 0.4, 3)
    pair = np.clip(np.stack([base, base + contrast * rng.uniform(-0.15, 0.15, 3)]), 0.02, 0.98)

    def albedo(points: np.ndarray) -> np.ndarray:
        return pair[(np.floor(points * 6).sum(-1) % 2).astype(int)]

    return TracedSurface(surface.meet, albedo)


def things(seed: int, contrast: float) -> list[TracedSurface]:
    """A slanted wall, and before it two balls and a box at random places."""
    rng = np.random.default_rng(seed)
    shapes = [plane((rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), -1), (0, 0, 2.5), np.ones_like)]
    for x in (-0.4, 0.35):
        shapes.append(sphere((x, rng.uniform(-0.2, 0.2), rng.uniform(1.2, 1.8)), rng.uniform(0.15, 0.3), np.ones_like))
    place = pose_at((0, rng.uniform(-0.2, 0.2), 1.5), rng.uniform(-40, 40), rng.uniform(-30, 30))
    shapes.append(moved_surface(box(rng.uniform(0.1, 0.25, 3)), place))
    return [painted(shape, 10 * seed + k, contrast) for k, shape in enumerate(shapes)]


@cache
def clean(seed: int, contrast: float = 1.0) -> Known:
    """Depth as a perfect camera sees it at its samples' middles."""
    surfaces = things(seed, contrast)
    hits = trace(surfaces, LARGE)
    color = np.round(encode(hits.albedo)).astype(np.uint8)
    return Known(ps.Frame(color, trace(surfaces, SMALL).depth, SMALL), hits, surfaces)


@cache
def lidar(seed: int) -> Known:
    """Depth by wide beams: the mean over 2x2 samples, with noise of 0.4 %."""
    known = clean(seed)
    depth = box_mean(known.hits.depth, round(2 * RATIO))
    row, column = ((np.arange(n) + 0.5) * RATIO for n in DEPTH[::-1])
    depth = depth[np.ix_(row.astype(int), column.astype(int))]
    noise = np.random.default_rng(seed).normal(1, 0.004, depth.shape)
    return known._replace(frame=ps.Frame(known.frame.color, depth * noise, SMALL))


def cropped(frame: ps.Frame) -> ps.Frame:
    """The middle of a frame: 56x40 samples under 420x300 pixels."""
    left, top, (width, height) = 52, 40, (56, 40)
    c = frame.camera
    camera = ps.Camera(c.fx, c.fy, c.cx - left, c.cy - top, width, height)
    rows, columns = (slice(round(n * RATIO), round((n + m) * RATIO)) for n, m in ((top, height), (left, width)))
    return ps.Frame(frame.color[rows, columns], frame.depth[top : top + height, left : left + width], camera)


def box_mean(values: np.ndarray, side: int) -> np.ndarray:
    """Means over squares of an odd side, the border repeated."""
    for axis in (0, 1):
        pad = [(0, 0), (0, 0)]
        pad[axis] = (side // 2 + 1, side // 2)
        sums = np.cumsum(np.pad(values, pad, mode="edge"), axis)
        n = values.shape[axis]
        values = (np.take(sums, np.arange(side, side + n), axis) - np.take(sums, np.arange(n), axis)) / side
    return values
