"""The light that a picture was taken in: one direction and ambient light, fitted to its colours and normals.

Pairs of pixels of the same hue mostly show the same material: that their normals are lit differently explains their
brightness. Few of the pairs deceive, and a robust fit passes over these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)
DARK = 0.004  # linear light that is mostly noise
PAIRS = 12_000
REACH = 0.1  # of a picture's width: standard deviation of the way between the pixels of a pair
ALIKE = 0.985  # cosine between normals that light cannot tell apart
HUE = 0.03  # difference of chromaticity between two materials
SPREAD = 0.12  # difference of log brightness that texture makes


@dataclass(frozen=True)
class FoundLight:
    """The light in a picture: that of a normal n is ambient + max(n . direction, 0), up to a factor.

    direction  (3,) unit, towards the light, camera axes
    ambient    strength of the ambient light over that of the direction
    white      the light that leaves colours as they are: only a twentieth of the picture has more
    tells      whether the picture shows its light well enough to divide it out
    why        what keeps it from telling
    """

    direction: tuple[float, float, float]
    ambient: float
    white: float
    tells: bool
    why: str = ""

    @property
    def values(self) -> tuple[float, float, float, float]:
        """Direction and ambient light, as the shaders take them."""
        return *self.direction, self.ambient


def fit_light(colors: Array, surfaces: Array) -> FoundLight:
    """The light in a picture.

    colors    (h, w, 4) linear RGB and 1, or 0 where unknown or clipped
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth
    """
    known = (colors[..., 3] > 0) & (colors[..., :3] @ LUMINANCE > DARK)
    n1, n2, off, weight = _pairs(colors, surfaces[..., :3], known, 0)
    if len(off) < 300:
        return FoundLight((0.0, 0.0, -1.0), 1e3, 1e3, False, "too few pixels")
    g = min((_refined(start, n1, n2, off, weight) for start in _starts(n1, n2, off, weight)), key=lambda x: x[0])[1]
    strength = float(np.linalg.norm(g))
    direction, ambient = g / strength, 1 / strength
    shading = ambient + np.maximum(surfaces[..., :3][known] @ direction, 0)
    white = float(np.percentile(shading, 95))
    x, y, z = direction.tolist()
    return FoundLight((x, y, z), ambient, white, ambient < 5)


def _pairs(colors: Array, normals: Array, known: NDArray[np.bool_], seed: int) -> tuple[Array, Array, Array, Array]:
    """Normals of both pixels, (n, 3) each, the log of their brightnesses' ratio, and weights, (n,) each."""
    chance = np.random.default_rng(seed)
    v, u = np.nonzero(known)
    if not len(v):
        return (np.zeros((0, 3), np.float32),) * 2 + (np.zeros(0, np.float32),) * 2
    first = chance.integers(0, len(v), 3 * PAIRS)
    way = np.rint(chance.normal(0, REACH * max(known.shape), (3 * PAIRS, 2))).astype(int)
    v2, u2 = v[first] + way[:, 0], u[first] + way[:, 1]
    inside = (v2 >= 0) & (u2 >= 0) & (v2 < known.shape[0]) & (u2 < known.shape[1])
    first, v2, u2 = first[inside], v2[inside], u2[inside]
    one, two = (v[first], u[first]), (v2, u2)
    good = known[two] & ((normals[one] * normals[two]).sum(-1) < ALIKE)
    one, two = (tuple(axis[good][:PAIRS] for axis in place) for place in (one, two))
    c1, c2 = colors[one][:, :3], colors[two][:, :3]
    hue = np.square(c1 / c1.sum(-1, keepdims=True) - c2 / c2.sum(-1, keepdims=True)).sum(-1)
    return normals[one], normals[two], np.log((c1 @ LUMINANCE) / (c2 @ LUMINANCE)), np.exp(-hue / HUE**2)


def _starts(n1: Array, n2: Array, off: Array, weight: Array) -> list[Array]:
    few = slice(0, 1500)
    k = np.arange(100) + 0.5
    turn, z = k * np.pi * (1 + 5**0.5), 1 - 2 * k / len(k)
    ring = np.sqrt(1 - z * z)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], -1).astype(np.float32)
    found = []
    d1, d2 = (np.maximum(n[few] @ directions.T, 0) for n in (n1, n2))
    for strength in (0.3, 1, 4, 12):
        miss = np.square(off[few, None] - np.log1p(strength * d1) + np.log1p(strength * d2))
        cost = weight[few] @ (miss / (miss + SPREAD**2))
        best = np.argsort(cost)[:2]
        found += [(cost[b], strength * directions[b]) for b in best]
    found.sort(key=lambda x: x[0])
    return [g for _, g in found[:3]]


def _refined(g: Array, n1: Array, n2: Array, off: Array, weight: Array) -> tuple[float, Array]:
    """Levenberg-Marquardt on the robust cost."""
    damping = 1e-2

    def look(g: Array) -> tuple[float, Array, Array, Array, Array]:
        d1, d2 = n1 @ g, n2 @ g
        miss = off - np.log1p(np.maximum(d1, 0)) + np.log1p(np.maximum(d2, 0))
        strength = float(np.linalg.norm(g))
        cost = float(weight @ (miss**2 / (miss**2 + SPREAD**2))) / float(weight.sum())
        return cost + 0.002 / (1 / max(strength, 1e-6) + 0.05), d1, d2, miss, weight

    cost, d1, d2, miss, _ = look(g)
    for _ in range(25):
        robust = weight * (SPREAD**2 / (miss**2 + SPREAD**2)) ** 2
        slope = n1 * ((d1 > 0) / (1 + np.maximum(d1, 0)))[:, None] - n2 * ((d2 > 0) / (1 + np.maximum(d2, 0)))[:, None]
        normal = (slope * robust[:, None]).T @ slope
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-6), (slope * robust[:, None]).T @ miss)
        new = (g + step).astype(np.float32)
        found = look(new)
        if found[0] < cost:
            done = cost - found[0] < 1e-6
            g, (cost, d1, d2, miss, _), damping = new, found, damping * 0.3
            if done:
                break
        else:
            damping *= 6
            if damping > 1e4:
                break
    return cost, g
