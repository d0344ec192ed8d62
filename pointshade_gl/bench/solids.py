"""Shapes by their signed distance, sphere-traced, and a few functions to bend them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .tracing import Array, Surface

Vector = tuple[float, ...] | Array
Sample = tuple[Array, tuple[Any, ...]]  # of points: the signed distances, and what their paint asks for
Paint = Callable[..., Array]  # of points and what the shape says of them: their albedos


def grey(points: Array, *_: Any) -> Array:
    return np.full(points.shape, 0.6)


def ramp(x: Array, start: float, end: float) -> Array:
    """0 before `start`, 1 after `end`, smooth between."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def ellipsoid(p: Array, radii: Vector) -> Array:
    """The approximate distance to an ellipsoid at the origin (Quilez 2008)."""
    k0, k1 = np.linalg.norm(p / radii, axis=-1), np.linalg.norm(p / np.square(radii), axis=-1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-12)


def solid(
    shape: Callable[[Array], Sample], hull: Array, margin: float, caution: float = 0.4, paint: Paint = grey
) -> Surface:
    """A sphere-traced surface that stays within `margin` of the points `hull`.

    Each step is `caution` times the distance, because the distance of most shapes is only approximate.
    """
    centre = np.mean(hull, 0)
    radius = np.linalg.norm(hull - centre, axis=-1).max() + margin

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        result, normals = np.full(rays.shape[:-1], np.inf), np.zeros(rays.shape)
        a, b = (rays * rays).sum(-1), rays @ (centre - origin)
        q = b * b - a * (((centre - origin) ** 2).sum() - radius**2)
        index = np.flatnonzero(q > 0)
        a, b, q, ahead = a.flat[index], b.flat[index], q.flat[index], rays.reshape(-1, 3)[index]
        t, end = (b - np.sqrt(q)) / a, (b + np.sqrt(q)) / a
        for _ in range(400):
            d = shape(origin + t[:, None] * ahead)[0]
            result.flat[index[np.abs(d) < 1e-9]] = t[np.abs(d) < 1e-9]
            t = t + caution * d / np.sqrt(a)
            on = (np.abs(d) >= 1e-9) & (t < end)
            index, t, end, a, ahead = index[on], t[on], end[on], a[on], ahead[on]
        close = np.abs(shape(origin + t[:, None] * ahead)[0]) < 1e-6  # grazing rays never arrive
        result.flat[index[close]] = t[close]
        hit = np.isfinite(result)
        at = origin + result[hit][:, None] * rays[hit]
        gradient = np.stack([shape(at + e)[0] - shape(at - e)[0] for e in 1e-6 * np.eye(3)], -1)
        normals[hit] = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return result, normals

    return Surface(meet, lambda p: paint(p, *shape(p)[1]))


def nearest(curve: Array, p: Array) -> tuple[Array, Array, Array]:
    """The nearest place to p on a quadratic Bezier curve (3, 3): parameter, offset to p, tangent."""
    a, b, c = curve[0], 2 * (curve[1] - curve[0]), curve[0] - 2 * curve[1] + curve[2]
    starts = np.linspace(0, 1, 9)[:, None]
    away = p[..., None, :] - (a + starts * (b + starts * c))
    t = starts[np.argmin((away * away).sum(-1), -1)]
    for _ in range(4):  # Newton
        offset, tangent = p - (a + t * (b + t * c)), b + 2 * t * c
        bend = (tangent * tangent - 2 * offset * c).sum(-1, keepdims=True)
        t = np.clip(t + (offset * tangent).sum(-1, keepdims=True) / np.maximum(bend, 1e-3), 0, 1)
    return t[..., 0], p - (a + t * (b + t * c)), b + 2 * t * c


def axes(up: Vector, ahead: Vector) -> Array:
    """(..., 3, 3) right-handed unit axes in rows: the second is `up`, the third points roughly ahead."""
    x = np.cross(up, ahead)
    rows = np.stack([x, up + 0 * x, np.cross(x, up)], -2)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def around(p: Array, origin: Array, up: Array) -> tuple[Array, Array, Array]:
    """Height, radius and angle about an axis through `origin`."""
    x, y, z = axes(up, (0.1, 0.3, 1)) @ (p - origin).T
    return y, np.hypot(x, z), np.arctan2(z, x)
