"""Surfaces as vertices (n, 3) and faces, in metres, z up. NumPy only: Blender's Python reads this too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Shape(NamedTuple):
    """vertices (n, 3) float64; faces (m, 4) int, quads; the last index repeats the third in a triangle."""

    vertices: np.ndarray
    faces: np.ndarray

    def moved(self, to=(0, 0, 0), turn: float = 0.0) -> Shape:
        """Turned round the vertical by degrees, then shifted."""
        a = np.radians(turn)
        matrix = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        return Shape(self.vertices @ matrix.T + to, self.faces)


def box(size, middle=(0, 0, 0), turn: float = 0.0) -> Shape:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return Shape(corners, faces).moved(middle, turn)


def grid(points: np.ndarray, around: bool = False, along: bool = False) -> Shape:
    """Quads between neighbours of points (rows, columns, 3); closed around the columns, along the rows."""
    rows, columns = points.shape[:2]
    i, j = np.meshgrid(np.arange(rows - (not along)), np.arange(columns - (not around)), indexing="ij")
    k, m = (i + 1) % rows, (j + 1) % columns
    corners = [i * columns + j, i * columns + m, k * columns + m, k * columns + j]
    return Shape(points.reshape(-1, 3), np.stack(corners, -1).reshape(-1, 4))


def lathe(profile, sides: int = 192) -> Shape:
    """What turns round the z axis: profile (n, 2) of radii and heights."""
    r, z = np.array(profile, float).T
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rows = (r[:, None] * np.cos(a), r[:, None] * np.sin(a), np.repeat(z[:, None], sides, 1))
    return grid(np.stack(rows, -1), around=True)


def disc(radius: float, height: float = 0.0) -> Shape:
    return lathe([(0, height), (radius, height)], 96)


def ball(radius: float, middle=(0, 0, 0), sides: int = 256) -> Shape:
    a = np.linspace(-np.pi / 2, np.pi / 2, sides // 2 + 1)
    return lathe(radius * np.stack([np.cos(a), np.sin(a)], -1), sides).moved(middle)


def tube(path, radius, sides: int = 48, closed: bool = False) -> Shape:
    """A round tube along path (n, 3); radius is one number or (n,). Open ends get lids."""
    path, radius = np.array(path, float), np.broadcast_to(radius, len(path))
    ahead = np.gradient(path, axis=0)
    if closed:
        ahead = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    across, up = _frames(ahead, closed)
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    rings = [p + r * (np.cos(a) * x + np.sin(a) * y) for p, r, x, y in zip(path, radius, across, up, strict=True)]
    if not closed:
        rings = [np.repeat(path[:1], sides, 0), *rings, np.repeat(path[-1:], sides, 0)]
    return grid(np.stack(rings), around=True, along=closed)


def _frames(ahead: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Two axes across the path at each point; they turn as little as possible, and meet again where it is closed."""
    start = np.cross(ahead[0], (0, 0, 1) if abs(ahead[0, 2]) < 0.9 else (1, 0, 0))
    across = [start / np.linalg.norm(start)]
    for t in [*ahead[1:], ahead[0]]:
        x = across[-1] - (across[-1] @ t) * t
        across.append(x / np.linalg.norm(x))
    last, across = across[-1], np.array(across[:-1])
    up = np.cross(ahead, across)
    if closed:
        a = np.arctan2(last @ up[0], last @ across[0]) * np.linspace(0, -1, len(ahead), endpoint=False)[:, None]
        across, up = np.cos(a) * across + np.sin(a) * up, np.cos(a) * up - np.sin(a) * across
    return across, up


def rod(start, end, radius: float) -> Shape:
    return tube(np.linspace(start, end, 3), radius)


