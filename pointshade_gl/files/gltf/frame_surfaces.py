"""Turns a frame into triangles that other programs draw: neighbouring pixels that lie on one surface, without a GPU.

A plane is linear in w = 1/z over the picture: its slope in w is known on both sides of a pixel, and the side that goes
on more evenly counts more (the weights of Jiang and Shu 1996). Of rough depth, as sensors measure it, slopes are the
mean of those around that lie on one surface. Two neighbours are one surface where either continues the other's plane,
as in shaders/common/grid.glsl. Its normals are better: they know the noise.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.frame import Frame
from ...scene.noise import Step

SAME_SURFACE = 0.02  # a neighbour off the plane by more than this share of 1/z is another surface
STEEPEST = 10.0  # tangent of the steepest slope of a surface
ROUGH = 0.4  # tangent by which slopes differ from pixel to pixel: from here on they are smoothed
WINDOW = (1, 2, 4)  # pixels between those whose mean is taken, one round each
EVEN = 1e-3  # share of 1/z by which the slopes of two sides may differ and count the same
TO_GLTF = np.array([1.0, -1.0, -1.0], np.float32)  # axes of a camera
Floats = NDArray[np.float32]


class Surface(NamedTuple):
    """Vertices of a frame in the axes of a glTF camera, (n, 3) and (n, 2), and the (m, 3) corners of its triangles."""

    positions: Floats
    normals: Floats
    uv: Floats
    faces: NDArray[np.uint32]


def frame_surface(frame: Frame, most: int, step: Step | None = None, normals: Floats | None = None) -> Surface:
    """Return the triangles between pixels that lie on one surface, and their corners.

    most     pixels that may be used: of larger pictures each second is left out, or more
    step     see `Look.depth_step`
    normals  (h, w, 3) in the frame's camera axes, in place of those of the depth
    """
    every = max(1, math.ceil(math.sqrt(frame.depth.size / most)))
    v, u = np.mgrid[every // 2 : frame.depth.shape[0] : every, every // 2 : frame.depth.shape[1] : every]
    z = frame.depth[v, u]
    w = np.divide(1, z, out=np.zeros_like(z), where=z > 0)
    focal = abs(frame.camera.fx * frame.camera.fy) ** 0.5 / every
    right, down = _slopes(w), _slopes(w.T).T
    if (noise := _unevenness(w)) * focal > ROUGH:
        right, down = _smoothed(w, right, down, noise)
    faces = _triangles(w, right, down, focal, step)
    used = np.zeros(w.size, bool)
    used[faces] = True
    number = np.cumsum(used, dtype=np.uint32) - 1  # of each pixel among those used
    u, v = u.ravel()[used], v.ravel()[used]
    z, w, right, down = (part.ravel()[used] for part in (z, w, right / every, down / every))
    x, y = frame.camera.ray_at(u, v)
    if normals is None:
        camera = frame.camera
        outward = [camera.fx * right, camera.fy * down, w - right * (u - camera.cx) - down * (v - camera.cy)]
        found = -np.stack(outward, -1)
    else:
        found = normals[v, u]
    height, width = frame.depth.shape
    mirrored = frame.camera.fx * frame.camera.fy < 0
    return Surface(
        np.stack([x * z, y * z, z], -1).astype(np.float32) * TO_GLTF,
        _unit(found) * TO_GLTF,
        np.stack([(u + 0.5) / width, (v + 0.5) / height], -1).astype(np.float32),
        number[faces[:, ::-1] if mirrored else faces],
    )


def frame_points(frame: Frame, most: int) -> tuple[Floats, tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return points of a frame in the axes of a glTF camera, (n, 3), and their columns and rows."""
    v, u = np.nonzero(frame.depth)
    every = math.ceil(len(v) / most)
    v, u = v[::every], u[::every]
    (x, y), z = frame.camera.ray_at(u, v), frame.depth[v, u]
    return np.stack([x * z, y * z, z], -1).astype(np.float32) * TO_GLTF, (u, v)


def _unit(vectors: NDArray[Any]) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    ahead = np.broadcast_to(np.array([0, 0, -1.0]), vectors.shape)
    return np.divide(vectors, length, out=ahead.copy(), where=length > 0).astype(np.float32)


