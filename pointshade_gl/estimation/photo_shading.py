"""Estimates how brightly each part of a photograph is lit: by its light, and by what its colours say about shadows."""

from __future__ import annotations

import numpy as np

from .cast_shadows import visible_light
from .light_fit import FoundLight
from .light_pairs import DARK, LUMINANCE, Array
from .votes import ask

DARKEST = 0.002  # linear light: darker differences are noise
LEAST_AMBIENT = 0.03  # over direct light
GRAZING = 0.05, 0.3  # n . l at which a sample begins to be lit, and is for certain
SURE = 0.99  # of being lit: so sure a voter is
SPREAD = 0.09  # squared deviation of log albedo: voters who differ more say little about one sample
SHADOW, LIT = 5.0, 3.0  # samples: standard deviations of what neighbours share
LARGEST = 0.5  # correction of log shading where the light reaches
RANGE = np.log(0.02), np.log(1.5)  # of log shading
WHITE = 95  # percent of the picture are lit less than what keeps its brightness
GAINS = np.log(0.4), np.log(20)


def find_gains(colors: Array, surfaces: Array, rays: Array, light: FoundLight) -> Array:
    """Return (h, w) float32 the log of what linear light is multiplied by, so that the albedo remains.

    colors    (h, w, 4) linear RGB and 1; 0.5 where clipped, 0 where unknown
    surfaces  (h, w, 4) unit normals, camera axes, towards the camera, and depth; 0 where unknown
    rays      (h, w, 3) from the camera through the samples, z = 1
    """
    known = (colors[..., 3] > 0) & surfaces[..., :3].any(-1)
    if not known.any():
        return np.zeros(known.shape, np.float32)
    shading = find_shading(colors, surfaces, rays, light)
    white = np.percentile(shading[known], WHITE)
    return np.where(known, np.clip(light.strength * (white - shading), *GAINS), 0).astype(np.float32)


def find_shading(colors: Array, surfaces: Array, rays: Array, light: FoundLight) -> Array:
    """Return (h, w) the log of how brightly each sample is lit, from the same arrays.

    What the light surely reaches votes on the albedo of what it does not.
    """
    known = (colors[..., 3] > 0) & surfaces[..., :3].any(-1)
    luminance = colors[..., :3] @ LUMINANCE
    brightness = np.log(np.maximum(luminance, DARKEST))
    facing = surfaces[..., :3] @ np.array(light.direction, np.float32)
    shading = np.log(max(light.ambient, LEAST_AMBIENT) + np.maximum(facing, 0))
    faces = np.clip((facing - GRAZING[0]) / (GRAZING[1] - GRAZING[0]), 0, 1)
    visible = _eroded(visible_light(surfaces, rays, light.direction))
    lit = faces * visible
    voters = known & (lit > SURE) & (colors[..., 3] == 1) & (luminance > DARK)
    if not voters.any():
        return shading
    hue = colors[..., :2] / np.maximum(colors[..., :3].sum(-1, keepdims=True), 1e-6)
    albedo, deviation = ask(brightness - shading, voters, hue)
    trust = SPREAD / (SPREAD + deviation**2)
    miss = brightness - albedo - shading
    change = lit * 0.5 * trust * np.clip(_mean(miss, voters.astype(float), LIT), -LARGEST, LARGEST)
    attached, cast = known & (faces < 1), known & (faces == 1) & (visible < 1)
    for shadow, most in ((attached, np.inf), (cast, 0.0)):
        around = _mean(miss, shadow * (1.05 - lit), SHADOW)
        change += np.where(shadow, (1 - lit) * np.minimum(around + trust * (miss - around), most), 0)
    return np.clip(shading + change, *RANGE)


def _eroded(image: Array) -> Array:
    """Return the least of 3x3 samples."""
    for axis in (0, 1):
        padded = np.pad(image, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
        count = image.shape[axis]
        image = np.minimum.reduce([padded.take(range(k, k + count), axis) for k in range(3)])
    return image


def _mean(image: Array, weight: Array, deviation: float) -> Array:
    """Return the weighted mean around each sample, by a Gaussian; 0 where nothing has a weight."""
    down, across = (_gaussian(count, deviation) for count in image.shape)
    total = down @ weight @ across
    return np.where(total > 1e-6, down @ (weight * image) @ across / np.maximum(total, 1e-6), 0)


def _gaussian(count: int, deviation: float) -> Array:
    off = np.subtract.outer(np.arange(count), np.arange(count))
    return np.exp(-0.5 * (off / deviation) ** 2)
