"""Estimates how brightly each part of a photograph is lit: by its light, and by what its colours say about shadows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .cast_shadows import visible_light
from .light_fit import FoundLight
from .light_pairs import DARK, LUMINANCE, Array
from .votes import ask

DARKEST = 0.002  # linear light: darker differences are noise
LEAST_AMBIENT = 0.03  # over direct light
GRAZING = 0.05, 0.3  # n . l at which a sample begins to be lit, and is for certain
SURE = 0.99  # of being lit: so sure a voter is
SPREAD = 0.09  # squared deviation of log albedo: voters who differ more say little about one sample
HUE = 3.0  # samples: standard deviation of what tells the hue of dark ones
GREY = 5e-4  # linear light: weaker colours are noise
SHADOW, LIT = 5.0, 3.0  # samples: standard deviations of what neighbours share
LARGEST = 0.5  # correction of log shading where the light reaches
RANGE = np.log(0.02), np.log(1.5)  # of log shading
WHITE = 95  # percent of the picture are lit less than what keeps its brightness
GAINS = np.log(0.4), np.log(20)


@dataclass(frozen=True, eq=False)
class PhotoSamples:
    """Samples of a photograph and of what it shows.

    colors    (h, w, 4) float32: linear RGB and 1; 0.5 where clipped, 0 where unknown
    surfaces  (h, w, 4) float32: unit normals, camera axes, towards the camera, and depth; 0 where unknown
    rays      (h, w, 3) float32 from the camera through the samples, z = 1
    size      of the whole frame, in samples
    """

    colors: Array
    surfaces: Array
    rays: Array
    size: tuple[float, float]

    @cached_property
    def unclipped(self) -> Array:
        """The colours, 0 where they are clipped."""
        return np.where(self.colors[..., 3:] == 1, self.colors, np.float32(0))

    @cached_property
    def is_known(self) -> NDArray[np.bool_]:
        """(h, w) whether both colour and normal are known."""
        x, y, z, _ = np.moveaxis(self.surfaces, -1, 0)
        return (self.colors[..., 3] > 0) & ((x != 0) | (y != 0) | (z != 0))

    @cached_property
    def surroundings(self) -> Array:
        """(h, w, 4) float32 linear RGB around each sample, and 0. Bright samples count most, and the darkest are grey.

        That is the hue that dark samples should have, whose own is mostly noise.
        """
        red, green, blue, known = np.moveaxis(self.colors, -1, 0)
        around = _blurred(np.stack([red, green, blue]) * (known > 0), HUE) + np.float32(GREY)
        return np.stack([*around, np.zeros_like(known)], -1)

    @cached_property
    def brightness(self) -> Array:
        """(h, w) log luminance."""
        return np.log(np.maximum(self.colors[..., :3] @ LUMINANCE, DARKEST))


def find_gains(photo: PhotoSamples, light: FoundLight) -> Array:
    """Return (h, w) float32 the log of what linear light is multiplied by, so that the albedo remains."""
    known = photo.is_known
    if not known.any():
        return np.zeros(known.shape, np.float32)
    shading, _ = find_shading(photo, light)
    white = np.percentile(shading[known], WHITE)
    return np.where(known, np.clip(light.strength * (white - shading), *GAINS), 0).astype(np.float32)


def find_shading(photo: PhotoSamples, light: FoundLight) -> tuple[Array, Array]:
    """Return, (h, w) each, the log of how brightly samples are lit, and how surely the light reaches them, 0..1.

    What the light surely reaches votes on the albedo of what it does not.
    """
    known, brightness = photo.is_known, photo.brightness
    facing = photo.surfaces[..., :3] @ np.array(light.direction, np.float32)
    shading = np.log(max(light.ambient, LEAST_AMBIENT) + np.maximum(facing, 0))
    faces = np.clip((facing - GRAZING[0]) / (GRAZING[1] - GRAZING[0]), 0, 1)
    visible = _eroded(visible_light(photo.surfaces, photo.rays, light.direction))
    lit = faces * visible
    red, green, blue, unclipped = np.moveaxis(photo.colors, -1, 0)
    voters = known & (lit > SURE) & (unclipped == 1) & (brightness > np.log(DARK))
    if not voters.any():
        return shading, lit
    total = np.maximum(red + green + blue, 1e-6)
    albedo, deviation = ask(brightness - shading, voters, red / total, green / total, known)
    trust = SPREAD / (SPREAD + deviation**2)
    miss = brightness - albedo - shading
    attached, cast = known & (faces < 1), known & (faces == 1) & (visible < 1)
    in_light = _means(miss, voters[None].astype(np.float32), LIT)
    in_shadow = _means(miss, (1.05 - lit) * np.stack([attached, cast]), SHADOW)
    change = 0.5 * lit * trust * np.clip(in_light[0], -LARGEST, LARGEST)
    for shadow, around, most in zip((attached, cast), in_shadow, (np.inf, 0.0), strict=True):
        change += np.where(shadow, (1 - lit) * np.minimum(around + trust * (miss - around), most), 0)
    return np.clip(shading + change, *RANGE), lit


def _eroded(image: Array) -> Array:
    """Return the least of 3x3 samples."""
    for _ in range(2):
        least = image.copy()
        np.minimum(least[1:], image[:-1], out=least[1:])
        np.minimum(least[:-1], image[1:], out=least[:-1])
        image = least.T
    return image


def _means(image: Array, weights: Array, deviation: float) -> Array:
    """Return the means around each sample, about by a Gaussian, for each of weights (n, h, w); 0 without any."""
    total, summed = np.split(_blurred(np.concatenate([weights, weights * image]), deviation), 2)
    return np.where(total > 1e-4, summed / np.maximum(total, 1e-4), 0)


def _blurred(images: Array, deviation: float) -> Array:
    """Return the sums around each sample of images (n, h, w), about by a Gaussian: two boxes, one after another.

    They go over 2x2 samples at once, as nothing finer would be left.
    """
    height, width = images.shape[1:]
    size = round(np.sqrt(1.5 * deviation**2 + 1))
    images = np.pad(images, ((0, 0), (0, height % 2), (0, width % 2)))
    images = images[:, ::2] + images[:, 1::2]
    images = (images[..., ::2] + images[..., 1::2]) / np.float32(4 * size**4)
    for _ in range(2):
        padded = np.pad(images, ((0, 0), (size - 1, size - 1), (0, 0)))
        images = np.ascontiguousarray(_summed(_summed(padded, size), size).transpose(0, 2, 1))
    return images.repeat(2, 1).repeat(2, 2)[:, :height, :width]


def _summed(images: Array, size: int) -> Array:
    """Return the sums of so many neighbours along the second axis, which gets shorter. They grow by twos."""
    count = images.shape[1] - size + 1
    total, done = np.zeros_like(images[:, :count]), 0
    for k in range(size.bit_length()):
        if k:
            images = images[:, : -(1 << k - 1)] + images[:, 1 << k - 1 :]
        if size >> k & 1:
            total += images[:, done : done + count]
            done += 1 << k
    return total
