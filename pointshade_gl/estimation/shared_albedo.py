"""Finds what several photographs of one view, each under its own light, say about one albedo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .light_fit import FoundLight, fit_light
from .light_pairs import Array
from .photo_shading import PhotoSamples, find_shading

ROUNDS = 3  # of lights from the albedo, and of the albedo under these lights
STEPS = 6  # of their exposures and of the weights
FITS = 8  # of a light, each without what the last one missed
OFF = 3.0  # times the median miss: more is shadow or highlight
SHADED = 1e-3  # weight of what no light reaches
APART = 0.3  # difference of log albedo at which photographs contradict each other
BRIGHTER = 0.1  # the same where one is brighter than others: it has a highlight there
BRIGHTEST = np.log(0.8)  # albedo of all but a hundredth of the picture


class LitPhoto(NamedTuple):
    """What was found of one of the photographs.

    light   that it was taken under
    gains   (h, w) float32: log of what linear light is multiplied by, so that the albedo remains
    weight  (h, w) float32: how much its albedo says there
    """

    light: FoundLight
    gains: Array
    weight: Array


class _Agreement(NamedTuple):
    """What n photographs agree on under their lights.

    albedo     (h, w), log
    exposures  (n,), log, over their mean
    shadings   (n, h, w), log
    weights    (n, h, w): less where a photograph contradicts the others
    """

    albedo: Array
    exposures: Array
    shadings: Array
    weights: Array


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
    """Return what photographs agree on; the more light reaches a place in one of them, the more it says there."""
    pairs = [find_shading(photo, light) for photo, light in zip(photos, lights, strict=True)]
    shadings, lit = (np.array(parts) for parts in zip(*pairs, strict=True))
    told = np.array([p.is_known & (p.colors[..., 3] == 1) for p in photos])
    weights = given = told * np.exp(2 * shadings) * (lit**2 + SHADED)
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
    """Return the light that makes this log shading on known surfaces; the one before if nothing tells it."""
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
