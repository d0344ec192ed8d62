"""Photographs of generated scenes whose albedo and light are known: each is drawn anew from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.scenes import relief, standard_camera
from pointshade_gl.bench.tracing import Hits, TracedSurface, decode, encode, plane, sphere, trace

CAMERA = standard_camera(320, 240)
SHAPES = "blobs", "relief", "room"
TEXTURES = "plain", "waves", "grey waves", "patches", "grey patches", "stripes"
RELIT = np.array((0.75, -0.35, -0.56)), 0.15  # towards the light under which albedos are compared; ambient light
DEPTH_NOISE = 0.0005  # metres at one metre: standard deviation


@dataclass(frozen=True)
class Photograph:
    """A photograph, what it shows, and what it would show under `RELIT`, linear, up to a factor."""

    frame: ps.Frame
    hits: Hits
    relit: np.ndarray


def photograph(shape: str, texture: str, light: str, seed: int) -> Photograph:
    """A photograph of a shape, painted with a texture.

    light  "sun": one direction that casts hard shadows, and ambient light; "sky": from above, smoothly; or "ambient"
    """
    chance = np.random.default_rng([seed, *map(ord, shape + texture + light)])
    parts, balls = _parts(shape, _paint(texture, chance), chance)
    hits = trace(parts, CAMERA)
    color = 1 + 0.15 * chance.normal(size=3) * chance.integers(2)  # half of the lights are coloured
    shading = _shading(hits, balls, light, chance)
    linear = hits.albedo * shading[..., None] * color
    known = hits.surface >= 0
    linear /= np.percentile(linear[known], 99.5)
    noise = DEPTH_NOISE * hits.depth**2 * chance.normal(size=known.shape)
    picture = np.round(encode(np.clip(linear, 0, 1))).astype(np.uint8)
    towards, ambient = RELIT
    relit = hits.albedo * color * (ambient + (1 - ambient) * np.maximum(hits.normals @ towards, 0))[..., None]
    return Photograph(ps.Frame(picture, np.where(known, hits.depth + noise, 0), CAMERA), hits, relit)


def relit_psnr(renderer: ps.Renderer, shown: Photograph, unlight: bool = False) -> float:
    """How near a photograph comes to the truth when it is relit, after one exposure: decibels in sRGB."""
    towards, ambient = RELIT
    light = ps.Light(direction=tuple((-towards).tolist()))
    picture = renderer.render(shown.frame, light=light, material=ps.Material(ambient, 1 - ambient, 0), unlight=unlight)
    where = shown.hits.surface >= 0
    found, truth = decode(picture[..., :3].astype(float))[where], shown.relit[where]
    white = np.percentile(truth, 99.5)
    found *= (found * truth).sum() / np.square(found).sum()
    off = encode(np.clip(found / white, 0, 1)) - encode(np.clip(truth / white, 0, 1))
    return float(10 * np.log10(255**2 / np.square(off).mean()))


def _parts(shape, paint, chance) -> tuple[list[TracedSurface], list[tuple[np.ndarray, float]]]:
    """The surfaces of a scene, and the balls among them, which cast shadows: centre and radius."""
    count = 4 if shape == "blobs" else 1 if shape == "relief" else 2
    middles = np.stack([chance.uniform(-0.5, 0.5, count), chance.uniform(-0.3, 0.3, count)], -1)
    balls = [
        (np.array((*xy, chance.uniform(1.2, 1.5))), chance.uniform(0.12, 0.3 if shape == "blobs" else 0.2))
        for xy in middles
    ]
    parts = [sphere(*ball, paint) for ball in balls]
    if shape == "blobs":
        return [*parts, plane((*chance.normal(0, 0.15, 2), -1), (0, 0, 1.9), paint)], balls
    if shape == "plane":
        return [plane((*chance.normal(0, 0.4, 2), -1), (0, 0, 1.6), paint)], []
    if shape == "relief":
        ways, phases = chance.normal(0, 7, (5, 2)), chance.uniform(0, 6.3, 5)
        waves = [0.012 * np.hypot(*way) ** -0.5 * 3 for way in ways]

        def height(x, y):
            return 1.7 + sum(a * np.sin(x * u + y * v + p) for a, (u, v), p in zip(waves, ways, phases, strict=True))

        return [*parts, TracedSurface(relief(height, 1.55, 1.85).meet, paint)], balls
    walls = [((1, 0, -0.5), (-0.8, 0, 2.0)), ((-0.7, 0, -0.7), (0.7, 0, 2.0)), ((0, -1, -0.3), (0, 0.5, 1.8))]
    return [*parts, *(plane(*wall, paint) for wall in walls)], balls


def _paint(texture, chance):
    """An albedo as a function of points."""
    ways, phases = chance.normal(0, 12, (3, 5, 3)), chance.uniform(0, 6.3, (3, 5))
    palette = chance.uniform(0.15, 0.85, (16, 3))
    tones = chance.uniform(0.15, 0.85, (16, 1)) * np.ones(3)
    base, way = chance.uniform(0.35, 0.75, 3), chance.normal(size=3)
    way *= 2 * np.pi / 0.09 / np.linalg.norm(way)

    def waves(points):
        return np.stack([np.sin(points @ w.T + p).sum(-1) / 5 for w, p in zip(ways, phases, strict=True)], -1)

    def cells(points):
        return np.floor(points / 0.12 + 0.37).astype(int) @ (3, 5, 7) % 16

    return {
        "plain": lambda points: np.broadcast_to(base, points.shape),
        "waves": lambda points: 0.5 + 0.25 * waves(points),
        "grey waves": lambda points: 0.5 + 0.25 * np.repeat(waves(points)[..., :1], 3, -1),
        "patches": lambda points: palette[cells(points)],
        "grey patches": lambda points: tones[cells(points)],
        "stripes": lambda points: np.where((np.sin(points @ way) > 0)[..., None], base, 0.35 * base),
    }[texture]


def _shading(hits, balls, light, chance):
    if light == "ambient":
        return np.ones(hits.depth.shape)
    if light == "sky":
        return 0.7 - 0.3 * hits.normals[..., 1]
    towards = np.array((*chance.normal(size=2), 0.0))
    towards *= chance.uniform(0.5, 0.9) / np.linalg.norm(towards)
    towards[2] = -np.sqrt(1 - towards @ towards)
    dark = np.zeros(hits.depth.shape, bool)
    for middle, radius in balls:
        way = middle - hits.points
        along = way @ towards
        apart = np.square(way).sum(-1) - along**2
        dark |= (along > 1e-3) & (apart < radius**2) & (np.abs(np.sqrt(np.square(way).sum(-1)) - radius) > 1e-6)
    return chance.uniform(0.1, 0.4) + np.where(dark, 0, np.maximum(hits.normals @ towards, 0))