def ring(radius: float, thickness: float, middle=(0, 0, 0), lean: float = 0.0) -> Shape:
    """A torus; lean tips it round the x axis, in degrees."""
    a, b = np.linspace(0, 2 * np.pi, 192, endpoint=False), np.radians(lean)
    flat = radius * np.stack([np.cos(a), np.sin(a), 0 * a], -1)
    tipped = np.stack([flat[:, 0], np.cos(b) * flat[:, 1], np.sin(b) * flat[:, 1]], -1)
    return tube(tipped + middle, thickness, closed=True)


def knot(size: float, thickness: float, middle=(0, 0, 0), turns=(2, 3)) -> Shape:
    """A torus knot that stands upright."""
    a = np.linspace(0, 2 * np.pi, 480, endpoint=False)
    p, q = turns
    r = 1 + 0.42 * np.cos(q * a)
    path = np.stack([r * np.cos(p * a), 0.42 * np.sin(q * a), r * np.sin(p * a)], -1) * size / 1.42
    return tube(path + middle, thickness, closed=True)


def head(height: float, nose: float, sides: int = 256) -> Shape:
    """A head on a neck that looks along -y: an egg with a nose, eye sockets, a brow and a chin."""
    v, u = np.meshgrid(np.linspace(-np.pi / 2, np.pi / 2, sides // 2 + 1), np.linspace(-np.pi, np.pi, sides, False))
    v, u = v.T, u.T

    def bump(at_u, at_v, wide_u, wide_v):
        return np.exp(-(((u - at_u) / wide_u) ** 2) - ((v - at_v) / wide_v) ** 2)

    r = 1 + nose * bump(0, -0.12, 0.13, 0.22) + 0.05 * bump(0, 0.32, 0.6, 0.1) + 0.09 * bump(0, -0.8, 0.3, 0.16)
    r -= 0.1 * (bump(-0.36, 0.1, 0.16, 0.12) + bump(0.36, 0.1, 0.16, 0.12)) + 0.05 * bump(0, -0.5, 0.28, 0.04)
    x, y, z = r * np.cos(v) * np.sin(u), -r * np.cos(v) * np.cos(u), r * np.sin(v)
    skull = grid(np.stack([0.37 * x, 0.45 * y, 0.5 * z + 0.5], -1) * height, around=True)
    neck = lathe(np.array([(0.2, 0.3), (0.17, 0.05), (0.3, -0.12), (0.36, -0.25), (0, -0.25)]) * height)
    return joined(skull.moved((0, 0, 0.25 * height)), neck.moved((0, 0.06 * height, 0.25 * height)))


def cup(radius: float, height: float, wall: float) -> Shape:
    """With a hollow and a handle along +x."""
    out, low = radius, 0.75 * radius
    body = [(0, 0), (low, 0), (out, height), (out - wall, height), (low - wall, wall), (0, wall)]
    a = np.linspace(-0.42 * np.pi, 0.42 * np.pi, 40)
    handle = np.stack([0.8 * radius + 0.75 * radius * np.cos(a), 0 * a, height * (0.52 + 0.36 * np.sin(a))], -1)
    return joined(lathe(body), tube(handle, 0.5 * wall + 0.03 * radius, 24))


def leaf(length: float, width: float, lift: float, droop: float) -> Shape:
    """A thin curved sheet along +x, up by lift and down again by droop, shares of its length."""
    s, t = np.meshgrid(np.linspace(0, 1, 41), np.linspace(-1, 1, 17), indexing="ij")
    half = width * np.sin(np.pi * s**0.8) * 0.5 + 0.01 * length
    z = length * (lift * s - droop * s**2.5) + 0.35 * half * np.abs(t)
    return grid(np.stack([length * s * np.sqrt(1 - 0.5 * lift**2), half * t, z], -1))


def joined(*shapes: Shape) -> Shape:
    starts = np.cumsum([0, *(len(shape.vertices) for shape in shapes[:-1])])
    faces = [shape.faces + start for shape, start in zip(shapes, starts, strict=True)]
    return Shape(np.concatenate([shape.vertices for shape in shapes]), np.concatenate(faces))
