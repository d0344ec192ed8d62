"""The triangles between the pixels of a frame, drawn on the CPU: what squares.glsl and GL do around grid.glsl.

Triangles that reach behind the near plane are left out; GL cuts them there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..camera import Camera
from ..estimators import Step
from .camera import pixel_ray, project
from .grid import FIRST, SECOND, square_triangles, triangle_normal, vertex_corner
from .vectors import texel

F = np.float32
SNAP = 256  # places of a vertex between two pixels, of most drivers
DEPTH_STEPS = float(2**24 - 1)  # the depth buffer is 24-bit fixed point


class Triangles(NamedTuple):
    """m triangles between pixels."""

    pixels: np.ndarray  # (m, 3, 2) int, their corners
    points: np.ndarray  # (m, 3, 3) float32, source axes
    is_whole: np.ndarray  # (m,) bool: the square has both


class Fragments(NamedTuple):
    """What n pixels of a view show."""

    pixel: np.ndarray  # (n, 2) int
    triangle: np.ndarray  # (n,) int
    share: np.ndarray  # (n, 3) float32, of the triangle's corners
    window: np.ndarray  # (n,) float64, 1 - near/z as a depth buffer keeps it


def triangles_of(surface_map: np.ndarray, source: Camera, max_step: Step) -> Triangles:
    """All triangles of a frame; surface_map (h, w, 4), unit normal and depth."""
    corners = surface_map[:-1, :-1], surface_map[:-1, 1:], surface_map[1:, :-1], surface_map[1:, 1:]
    intrinsics, (height, width) = np.array(source.intrinsics, F), corners[0].shape[:2]
    square = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    codes = square_triangles(*corners, square.astype(F), intrinsics, np.array(max_step, F))
    vertices = np.stack([square + vertex_corner(codes, k) for k in range(4)], -2)
    pixels = vertices[:, :, [(0, 1, 2), (3, 2, 1)]]
    exists = np.stack([codes & FIRST, codes & SECOND], -1) != 0
    whole = np.broadcast_to(exists.all(-1, keepdims=True), exists.shape)
    pixels = pixels[exists]
    points = pixel_ray(pixels.astype(F), intrinsics) * texel(surface_map, pixels)[..., 3:]
    return Triangles(pixels, points, whole[exists])


def fragments(points: np.ndarray, view: np.ndarray, target: Camera, near: float) -> Fragments:
    """The nearest of the triangles (m, 3, 3), source axes, at each pixel of a view; (4, 4) source to target axes."""
    seen = points.astype(float) @ view[:3, :3].T.astype(float) + view[:3, 3]
    ahead = np.flatnonzero((seen[..., 2] > near).all(-1))
    seen = seen[ahead]
    place = project(seen, np.array(target.intrinsics))
    snapped = np.round(place * SNAP) / SNAP
    low = np.maximum(np.ceil(snapped.min(1)), 0).astype(int)
    high = np.minimum(np.floor(snapped.max(1)), [target.width - 1, target.height - 1]).astype(int)
    across, down = np.maximum(high - low + 1, 0).T
    which = np.repeat(np.arange(len(seen)), across * down)
    k = np.arange(len(which)) - np.repeat(np.cumsum(across * down) - across * down, across * down)
    q = low[which] + np.stack([k % np.maximum(across[which], 1), k // np.maximum(across[which], 1)], -1)
    inside = _covers(snapped[which], q)
    which, q = which[inside], q[inside]
    share = _areas(place[which], q) / _double_area(place[which])[:, None] / seen[which][..., 2]
    inverse_depth = share.sum(-1)
    window = np.round((1 - near * inverse_depth) * DEPTH_STEPS) / DEPTH_STEPS
    order = np.lexsort((which, window))[::-1]  # farthest first: the nearest writes last and stays
    nearest = np.full((target.height, target.width), -1)
    nearest[q[order, 1], q[order, 0]] = order
    kept = nearest[nearest >= 0]
    return Fragments(q[kept], ahead[which[kept]], (share[kept] / inverse_depth[kept, None]).astype(F), window[kept])


def interpolate(values: np.ndarray, drawn: Fragments) -> np.ndarray:
    """(n, k) at each fragment, from (m, 3, k) at the corners of the triangles."""
    return (values[drawn.triangle] * drawn.share[..., None]).sum(1).astype(F)


def middles(triangles: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """Where triangles are lit once: points (m, 3) and unit normals (m, 3), source axes."""
    p, q, r = np.moveaxis(triangles.points, 1, 0)
    return (p + q + r) / F(3), triangle_normal(p, q, r)


def _areas(corners: np.ndarray, q: np.ndarray) -> np.ndarray:
    """(n, 3) twice the area between a place (n, 2) and the edge opposite each corner of (n, 3, 2), with a sign."""
    start, end = np.roll(corners, -1, 1), np.roll(corners, -2, 1)
    edge, away = end - start, q[:, None] - start
    return edge[..., 0] * away[..., 1] - edge[..., 1] * away[..., 0]


def _double_area(corners: np.ndarray) -> np.ndarray:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _covers(corners: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Whether the pixels' centres (n, 2) lie inside; of those on an edge, on a left one or a top one."""
    turn = np.sign(_double_area(corners))[:, None]
    edge = turn[..., None] * (np.roll(corners, -2, 1) - np.roll(corners, -1, 1))
    owns = (edge[..., 1] < 0) | ((edge[..., 1] == 0) & (edge[..., 0] > 0))
    area = turn * _areas(corners, q)
    return ((area > 0) | ((area == 0) & owns)).all(-1) & (turn[:, 0] != 0)
