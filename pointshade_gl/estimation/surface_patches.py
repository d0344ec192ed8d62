"""Describes places of a surface by what lies around them on their tangent plane, and finds places that look alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .reduced_frame import BLURS, ReducedFrame

PLACES = 400  # of a frame that are described, about
RINGS, ANGLES = 4, 24  # samples of a patch
LEAST_PIXELS = 3.0  # radius of a patch in its picture
FAINT = 0.02  # contrast of brightness that counts half
HEIGHTS = 1.5  # weight of heights beside brightness
ALIKE = 4  # places of the other frame that each is paired with
Floats = NDArray[np.floating]


class Patches(NamedTuple):
    """Places of a frame and their surroundings, n of them."""

    points: Floats  # (n, 3) m, camera axes
    axes: Floats  # (n, 3, 3) camera axes: rows are two tangents and the normal
    bright: Floats  # (n, RINGS, ANGLES) brightness, of mean 0 and length 1, less where it is faint
    heights: Floats  # (n, RINGS, ANGLES) above the tangent plane, in radii, -1 to 1, over the root of their number


class Pairs(NamedTuple):
    """Places of two frames that look alike, n pairs."""

    first: NDArray[np.intp]  # (n,) number of the place in the first frame
    second: NDArray[np.intp]  # (n,) and in the second
    turns: Floats  # (n,) radians about the normal from the first's tangents to the second's


def find_patches(frame: ReducedFrame, radius: float) -> Patches:
    """Return the surroundings of distinct places all over a frame.

    They are read on the tangent plane in metres, so that they are the same from any side and distance (as viewpoint
    invariant patches: Wu et al. 2008); heights above it tell shapes without texture apart. radius: of a patch, m.
    """
    numbers = _distinct(frame, radius)
    points, normals = frame.points[numbers], frame.normals[numbers]
    aside = np.where(np.abs(normals[:, :1]) < 0.9, np.eye(3, dtype=np.float32)[0], np.eye(3, dtype=np.float32)[1])
    first = aside - normals * (aside * normals).sum(1, keepdims=True)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(normals, first), normals], 1)
    turns = 2 * np.pi * np.arange(ANGLES, dtype=np.float32) / ANGLES
    rings = radius * np.arange(1, RINGS + 1, dtype=np.float32)[:, None] / RINGS
    flat = np.stack([rings * np.cos(turns), rings * np.sin(turns)], -1)
    pixels, inside = frame.pixels(points[:, None, None] + np.einsum("rac,nck->nrak", flat, axes[:, :2]))
    there = frame.points[pixels]
    heights = np.einsum("nrak,nk->nra", there - points[:, None, None], normals) / radius
    heights = np.where(inside & (there[..., 2] > 0), np.clip(heights, -1, 1), 0) / np.sqrt(RINGS * ANGLES)
    bright = np.zeros_like(heights)
    if frame.brightness is not None:
        gap = radius * abs(frame.camera.fx) / (RINGS * np.maximum(points[:, 2], 1e-6))  # pixels between two rings
        level = np.clip(np.log2(gap / 2).astype(int), 0, BLURS - 1)
        every = np.stack([frame.blurred(k).value for k in range(BLURS)])
        shown = every[level[:, None, None], pixels]
        usual = (shown * inside).sum((1, 2), keepdims=True) / np.maximum(inside.sum((1, 2), keepdims=True), 1)
        shown = np.where(inside, shown - usual, 0)
        bright = shown / np.sqrt((shown**2).sum((1, 2), keepdims=True) + RINGS * ANGLES * FAINT**2)
    return Patches(points, axes, bright, heights)


def _distinct(frame: ReducedFrame, radius: float) -> NDArray[np.intp]:
    """Return the numbers of points at corners of the brightness or of the surface, the best of each of equal cells."""
    shape = frame.camera.height, frame.camera.width
    normals, depth = frame.normals.reshape(*shape, 3), frame.points[:, 2].reshape(shape)
    strength = _corners(normals) / 2
    if frame.brightness is not None:
        strength = strength + _corners(frame.blurred(1).value.reshape(*shape, 1))
    is_large = (depth > 0) & (radius * abs(frame.camera.fx) > LEAST_PIXELS * depth)
    cell = max(int(np.sqrt(is_large.sum() / PLACES)), 2)
    rows, columns = (size // cell for size in shape)
    cells = np.where(is_large, strength, -1)[: rows * cell, : columns * cell]
    cells = cells.reshape(rows, cell, columns, cell).swapaxes(1, 2).reshape(rows, columns, cell * cell)
    best = cells.argmax(-1)
    v, u = np.arange(rows)[:, None] * cell + best // cell, np.arange(columns) * cell + best % cell
    return (v * shape[1] + u)[cells.max(-1) >= 0]


def _corners(picture: Floats) -> Floats:
    """Return how much a picture (h, w, channels) changes in all directions (Shi, Tomasi 1994), 1 where it does most."""
    if min(picture.shape[:2]) < 2:
        return np.zeros(picture.shape[:2], picture.dtype)
    along_v, along_u = np.gradient(picture, axis=(0, 1))
    uu, uv, vv = (_mean(one.sum(-1)) for one in (along_u**2, along_u * along_v, along_v**2))
    found = np.maximum((uu + vv) / 2 - np.sqrt(((uu - vv) / 2) ** 2 + uv**2), 0)
    return found / max(float(np.quantile(found, 0.95)), 1e-12)


def _mean(picture: Floats) -> Floats:
    """Return the mean over 5x5 pixels."""
    for axis in (0, 1):
        wide = np.pad(picture, [(3, 2) if k == axis else (0, 0) for k in (0, 1)], "edge").cumsum(axis)
        picture = (np.roll(wide, -5, axis) - wide).take(range(picture.shape[axis]), axis) / 5
    return picture


def pair_alike(first: Patches, second: Patches) -> Pairs:
    """Return pairs of each place of a frame with those of the other that look most like it, turned at will.

    A patch is compared at all turns at once, by the Fourier transform along its rings.
    """
    waves = np.zeros((len(first.points), len(second.points), ANGLES // 2 + 1), np.complex64)
    for weight, one, other in ((1, first.bright, second.bright), (2 * HEIGHTS, first.heights, second.heights)):
        one, other = (np.fft.rfft(part, axis=-1).astype(np.complex64) for part in (one, other))
        for k in range(waves.shape[-1]):
            waves[..., k] += weight * (one[..., k].conj() @ other[..., k].T)
    likeness = np.fft.irfft(waves, ANGLES, axis=-1).astype(np.float32)
    best = likeness.argmax(-1)
    highest = np.take_along_axis(likeness, best[..., None], -1)[..., 0]
    highest -= HEIGHTS * (second.heights**2).sum((1, 2))  # of (one - other)^2 what differs within a row
    j = np.argsort(-highest, axis=1, kind="stable")[:, :ALIKE]
    i, j = np.repeat(np.arange(len(j)), j.shape[1]), j.ravel()
    before, middle, after = (likeness[i, j, (best[i, j] + k) % ANGLES] for k in (-1, 0, 1))
    part = (after - before) / np.maximum(2 * (2 * middle - before - after), 1e-9)  # the top of a parabola
    return Pairs(i, j, 2 * np.pi * (best[i, j] + np.clip(part, -0.5, 0.5)) / ANGLES)
