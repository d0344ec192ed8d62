"""Finds what several photographs of one view, each under its own light, say about one albedo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .light_fit import FoundLight, fit_light
from .light_pairs import Array
from .photo_shading import PhotoSamples, find_shading

ROUNDS = 3  # of lights from the albedo, and of the albedo under these lights
FITS = 8  # of a light, each without what the last one missed
OFF = 3.0  # times the median miss: more is shadow or highlight
SHADED = 1e-3  # weight of what no light reaches
APART = 0.3  # difference of log albedo at which photographs contradict each other
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


def share_albedo(photos: Sequence[PhotoSamples]) -> list[LitPhoto]:
    """Find the light of each photograph, so that all agree on one albedo. They have one camera, and things at rest."""
    lights = [fit_light(p.unclipped, p.surfaces) for p in photos]
    brightness = [p.brightness for p in photos]
    known = [p.is_known for p in photos]
    for k in range(ROUNDS + 1):
        found = [find_shading(p, light) for p, light in zip(photos, lights, strict=True)]
        weights = np.array([
            ok * (p.colors[..., 3] == 1) * np.exp(2 * shading) * (lit**2 + SHADED)
            for p, ok, (shading, lit) in zip(photos, known, found, strict=True)
        ])
        albedos = np.array([y - shading for y, (shading, _) in zip(brightness, found, strict=True)])
        albedo, exposures, weights = _agreed(albedos, weights)
        if k < ROUNDS:
            lights = [
                _refitted(p, y - e - albedo, w, light)
                for p, y, e, w, light in zip(photos, brightness, exposures, weights, lights, strict=True)
            ]
    seen = weights.sum(0) > 0
    top = float(np.percentile(albedo[seen], 99)) if seen.any() else 0.0
    return [
        LitPhoto(light, (BRIGHTEST - top - e - shading).astype(np.float32), w.astype(np.float32))
        for light, e, (shading, _), w in zip(lights, exposures, found, weights, strict=True)
    ]


def _agreed(albedos: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Return (h, w) the log albedo on which photographs (n, h, w) agree, (n,) their log exposures over the mean, and
    their weights, less where they contradict the others."""
    exposures, given = np.zeros(len(albedos)), weights
    for _ in range(6):
        total = np.maximum(weights.sum(0), 1e-9)
        albedo = (weights * (albedos - exposures[:, None, None])).sum(0) / total
        off = albedos - exposures[:, None, None] - albedo
        steps = [np.average(o, weights=w) if w.sum() else 0.0 for o, w in zip(off, weights, strict=True)]
        exposures = exposures + steps - np.mean(steps)
        weights = given / (1 + (off / APART) ** 2)
    return albedo, exposures, weights


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