def _slopes(w: Floats) -> Floats:
    """Return the slope of w from column to column, by the side that goes on more evenly; 0 without neighbours."""
    known = np.pad(w > 0, ((0, 0), (2, 2)))
    padded = np.pad(w, ((0, 0), (2, 2)))
    step = np.where(known[:, 1:] & known[:, :-1], np.diff(padded, axis=1), np.nan)
    bend = np.diff(step, axis=1)  # of the pixels from 1 on
    sides = step[:, 1:-2], step[:, 2:-1]
    slope, total, safe = np.zeros_like(w), np.zeros_like(w), np.where(w > 0, w, 1)
    for side, beyond in zip(sides, (bend[:, :-2], bend[:, 2:]), strict=True):
        # two pixels that stand alone have no bend: they count little
        uneven = np.where(np.isnan(beyond), 1, np.abs(beyond) / safe)
        weight = np.where(np.isnan(side), 0, 1 / (EVEN + uneven) ** 2)
        slope += weight * np.nan_to_num(side)
        total += weight
    return np.divide(slope, total, out=np.zeros_like(w), where=total > 0)


def _unevenness(w: Floats) -> float:
    """Return by how much w bends from pixel to pixel, as a share of it; jumps do not count."""
    known = (w[:, :-2] > 0) & (w[:, 1:-1] > 0) & (w[:, 2:] > 0)
    bend = np.abs(np.diff(w, 2, axis=1)[known]) / w[:, 1:-1][known]
    bend = bend[bend < SAME_SURFACE]
    return float(bend.mean()) if bend.size else 0.0


def _smoothed(w: Floats, right: Floats, down: Floats, noise: float) -> tuple[Floats, Floats]:
    """Return the mean slopes of pixels around that lie on the plane of the one in the middle, up to the noise."""
    safe = np.where(w > 0, w, 1)
    for step in WINDOW:
        there = np.pad(np.stack([w, right, down]), ((0, 0), (step, step), (step, step)))
        total, sums = np.zeros_like(w), np.zeros((2, *w.shape), np.float32)
        for dy in (0, step, 2 * step):
            for dx in (0, step, 2 * step):
                other = there[:, dy : dy + w.shape[0], dx : dx + w.shape[1]]
                off = (other[0] - w - (dx - step) * right - (dy - step) * down) / safe
                weight = np.where(other[0] > 0, 1 / (1 + (off / (4 * noise * (1 + step))) ** 2) ** 2, 0)
                total += weight
                sums += weight * other[1:]
        right, down = sums / np.where(total > 0, total, 1)
    return right, down


def _triangles(w: Floats, right: Floats, down: Floats, focal: float, max_step: Step | None) -> NDArray[np.intp]:
    """Return (m, 3) pixels of the triangles in each square of four pixels, cut along either diagonal."""

    def joined(a: tuple[slice, slice], b: tuple[slice, slice], off: tuple[int, int]) -> NDArray[np.bool_]:
        own, other = (off[0] * right[k] + off[1] * down[k] for k in (a, b))
        return _are_joined(w[a], w[b], own, other, focal, max_step)

    first, last = slice(None, -1), slice(1, None)
    a, b, c, d = (first, first), (first, last), (last, first), (last, last)
    above, below = joined(a, b, (1, 0)), joined(c, d, (1, 0))
    left, beside = joined(a, c, (0, 1)), joined(b, d, (0, 1))
    rising, falling = joined(b, c, (-1, 1)), joined(a, d, (1, 1))
    usual = above & left & rising, below & beside & rising
    is_other = ~(usual[0] | usual[1])
    others = above & beside & falling & is_other, left & below & falling & is_other
    pixel = np.arange(w.size).reshape(w.shape)
    corners = ((a, c, b), (b, c, d)), ((a, d, b), (a, c, d))
    found = [
        np.stack([pixel[k][there] for k in three], -1)
        for kept, halves in zip((usual, others), corners, strict=True)
        for there, three in zip(kept, halves, strict=True)
    ]
    return np.concatenate(found)


def _are_joined(
    w: Floats, other: Floats, rise: Floats, other_rise: Floats, focal: float, max_step: Step | None
) -> NDArray[np.bool_]:
    """Return whether two neighbours are one surface. rise: of w from one to the other, by the plane of each."""
    known = (w > 0) & (other > 0)
    near, far = np.maximum(w, other), np.where(known, np.minimum(w, other), 1)
    if max_step:
        z, far_z = 1 / np.where(known, near, 1), 1 / far
        return known & (far_z - z <= max_step[0] + max_step[1] * z)
    step = other - w
    goes_on = np.minimum(np.abs(step - rise), np.abs(step - other_rise)) < SAME_SURFACE * far
    return known & goes_on & (np.abs(step) < max(SAME_SURFACE, STEEPEST / focal) * far)
