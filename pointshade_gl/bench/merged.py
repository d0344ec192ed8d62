"""How many splats the compute rasteriser draws of a frame, where it merges pixels of one plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import Camera

F = np.float32
SIDES = 4, 2  # pixels of the blocks that are merged, the larger first
SLANTED = F(0.05)  # least cosine between a normal and the ray, as in shaders/common/splat.glsl
Floats = NDArray[np.float32]


def count_splats(depth: Floats, normals: Floats, camera: Camera, tolerance: float) -> int:
    """Return the number of splats: one for each block of pixels on one plane, one for each other pixel.

    depth      (h, w), 0 = nothing
    normals    (h, w, 3), 0 where missing
    tolerance  how far off the plane pixels may lie, as a share of 1/z
    """
    pad = (0, -depth.shape[0] % SIDES[0]), (0, -depth.shape[1] % SIDES[0])
    depth, normals = np.pad(depth, pad), np.pad(normals, (*pad, (0, 0)))
    rest, count = depth > 0, 0
    for side in SIDES:
        merged = rest[::side, ::side] & _on_plane(depth, normals, camera, side, tolerance)
        count += int(merged.sum())
        rest &= ~merged.repeat(side, 0).repeat(side, 1)
    return count + int(rest.sum())


def _on_plane(depth: Floats, normals: Floats, camera: Camera, side: int, tolerance: float) -> NDArray[np.bool_]:
    """Return which blocks lie on the plane of their first pixel: there 1/z changes linearly."""
    first, normal = depth[::side, ::side], normals[::side, ::side]
    known = first > 0
    v, u = np.indices(first.shape).astype(F) * F(side)
    fx, fy, cx, cy = np.array(camera.intrinsics, F)
    x, y = (u - cx) / fx, (v - cy) / fy
    cosine = np.minimum(normal[..., 0] * x + normal[..., 1] * y + normal[..., 2], -SLANTED * np.sqrt(x * x + y * y + 1))
    z = np.where(known, first, F(1))
    slope_u, slope_v = normal[..., 0] / (fx * (cosine * z)), normal[..., 1] / (fy * (cosine * z))
    for j, i in np.ndindex(side, side):
        there = depth[j::side, i::side]
        known &= there > 0
        error = np.abs(F(1) / np.where(known, there, F(1)) - (F(1) / z + (slope_u * F(i) + slope_v * F(j))))
        known &= error < F(tolerance) * (F(1) / z)
    return known
