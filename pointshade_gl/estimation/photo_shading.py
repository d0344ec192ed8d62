"""How brightly each part of a photograph is lit, and what photographs under several lights show of one albedo."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.values import linear_to_srgb, srgb_to_linear
from .light_fit import DARK, LUMINANCE, Array, FoundLight, Index, fit_light, visible_light

CELLS = 0.3, 0.3, 0.02, 0.02  # standard deviations of place, in longer sides of the picture, and of chromaticity
MOST = 1200  # voters
REACH = 2  # cells that a blur looks at, on each side
OTHERS = 1e-3  # weight of all colours together, where none is alike


def ask(
    values: Array, voters: NDArray[np.bool_], red: Array, green: Array, asked: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return, (h, w) each, mean and standard deviation of the values of voters, weighed by distance and colour.

    A bilateral grid (Chen, Paris, Durand 2007): all voters at the cost of a few. There is one at least; red and green
    are shares of their sum with blue; where nobody asks both are 0.
    """
    spots = np.indices(values.shape, np.float32) / max(values.shape)
    places = np.stack([*spots, red, green]).reshape(4, -1) / np.array(CELLS, np.float32)[:, None]
    places -= np.floor(places.min(1, keepdims=True))
    shape = tuple((places.max(1).astype(int) + 2).tolist())
    chosen = np.flatnonzero(voters)
    chosen = chosen[:: -(-len(chosen) // MOST)]
    known = values.reshape(-1)[chosen]
    bilateral_grid = _gathered(places.take(chosen, 1), np.stack([np.ones_like(known), known, known**2]), shape)
    for axis in range(1, 5):
        bilateral_grid = _blurred_grid(bilateral_grid, axis)
    bilateral_grid = bilateral_grid.reshape(3, -1)
    bilateral_grid += OTHERS * bilateral_grid.mean(1, keepdims=True)
    wanted = np.flatnonzero(asked)
    weight, mean, square = _read(bilateral_grid, places.take(wanted, 1), shape)
    mean, square = mean / weight, square / weight
    answer = np.zeros((2, values.size), np.float32)
    answer[:, wanted] = mean, np.sqrt(np.maximum(square - mean**2, 0))
    return answer[0].reshape(values.shape), answer[1].reshape(values.shape)


def _gathered(places: Array, values: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, *shape) the sums of values (k, n) in the cells around their places (4, n)."""
    size, corners = int(np.prod(shape)), list(_corners(places, shape))
    index, weight = (np.concatenate(parts) for parts in zip(*corners, strict=True))
    sums = [np.bincount(index, weight * np.tile(row, len(corners)), size) for row in values]
    return np.array(sums, np.float32).reshape(-1, *shape)


def _read(grid: Array, places: Array, shape: tuple[int, ...]) -> Array:
    """Return (k, n) the values (k, cells) of a grid between its cells."""
    found = np.zeros((len(grid), places.shape[1]), np.float32)
    part = np.empty_like(found[0])
    for index, weight in _corners(places, shape):
        for sums, row in zip(found, grid, strict=True):
            row.take(index, out=part, mode="clip")
            part *= weight
            sums += part
    return found


def _corners(places: Array, shape: tuple[int, ...]) -> Iterator[tuple[Index, Array]]:
    """Yield the flat index and the weight of the 9 cells around each place: 3 in the picture times 3 in colour."""
    low = places.astype(int)
    shares = places - low.astype(np.float32)
    steps = [int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
    first = np.array(steps) @ low
    near, alike = (_triangle(*shares[k : k + 2], *steps[k : k + 2]) for k in (0, 2))
    for step, weight in near:
        corner = first + step
        for other_step, other_weight in alike:
            yield corner + other_step, weight * other_weight


def _triangle(one: Array, other: Array, step: int, other_step: int) -> list[tuple[Index | int, Array]]:
    """Return the steps from a square's lowest corner to those of the triangle around a place, and their weights."""
    least, most = np.minimum(one, other), np.maximum(one, other)
    return [(0, 1 - most), (np.where(one > other, step, other_step), most - least), (step + other_step, least)]


def _blurred_grid(grid: Array, axis: int) -> Array:
    """Blur a grid along an axis by a Gaussian of one cell, less what gathering and reading between cells blur."""
    grid = np.moveaxis(grid, axis, 0)
    blurred = grid.copy()
    for off in range(1, min(len(grid), REACH + 1)):
        weight = np.float32(np.exp(-0.5 * off**2 / (1 - 1 / 3)))
        blurred[off:] += weight * grid[:-off]
        blurred[:-off] += weight * grid[off:]
    return np.moveaxis(blurred, 0, axis)


DARKEST = 0.002  # linear light: darker differences are noise
LEAST_AMBIENT = 0.03  # over direct light
GRAZING = 0.05, 0.3  # n . l at which a sample begins to be lit, and is for certain
SURE = 0.99  # of being lit: so sure a voter is
SPREAD = 0.09  # squared deviation of log albedo: voters who differ more count little for one sample
HUE = 3.0  # samples: standard deviation of what shows the hue of dark ones
GREY = 5e-4  # linear light: weaker colours are noise
SHADOW, LIT = 5.0, 3.0  # samples: standard deviations of what neighbours share
LARGEST = 0.5  # correction of log shading where the light reaches
RANGE = np.log(0.02), np.log(1.5)  # of log shading
WHITE = 95  # percent of the picture are lit less than what keeps its brightness
GAINS = np.log(0.4), np.log(20)


@dataclass(frozen=True, eq=False)
class PhotoSamples:
    """Samples of a photograph and of what it shows."""

    colors: Array  # (h, w, 4) float32: linear RGB and 1; 0.5 where clipped, 0 where unknown
    surfaces: Array  # (h, w, 4) float32: unit normals, camera axes, towards the camera, and depth; 0 where unknown
    rays: Array  # (h, w, 3) float32 from the camera through the samples, z = 1
    size: tuple[float, float]  # of the whole frame, in samples

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
        """(h, w, 4) float32 linear RGB of what surrounds samples, and 0. Bright samples count most; dark is grey."""
        # that is the hue that dark samples should have, whose own is mostly noise
        red, green, blue, known = np.moveaxis(self.colors, -1, 0)
        blurred = _blurred(np.stack([red, green, blue]) * (known > 0), HUE) + np.float32(GREY)
        return np.stack([*blurred, np.zeros_like(known)], -1)

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
    for shadow, usual, most in zip((attached, cast), in_shadow, (np.inf, 0.0), strict=True):
        change += np.where(shadow, (1 - lit) * np.minimum(usual + trust * (miss - usual), most), 0)
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
    """Return the sums around each sample of images (n, h, w), about by a Gaussian: two boxes, one after another."""
    height, width = images.shape[1:]
    size = round(np.sqrt(1.5 * deviation**2 + 1))
    images = np.pad(images, ((0, 0), (0, height % 2), (0, width % 2)))  # over 2x2 samples: nothing finer would be left
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


ROUNDS = 3  # of lights from the albedo, and of the albedo under these lights
STEPS = 6  # of their exposures and of the weights
FITS = 8  # of a light, each without what the last one missed
OFF = 3.0  # times the median miss: more is shadow or highlight
SHADED = 1e-3  # weight of what no light reaches
APART = 0.3  # difference of log albedo at which photographs contradict each other
BRIGHTER = 0.1  # the same where one is brighter than others: it has a highlight there
BRIGHTEST = np.log(0.8)  # albedo of all but a hundredth of the picture


class LitPhoto(NamedTuple):
    """What was found of one of the photographs."""

    light: FoundLight  # that it was taken under
    gains: Array  # (h, w) float32: log of what linear light is multiplied by, so that the albedo remains
    weight: Array  # (h, w) float32: how much its albedo counts there


class _Agreement(NamedTuple):
    """What n photographs agree on under their lights."""

    albedo: Array  # (h, w), log
    exposures: Array  # (n,), log, over their mean
    shadings: Array  # (n, h, w), log
    weights: Array  # (n, h, w): less where a photograph contradicts the others


def share_albedo(photos: Sequence[PhotoSamples]) -> list[LitPhoto]:
    """Find the light of each photograph, so that all agree on one albedo. They have one camera, and things at rest."""
    lights = [fit_light(p.unclipped, p.surfaces) for p in photos]
    found = _agree(photos, lights)
    for _ in range(ROUNDS):
        lights = [
            _refitted(photo, photo.brightness - exposure - found.albedo, weight, light)
            for photo, exposure, weight, light in zip(photos, found.exposures, found.weights, lights, strict=True)
        ]
        found = _agree(photos, lights)
    seen = found.weights.sum(0) > 0
    top = float(np.percentile(found.albedo[seen], 99)) if seen.any() else 0.0
    gains = (BRIGHTEST - top - found.exposures[:, None, None] - found.shadings).astype(np.float32)
    return [LitPhoto(*one) for one in zip(lights, gains, found.weights.astype(np.float32), strict=True)]


def _agree(photos: Sequence[PhotoSamples], lights: Sequence[FoundLight]) -> _Agreement:
    """Return what photographs agree on; the more light reaches a place in one of them, the more it counts there."""
    pairs = [find_shading(photo, light) for photo, light in zip(photos, lights, strict=True)]
    shadings, lit = (np.array(parts) for parts in zip(*pairs, strict=True))
    usable = np.array([p.is_known & (p.colors[..., 3] == 1) for p in photos])
    weights = given = usable * np.exp(2 * shadings) * (lit**2 + SHADED)
    albedos = np.array([p.brightness for p in photos]) - shadings
    exposures, albedo = np.zeros(len(photos)), albedos[0]
    for _ in range(STEPS):
        alike = albedos - exposures[:, None, None]
        albedo = (weights * alike).sum(0) / np.maximum(weights.sum(0), 1e-9)
        off = alike - albedo
        steps = (weights * off).sum((1, 2)) / np.maximum(weights.sum((1, 2)), 1e-9)
        exposures = exposures + steps - steps.mean()
        weights = given / (1 + (off / np.where(off > 0, BRIGHTER, APART)) ** 2)
    return _Agreement(albedo, exposures, shadings, weights)


def _refitted(photo: PhotoSamples, shading: Array, weight: Array, light: FoundLight) -> FoundLight:
    """Return the light that makes this log shading on known surfaces; the one before if nothing shows it."""
    seen = (weight > 0) & np.isfinite(shading)
    n = np.concatenate([photo.surfaces[..., :3][seen], np.ones((seen.sum(), 1))], -1).astype(float)
    y = np.exp(np.clip(shading[seen], -5, 3))
    x = np.array((*light.direction, light.ambient))
    for _ in range(FITS):
        off = np.abs(n @ x - y)
        lit = (n[:, :3] @ x[:3] > 0) & (off < OFF * np.median(off[n[:, :3] @ x[:3] > 0]) + 1e-9) if len(y) else []
        if np.sum(lit) < 100:
            return light
        x = np.linalg.lstsq(n[lit], y[lit], rcond=None)[0]
    size = float(np.linalg.norm(x[:3]))
    if not size > 1e-3:
        return light
    direct = np.stack([np.maximum(n[:, :3] @ x[:3], 0), np.ones(len(y))], -1)
    strength, ambient = np.linalg.lstsq(direct, y, rcond=None)[0]
    if not strength > 0:
        return light
    a, b, c = (x[:3] / size).tolist()
    return FoundLight((a, b, c), max(float(ambient), 0.0) / (float(strength) * size), 1.0)


CLIPPED = 250  # of 255: a camera may have cut such a colour off
FAINT = 1e-4  # weight of such colours, and of what no photograph shows lit, over that of others


class AlbedoSum:
    """The weighted mean of albedos."""

    def __init__(self) -> None:
        self._sum: Array = np.zeros((1, 1, 4), np.float32)

    def add(self, color: NDArray[np.uint8], albedo: Array, weight: Array, size: tuple[float, float]) -> None:
        """Add the albedo (h, w, 3), sRGB, 0..1, of a photograph (h, w, 3|4) of this size in samples, and weights."""
        height, width = color.shape[:2]
        shares = _between(_between(weight, height, size[1]).T, width, size[0]).T
        shares = np.where(color[..., :3].max(-1) < CLIPPED, shares, 0) + FAINT * float(weight.max()) + 1e-9
        linear = srgb_to_linear(albedo.astype(np.float32))
        self._sum = self._sum + shares[..., None] * np.concatenate([linear, np.ones((height, width, 1))], -1)

    @property
    def color(self) -> NDArray[np.uint8]:
        """(h, w, 3), sRGB"""
        mean = self._sum[..., :3] / np.maximum(self._sum[..., 3:], 1e-12)
        return np.round(255 * linear_to_srgb(np.clip(mean, 0, 1))).astype(np.uint8)


def _between(rows: Array, count: int, samples: float) -> Array:
    """Return that many rows in place of those of samples, linearly between them."""
    at = np.clip((np.arange(count) + 0.5) * (samples / count) - 0.5, 0, len(rows) - 1)
    low = np.minimum(at.astype(int), max(len(rows) - 2, 0))
    part = (at - low)[:, None]
    return (1 - part) * rows[low] + part * rows[np.minimum(low + 1, len(rows) - 1)]


PATIENCE = 30  # frames after which the light is looked for again
ELSEWHERE = np.cos(np.radians(10)), 0.2  # cosine of a direction, and strength, that make it another light
STREAMS = 64  # that are remembered


class KeptLight(NamedTuple):
    """A light with its direction in the world, and for how many frames it has been used."""

    light: FoundLight
    direction: NDArray[np.float64]
    frames: int

    def is_other(self, found: FoundLight, direction: NDArray[np.float64]) -> bool:
        """Return whether a light was found that is not this one."""
        closest, weaker = ELSEWHERE
        return bool(direction @ self.direction < closest) or abs(found.strength - self.light.strength) > weaker


class StreamLights:
    """Finds the light in the frames of streams."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, KeptLight] = {}

    def find(self, photo: PhotoSamples, stream: Hashable, pose: NDArray[np.float64]) -> FoundLight:
        """Return the light in the next frame of a stream, at its pose (4, 4); of None, that of a frame of its own."""
        kept = None if stream is None else self._kept.pop(stream, None)
        if kept is None or kept.frames % PATIENCE == 0:
            found = fit_light(photo.unclipped, photo.surfaces)
            direction = pose[:3, :3] @ np.array(found.direction)
            if kept is None or kept.is_other(found, direction):
                kept = KeptLight(found, direction, 0)
        if stream is not None:
            self._kept[stream] = kept._replace(frames=kept.frames + 1)
            if len(self._kept) > STREAMS:
                del self._kept[next(iter(self._kept))]
        x, y, z = (pose[:3, :3].T @ kept.direction).tolist()
        return replace(kept.light, direction=(x, y, z))
