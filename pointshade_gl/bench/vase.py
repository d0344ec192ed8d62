"""The built-in vase as exact surfaces: tulips and daisies in a vase. One of the measured scenes.

Metres, y up, origin where the vase stands. assets/make_vase.py paints it and takes the built-in pictures.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.polynomial import Polynomial

from ..scene.camera import orbit_pose
from .solids import Paint, Sample, Vector, around, axes, ellipsoid, grey, nearest, ramp, solid
from .tracing import Array, Surface

UPRIGHT = np.array([(1, 0, 0, 0), (0, -1, 0, 0.272), (0, 0, -1, 1), (0, 0, 0, 1.0)])  # y down, as in a camera
VASE_POSE = orbit_pose(UPRIGHT, (0, 0.272, 0), pitch=13)  # of the camera that takes it

HEIGHT, WALL = 0.33, 0.0028  # of the vase; half the thickness of its wall
HEIGHTS = (0, 0.012, 0.035, 0.08, 0.13, 0.175, 0.215, 0.25, 0.285, 0.315, HEIGHT)
RADII = (0.06, 0.058, 0.058, 0.084, 0.109, 0.105, 0.078, 0.052, 0.044, 0.055, 0.072)
PROFILE = Polynomial.fit(HEIGHTS, RADII, 9)  # a polynomial has no seam at which a highlight would break
SLOPE = PROFILE.deriv()


def vase(p: Array) -> Sample:
    """A shell around PROFILE, thicker at its lip."""
    y, r = np.clip(p[..., 1] - WALL, 0, HEIGHT), np.hypot(p[..., 0], p[..., 2])
    across = (r - PROFILE(y)) / np.sqrt(1 + SLOPE(y) ** 2)
    lip = 0.002 * np.exp(-(((y - HEIGHT) / 0.008) ** 2))
    return np.hypot(across, p[..., 1] - WALL - y) - WALL - lip, (across,)


def table(p: Array) -> Sample:
    """A wooden disc with a rounded edge, 36 cm wide, its top at y = 0."""
    x, y = np.hypot(p[..., 0], p[..., 2]) - 0.171, np.abs(p[..., 1] + 0.011) - 0.002
    return np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0) - 0.009, ()


def leaf(curve: Array, width: float, side: Vector, paint: Paint, thick: float = 0.0019) -> Surface:
    """A blade along a curve, folded along its middle; `side` points across it. Without width it is a stem."""

    def shape(p: Array) -> Sample:
        t, offset, tangent = nearest(curve, p)
        x, y, z = (axes(np.cross(tangent, side), tangent) @ offset[..., None])[..., 0].T
        half = width * (0.1 + np.sin(np.pi * t**0.9) ** 1.3) * (1 - t**6)
        lift = y - 0.35 * (np.sqrt(x * x + 1e-5) - 0.003) + 0.12 * x * np.sin(9 * t)
        return np.sqrt(np.maximum(np.abs(x) - half, 0) ** 2 + z * z + lift * lift) - thick, (x, t)

    return solid(shape, curve, width + thick, paint=paint)


def tulip(head: Array, up: Array, size: float, turn: float, paint: Paint) -> Surface:
    """Two rings of three pointed petals on an egg."""

    def shape(p: Array) -> Sample:
        y, rho, phi = around(p / size, head / size, up)
        h, ring = np.clip(y, 0, 1), np.array([[0], [1]])
        f = (phi + turn + ring * np.pi / 3) % (2 * np.pi / 3) - np.pi / 3  # from the petal's middle
        half = 0.44 * (1 - h**3.2)
        egg = np.hypot(rho / (0.385 - 0.03 * ring), (y - 0.4) / np.where(y < 0.4, 0.4, 0.92)) - 1
        lift = 0.38 * egg - 0.09 * h**5 + 0.05 * f * f * (1 - ring) + 0.012 * np.exp(-((f / 0.12) ** 2))
        over = np.hypot(np.maximum(rho * np.abs(f) - half, 0), np.maximum(y - 1, 0))
        petals, edges = np.hypot(lift, over), rho * np.abs(f) / np.maximum(half, 0.02)
        return (np.minimum(*petals) - 0.018) * size, (petals, edges, h, turn)

    return solid(shape, head[None], 1.2 * size, paint=paint)


def daisy(head: Array, up: Array, size: float, turn: float, paint: Paint) -> Surface:
    """Two rings of petals around a domed heart."""

    def shape(p: Array) -> Sample:
        y, rho, phi = around(p / size, head / size, up)
        place, ring = phi / (2 * np.pi) * 13, np.array([[0], [0.5]])
        f = ((place + ring) % 1 - 0.5) * 2 * np.pi / 13  # from the petal's middle
        odd = np.sin(5 * phi + turn) * np.sin(3 * phi + 2 * turn)  # no two petals rise equally
        x, z = rho * np.cos(f), rho * np.sin(f)
        lift = y - 0.25 * x * x + 0.18 * ring - 0.09 * odd * x + 0.014 * np.cos(42 * z) - 0.4 * z * z
        petals = ellipsoid(np.stack([x - 0.58, lift, z], -1), (0.42, 0.045, 0.15))
        spirals = np.sin(8 * phi + 26 * rho) * np.sin(13 * phi - 20 * rho) * ramp(rho, 0.02, 0.15)
        heart = ellipsoid(np.stack([rho, y - 0.02], -1), (0.27, 0.15)) - 0.009 * spirals
        return np.minimum(np.minimum(*petals), heart) * size, (petals, heart, ring, x, z, rho, spirals)

    return solid(shape, head[None], 1.12 * size, paint=paint)


def vase_scene(**paints: Paint) -> list[Surface]:
    """All parts: the vase, the table, then the flowers. paints: by the names of what they are for; others are grey."""
    paint = defaultdict(lambda: grey, paints)
    parts = [
        solid(vase, np.array([[0, 0.17, 0]]), 0.2, 0.8, paint["vase"]),
        solid(table, np.zeros((1, 3)), 0.2, 0.9, paint["table"]),
    ]
    flowers = (
        (tulip, (-0.08, 0.41, -0.02), (-0.17, 0.465, -0.03), (-9, 5.5, -1), 0.13, 0.3, "coral"),
        (tulip, (-0.03, 0.42, -0.03), (-0.06, 0.478, -0.06), (-3, 6.5, -3), 0.135, 0.9, "plum"),
        (tulip, (0.04, 0.42, -0.02), (0.085, 0.48, -0.05), (4.5, 6, -3), 0.135, 2.2, "coral"),
        (tulip, (0.09, 0.4, -0.01), (0.19, 0.445, -0.02), (10, 4.5, -1), 0.125, 0.7, "plum"),
        (daisy, (-0.05, 0.42, 0), (-0.135, 0.405, 0.05), (-0.3, 0.35, 1), 0.082, 1, "white"),
        (daisy, (0, 0.42, 0), (0.01, 0.44, 0.1), (0.02, 0.45, 1), 0.082, 2, "apricot"),
        (daisy, (0.06, 0.42, 0), (0.145, 0.38, 0.07), (0.2, 0.25, 1), 0.078, 3, "white"),
    )
    for kind, knee, head, up, size, turn, color in flowers:
        curve = np.array([(0.3 * knee[0], 0.3, knee[2]), knee, head])
        parts.append(leaf(curve, 0, (0, 0, 1), paint["leaf"], 0.0036))
        parts.append(kind(curve[2], np.array(up), size, turn, paint[color]))
    for knee, tip, width, side in (
        ((-0.1, 0.5, 0), (-0.29, 0.36, 0.02), 0.027, (0.6, 1, 0.3)),
        ((0.1, 0.5, 0), (0.29, 0.33, 0.02), 0.027, (-0.6, 1, 0.3)),
        ((0, 0.5, -0.05), (0.01, 0.605, -0.08), 0.028, (1, 0, 0.3)),
        ((-0.03, 0.45, -0.05), (-0.25, 0.53, -0.06), 0.028, (1, 0.5, 0.2)),
        ((0.04, 0.45, -0.05), (0.22, 0.56, -0.06), 0.028, (1, -0.5, 0.2)),
        ((-0.09, 0.43, 0.03), (-0.16, 0.26, 0.09), 0.022, (1, 0.4, -0.3)),
    ):
        parts.append(leaf(np.array([(0.06 * tip[0], 0.3, 0), knee, tip]), width, side, paint["leaf"]))
    return parts
