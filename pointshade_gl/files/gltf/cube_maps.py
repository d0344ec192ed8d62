"""Cube maps as glTF's image-based lights have them, from and to pictures of the whole sphere, and colours as RGBD.

A cube map stands in axes of its own, those of OpenGL, which are left-handed: its x is the other way round than glTF's.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BRIGHTEST = 255.0  # that RGBD holds
_GAMMA = 2.2  # of the colours in RGBD
_MIRROR = np.array([-1.0, 1.0, 1.0])  # from the axes of a cube map to glTF's, and back
# Of the faces +x, -x, +y, -y, +z and -z, in axes of the cube map: the ways that go right, down and ahead.
_FACES = np.array([
    [(0, 0, -1), (0, -1, 0), (1, 0, 0)],
    [(0, 0, 1), (0, -1, 0), (-1, 0, 0)],
    [(1, 0, 0), (0, 0, 1), (0, 1, 0)],
    [(1, 0, 0), (0, 0, -1), (0, -1, 0)],
    [(1, 0, 0), (0, -1, 0), (0, 0, 1)],
    [(-1, 0, 0), (0, -1, 0), (0, 0, -1)],
])  # fmt: skip
_SAMPLES = 128  # of the lobe of a rough surface


def face_directions(size: int) -> Array:
    """Return the unit directions of the pixels of all faces, (6, size, size, 3), glTF's axes."""
    at = (2 * np.arange(size) + 1) / size - 1
    right, down, ahead = (_FACES[:, None, None, k] for k in range(3))
    rays = ahead + at[:, None] * right + at[:, None, None] * down
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True) * _MIRROR


