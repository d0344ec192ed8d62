"""The other shapes of the measured scenes, besides sphere, plane and solid, each in its own axes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..scene.camera import orbit_pose
from .solids import Sample, grey, solid
from .tracing import Array, Surface, patch

HALVINGS = 48  # of the interval in which a ray meets a height field: 1e-15 of a metre


def pose_at(centre: ArrayLike, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """A pose at `centre`, rolled about z, then turned like an orbiting camera. Angles in degrees."""
    a = np.radians(roll)
    pose = orbit_pose(None, (0, 0, 0), yaw, pitch).copy()
    pose[:2, :3] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]] @ pose[:2, :3]
    pose[:3, 3] = centre
    return pose


def box(half: ArrayLike, far: bool = False) -> Surface:
    """A box round the origin, by its half edges. far: where rays leave it, instead of where they enter."""
    size = np.asarray(half, float)

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = np.sort([(-size - origin) / rays, (size - origin) / rays], axis=0)
        enter, leave = sides[0].max(-1), sides[1].min(-1)
        t = leave if far else enter
        normals = np.eye(3)[sides[1].argmin(-1) if far else sides[0].argmax(-1)]
        return np.where((enter < leave) & (t > 0), t, np.inf), normals

    return Surface(meet, grey)


def sheet(half_width: float, low: float, high: float) -> Surface:
    """A strip of the plane z = 0, `low` to `high` along y."""
    return patch((0, (low + high) / 2, 0), (half_width, 0, 0), (0, (high - low) / 2, 0), grey)


def rod(radius: float, half_length: float) -> Surface:
    """An open cylinder along y."""

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        o, d = origin[[0, 2]], rays[..., [0, 2]]
        a, b = (d * d).sum(-1), -(d @ o)
        q = b * b - a * (o @ o - radius**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (b - np.sqrt(np.maximum(q, 0))) / a
        t = np.where((q > 0) & (t > 0) & (np.abs(origin[1] + t * rays[..., 1]) < half_length), t, np.inf)
        normals = np.zeros(rays.shape)
        normals[..., [0, 2]] = (o + np.where(np.isfinite(t), t, 0)[..., None] * d) / radius
        return t, normals

    return Surface(meet, grey)


def torus(ring: float, tube: float) -> Surface:
    """A ring round the y axis."""

    def shape(p: Array) -> Sample:
        across = np.hypot(p[..., 0], p[..., 2]) - ring
        return np.hypot(across, p[..., 1]) - tube, ()

    return solid(shape, np.zeros((1, 3)), ring + tube, caution=0.95)


def relief(height: Callable[[Array, Array], Array], low: float, high: float) -> Surface:
    """z = height(x, y), between `low` and `high`, seen roughly along z: each ray must meet it once."""

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        near, far = (low - origin[2]) / rays[..., 2], (high - origin[2]) / rays[..., 2]
        for _ in range(HALVINGS):
            half = (near + far) / 2
            x, y, z = origin[:, None, None] + half * np.moveaxis(rays, -1, 0)
            above = z < height(x, y)
            near, far = np.where(above, half, near), np.where(above, far, half)
        t = (near + far) / 2
        x, y, e = origin[0] + t * rays[..., 0], origin[1] + t * rays[..., 1], 1e-6
        slopes = height(x + e, y) - height(x - e, y), height(x, y + e) - height(x, y - e)
        normals = np.stack([slopes[0] / (2 * e), slopes[1] / (2 * e), -np.ones_like(t)], -1)
        return np.where(t > 0, t, np.inf), normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    return Surface(meet, grey)
