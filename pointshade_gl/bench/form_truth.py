"""What is seen from elsewhere of the surfaces that one picture showed: traced, and averaged over pixels.

Where that picture saw nothing, one looks through. The scene is a ball and a box before a wall, with a fine texture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..scene.appearance import Material
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.light import Light
from .shapes import box, pose_at
from .tracing import Array, Hits, Surface, as_frame, moved, plane, shade, sphere, trace

LARGEST = 4  # pixels of the largest view on each side of a pixel of the source
RAYS = 2  # on each side of a pixel of that view
ROWS = 128  # of rays that are traced at once
SEEN = 1e-4  # share of the distance by which a point may lie behind the first surface and still be seen


@dataclass(frozen=True)
class Truth:
    """Means over the pixels (h, w) of a view.

    known    share of the pixel that shows something that the source saw
    light    (h, w, 3) linear, of that part
    objects  share that shows objects which the source saw, as if there was no wall
    """

    known: Array
    light: Array
    objects: Array

    def reduced(self, by: int) -> Truth:
        """In a picture so many times as small."""
        known = _means(self.known, by)
        light = _means(self.known[..., None] * self.light, by) / np.maximum(known, 1e-9)[..., None]
        return Truth(known, light, _means(self.objects, by))


def texture(points: Array) -> Array:
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.5 + 0.4 * np.stack([np.sin(40 * x + 17 * y), np.sin(31 * y - 25 * z), np.cos(37 * x - 28 * z)], -1)


def surfaces(far: bool) -> list[Surface]:
    """The ball and the box; far: their other sides, seen from inside."""
    cube = moved(box((0.17, 0.22, 0.17), far), pose_at((0.42, 0.1, 1.45), 35, 15))
    return [sphere((-0.25, 0.0, 1.5), 0.33, texture, far), replace(cube, albedo=texture)]


WALL = plane((0.1, -0.06, -1), (0, 0, 2.4), texture)
MIDDLE = (0.0, 0.0, 1.5)  # which the views turn about


def source_frames(camera: Camera) -> tuple[Frame, Frame]:
    """What a perfect camera takes at the origin: the scene, and its objects without the wall."""
    objects = surfaces(False)
    return as_frame(trace([*objects, WALL], camera), camera), as_frame(trace(objects, camera), camera)


def trace_seen(source: Camera, pose: Array, light: Light, material: Material) -> Truth:
    """The view of a camera like the source's at a pose (4, 4), LARGEST times as large, lit.

    A surface shows the light that falls on the side that the source saw, from behind as well.
    """
    fine = source.resized(LARGEST * RAYS * source.width, LARGEST * RAYS * source.height)
    bands = [_trace_band(band, source, pose, light, material).reduced(RAYS) for band in _bands(fine)]
    parts = ((band.known, band.light, band.objects) for band in bands)
    return Truth(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _bands(camera: Camera) -> Iterator[Camera]:
    """Cameras that see some rows of its picture each, from the top."""
    for first in range(0, camera.height, ROWS):
        yield replace(camera, cy=camera.cy - first, height=min(ROWS, camera.height - first))


def _trace_band(camera: Camera, source: Camera, pose: Array, light: Light, material: Material) -> Truth:
    rays, eye = camera.rays() @ pose[:3, :3].T, pose[:3, 3]
    depth, normals = np.full(rays.shape[:-1], np.inf), np.zeros(rays.shape)
    objects = np.zeros(depth.shape)
    near = [*surfaces(False), WALL]
    for surface in (*surfaces(False), *surfaces(True), WALL):
        t, n = surface.meet(eye, rays)
        nearer = t < depth
        nearer[nearer] = _is_seen(eye + t[nearer][:, None] * rays[nearer], near, source)
        depth[nearer], normals[nearer] = t[nearer], n[nearer]
        if surface is not WALL:
            objects[nearer] = 1
    known = np.isfinite(depth)
    points = eye + np.where(known, depth, 1)[..., None] * rays
    normals *= np.where((normals * points).sum(-1, keepdims=True) > 0, -1, 1)  # towards the source
    hits = Hits(np.where(known, depth, 0), points, normals, texture(points), known.astype(np.int64) - 1)
    return Truth(known.astype(float), shade(hits, light, material, eye), objects)


def _is_seen(points: Array, near: Sequence[Surface], source: Camera) -> np.ndarray:
    """Whether a camera at the origin sees these points (n, 3) of the surfaces."""
    at = source.project(points)
    inside = (at > -0.5).all(-1) & (at < (source.width - 0.5, source.height - 0.5)).all(-1)
    first = np.min([surface.meet(np.zeros(3), points)[0] for surface in near], 0)
    return inside & (first > 1 - SEEN)


def _means(values: Array, by: int) -> Array:
    """Over squares of so many pixels a side."""
    height, width = values.shape[0] // by, values.shape[1] // by
    return values.reshape(height, by, width, by, *values.shape[2:]).mean((1, 3))