def sphere_directions(width: int) -> Array:
    """Return the unit directions of the pixels of an environment's picture, (width / 2, width, 3)."""
    elevation = math.pi * (0.5 - (2 * np.arange(width // 2) + 1) / width)[:, None]
    azimuth = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    height = np.broadcast_to(np.sin(elevation), (width // 2, width))
    return np.stack([np.cos(elevation) * np.cos(azimuth), height, np.cos(elevation) * np.sin(azimuth)], -1)


def seen_in_cube(faces: Array, directions: Array) -> Array:
    """Return what the faces of a cube map, (6, n, n, 3), show along directions (..., 3), bilinear within a face."""
    rays, size = directions * _MIRROR, faces.shape[1]
    axis = np.abs(rays).argmax(-1)
    face = 2 * axis + (np.take_along_axis(rays, axis[..., None], -1)[..., 0] < 0)
    right, down, ahead = np.moveaxis((_FACES[face] @ rays[..., None])[..., 0], -1, 0)
    column, row = ((one / ahead + 1) * size / 2 - 0.5 for one in (right, down))
    return _bilinear(np.pad(faces, ((0, 0), (1, 1), (1, 1), (0, 0)), "edge"), face, row, column)


def seen_on_sphere(picture: NDArray[Any], directions: Array) -> Array:
    """Return what an environment's picture shows along directions (..., 3), bilinear."""
    (height, width), (x, y, z) = picture.shape[:2], np.moveaxis(directions, -1, 0)
    column = (0.5 + np.arctan2(z, x) / (2 * math.pi)) * width - 0.5
    row = (0.5 - np.arcsin(np.clip(y, -1, 1)) / math.pi) * height - 0.5
    around = np.pad(np.pad(picture, ((1, 1), (0, 0), (0, 0)), "edge"), ((0, 0), (1, 1), (0, 0)), "wrap")
    return _bilinear(around[None].astype(np.float64), np.zeros(row.shape, np.int64), row, column)


def _bilinear(padded: Array, which: NDArray[np.int64], row: Array, column: Array) -> Array:
    """Return values between pixels of one of several pictures, which have one pixel more on each side."""
    top, left = np.floor(row).astype(np.int64), np.floor(column).astype(np.int64)
    v, u = (row - top)[..., None], (column - left)[..., None]
    top, left = top + 1, left + 1
    upper = padded[which, top, left] * (1 - u) + padded[which, top, left + 1] * u
    lower = padded[which, top + 1, left] * (1 - u) + padded[which, top + 1, left + 1] * u
    return upper * (1 - v) + lower * v


def are_mirrored(faces: Array) -> bool:
    """Return whether each face (6, n, n, 3) is mirrored for itself, as the extension's text asks for and its viewers do
    not: then the sides fit together better with +x and -x exchanged."""
    positive, negative, _, _, front, back = faces

    def gap(left: Array, right: Array) -> float:
        return float(np.abs(left[:, -1] - right[:, 0]).sum())

    as_viewers = gap(front, positive) + gap(positive, back) + gap(back, negative) + gap(negative, front)
    as_written = gap(front, negative) + gap(negative, back) + gap(back, positive) + gap(positive, front)
    return as_written < 0.5 * as_viewers


def rough(picture: NDArray[Any], size: int, roughness: float) -> Array:
    """Return the faces (6, size, size, 3) of what a surface of this roughness reflects of an environment's picture: the
    mean over its GGX lobe, seen from above (Karis 2013)."""
    ahead, total = face_directions(size), np.zeros((6, size, size, 3))
    side = np.cross(np.where(np.abs(ahead[..., 1:2]) < 0.9, (0, 1, 0), (1, 0, 0)), ahead)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other, weights = np.cross(ahead, side), 0.0
    for k in range(_SAMPLES):
        share, angle = (k + 0.5) / _SAMPLES, k * math.pi * (3 - math.sqrt(5))
        cosine = math.sqrt((1 - share) / (1 + (roughness**4 - 1) * share))  # of the half vector
        along = 2 * cosine * cosine - 1
        if along <= 0:
            continue
        across = math.sqrt(1 - along * along)
        total += along * seen_on_sphere(
            picture, along * ahead + across * (math.cos(angle) * side + math.sin(angle) * other)
        )
        weights += along
    return total / weights


def irradiance_coefficients(picture: NDArray[Any]) -> list[list[float]]:
    """Return the irradiance of an environment's picture as spherical harmonics of order 2, (9, 3), axes of the cube map
    (Ramamoorthi and Hanrahan 2001)."""
    height, width = picture.shape[:2]
    edges = np.sin(math.pi * (0.5 - np.arange(height + 1) / height))
    light = picture.astype(np.float64) * ((edges[:-1] - edges[1:]) * 2 * math.pi / width)[:, None, None]
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    azimuth = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    x, y, z = -np.cos(elevation) * np.cos(azimuth), np.sin(elevation) + 0 * azimuth, np.cos(elevation) * np.sin(azimuth)
    second = 1.092548
    bases = [
        0 * x + 0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, second * x * y, second * y * z,
        0.315392 * (3 * z * z - 1), second * x * z, second / 2 * (x * x - y * y),
    ]  # fmt: skip
    factors = [math.pi, *[2 * math.pi / 3] * 3, *[math.pi / 4] * 5]
    return [(factor * np.tensordot(one, light)).tolist() for factor, one in zip(factors, bases, strict=True)]


def from_rgbd(colors: NDArray[np.uint8]) -> Array:
    """Return the linear light of RGBD, (..., 4): colours by the power of 2.2, divided by alpha."""
    return (colors[..., :3] / 255.0) ** _GAMMA / (np.maximum(colors[..., 3:], 1) / 255.0)


def to_rgbd(light: Array) -> NDArray[np.uint8]:
    """Return linear light up to BRIGHTEST as RGBD, (..., 4)."""
    divisor = np.floor(np.clip(255 / np.maximum(light.max(-1, keepdims=True), 1), 1, 255))
    colors = np.rint(np.clip(light * divisor / 255, 0, 1) ** (1 / _GAMMA) * 255)
    return np.concatenate([colors, divisor], -1).astype(np.uint8)
