"""Ray-traces analytic surfaces in float64."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..scene.camera import Camera, check_pose
from ..scene.frame import Frame
from ..scene.values import linear_to_srgb, srgb_to_linear

NEIGHBOURS = (np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])  # of a picture: side by side, one below the other
Array = NDArray[np.float64]
Albedo = Callable[[Array], Array]


@dataclass(frozen=True)
class TracedSurface:
    """`meet(origin, directions)` gives distance factors (inf = miss) and unit normals; `albedo(points)` linear RGB."""

    meet: Callable[[Array, Array], tuple[Array, Array]]
    albedo: Albedo


@dataclass(frozen=True)
class Hits:
    """What a camera sees, per pixel (h, w): z depth (0 = nothing), world points and normals, albedo, surface number."""

    depth: Array
    points: Array
    normals: Array
    albedo: Array
    surface: NDArray[np.int64]


def sphere(centre: ArrayLike, radius: float, albedo: Albedo, far: bool = False) -> TracedSurface:
    """far: where rays leave it, instead of where they enter."""
    middle, sign = np.asarray(centre, float), 1 if far else -1

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        a = (rays * rays).sum(-1)
        b = rays @ (middle - origin)
        q = b * b - a * ((middle - origin) @ (middle - origin) - radius**2)
        t = np.where(q > 0, (b + sign * np.sqrt(np.maximum(q, 0))) / a, np.inf)
        normals = (origin + np.where(np.isfinite(t), t, 0)[..., None] * rays - middle) / radius
        return np.where(t > 0, t, np.inf), normals

    return TracedSurface(meet, albedo)


def plane(normal: ArrayLike, point: ArrayLike, albedo: Albedo) -> TracedSurface:
    n = np.asarray(normal, float) / np.linalg.norm(normal)

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        slant = rays @ n
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((np.asarray(point, float) - origin) @ n) / slant
        return np.where(np.isfinite(t) & (t > 0), t, np.inf), np.broadcast_to(n, rays.shape)

    return TracedSurface(meet, albedo)


def patch(centre: ArrayLike, u: ArrayLike, v: ArrayLike, albedo: Albedo) -> TracedSurface:
    """The parallelogram of all centre + a * u + b * v, a and b from -1 to 1."""
    middle, axes = np.asarray(centre, float), np.stack([np.asarray(u, float), np.asarray(v, float)])
    whole = plane(np.cross(*axes), middle, albedo)
    to_axes = np.linalg.pinv(axes)

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        t, normals = whole.meet(origin, rays)
        at = (origin + np.where(np.isfinite(t), t, 0)[..., None] * rays - middle) @ to_axes
        return np.where((np.abs(at) <= 1).all(-1), t, np.inf), normals

    return TracedSurface(meet, albedo)


def moved_surface(surface: TracedSurface, pose: ArrayLike) -> TracedSurface:
    """The surface, carried by a rigid pose: its own axes are the pose's."""
    matrix = check_pose(pose)
    turn, shift = matrix[:3, :3], matrix[:3, 3]

    def meet(origin: Array, rays: Array) -> tuple[Array, Array]:
        t, normals = surface.meet((origin - shift) @ turn, rays @ turn)
        return t, normals @ turn.T

    return TracedSurface(meet, lambda points: surface.albedo((points - shift) @ turn))


def trace(surfaces: Sequence[TracedSurface], camera: Camera, pose: ArrayLike | None = None) -> Hits:
    """The nearest surface through every pixel's centre."""
    matrix = check_pose(pose)
    rays = camera.rays() @ matrix[:3, :3].T  # length along the optical axis stays 1, so t is z
    depth = np.full(rays.shape[:2], np.inf)
    normals, albedo = np.zeros(rays.shape), np.zeros(rays.shape)
    number = np.full(depth.shape, -1)
    for k, surface in enumerate(surfaces):
        t, n = surface.meet(matrix[:3, 3], rays)
        nearer = t < depth
        depth[nearer], normals[nearer], number[nearer] = t[nearer], n[nearer], k
        albedo[nearer] = surface.albedo(matrix[:3, 3] + t[nearer][:, None] * rays[nearer])
    depth = np.where(number >= 0, depth, 0)
    normals *= np.where((normals * rays).sum(-1, keepdims=True) > 0, -1, 1)
    return Hits(depth, matrix[:3, 3] + depth[..., None] * rays, normals, albedo, number)


def encode(linear: Array) -> Array:
    """Linear RGB to sRGB, 0..255, not rounded."""
    return 255 * linear_to_srgb(linear)


def decode(encoded: Array) -> Array:
    """sRGB, 0..255, to linear RGB."""
    return srgb_to_linear(encoded / 255)


def as_frame(hits: Hits, camera: Camera, pose: ArrayLike | None = None) -> Frame:
    """The frame that a perfect depth camera would have taken."""
    return Frame(np.round(encode(hits.albedo)).astype(np.uint8), hits.depth, camera, pose)


def waves(points: Array) -> Array:
    """A texture of slow waves."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return 0.5 + 0.25 * np.stack([np.sin(9 * x + 4 * y), np.sin(7 * y - 5 * z), np.cos(8 * x - 6 * z)], -1)


def sphere_and_wall() -> list[TracedSurface]:
    """The scene of the picture tests: a smooth sphere in front of a slanted wall."""
    return [sphere((0.05, 0.02, 1.5), 0.4, waves), plane((0.15, -0.1, -1), (0, 0, 2.4), waves)]
