"""Lights what was traced, and compares pictures with this truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pointshade_gl.bench.tracing import NEIGHBOURS, Array, Hits, encode, sphere_and_wall, trace
from pointshade_gl.scene.appearance import Material
from pointshade_gl.scene.camera import Camera, moved, orbit_pose
from pointshade_gl.scene.light import Light, unit


def shade(
    hits: Hits, light: Light, material: Material, eye: ArrayLike, shadow: NDArray[np.bool_] | None = None
) -> Array:
    """Linear RGB of what was hit, by the formula of shaders/common/phong.glsl, in float64.

    shadow  (h, w) where the light does not arrive
    """
    v = np.asarray(eye, float) - hits.points
    v /= np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)
    if light.position is not None:
        to_light = np.array(light.position) - hits.points
        distance = np.linalg.norm(to_light, axis=-1, keepdims=True)
        kc, kl, kq = light.attenuation
        strength = 1 / (kc + kl * distance + kq * distance**2)
    else:
        assert light.direction is not None, "a traced light needs a position or a direction"
        to_light, strength = np.broadcast_to(-np.array(light.direction), v.shape), np.ones((*v.shape[:-1], 1))
        distance = np.linalg.norm(to_light, axis=-1, keepdims=True)
    to_light = to_light / distance
    NoL = (hits.normals * to_light).sum(-1, keepdims=True)
    r = 2 * NoL * hits.normals - to_light
    glint = material.specular * np.maximum((r * v).sum(-1, keepdims=True), 0) ** material.shininess * (NoL > 0)
    if light.position is not None and light.direction is not None:
        inner, outer = np.cos(np.radians(light.cone))
        along = -to_light @ unit(light.direction)
        inside = np.clip((along - outer) / max(inner - outer, 1e-4), 0, 1)[..., None]
        strength = strength * (np.maximum(along, 0)[..., None] if light.is_area else inside**2 * (3 - 2 * inside))
    if shadow is not None:
        strength = strength * ~shadow[..., None]
    arriving = strength * np.array(light.color) * light.intensity
    total = material.ambient * hits.albedo + arriving * (material.diffuse * hits.albedo * np.maximum(NoL, 0) + glint)
    return np.where(hits.surface[..., None] >= 0, np.clip(total, 0, 1), 0)


PICTURE_LIGHT, YAW = Light(position=(-1.0, -1.0, -0.5)), 15


def turned(source: Hits, camera: Camera) -> tuple[Array, Hits, Array, np.ndarray]:
    """The sphere and the wall from the side: pose, what is hit, that in sRGB (0..255) by LIGHT, what the source saw."""
    pose = orbit_pose(None, (0, 0, 1.8), YAW)
    hits = trace(sphere_and_wall(), camera, pose)
    truth = encode(shade(hits, PICTURE_LIGHT, Material(), pose[:3, 3]))
    return pose, hits, truth, co_visible(hits, source, camera, np.eye(4))


SAME_DEPTH = 0.01  # two depths that differ by less than this share belong to one surface


@dataclass(frozen=True)
class PictureScore:
    """Scores of one picture.

    psnr   dB, of the drawn pixels that the source saw, more than 2 pixels away from any edge of a surface
    holes  share of the co-visible pixels where nothing was drawn
    spill  share of the drawn pixels that show one surface where another one or nothing belongs
    """

    psnr: float
    holes: float
    spill: float


def decibels(error: np.ndarray) -> float:
    """PSNR of a picture that is off by so many of 255 steps."""
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-12)))


def near_edge(hits: Hits, reach: int = 2) -> np.ndarray:
    """Pixels within `reach` of another surface or of the empty background."""
    edge = np.zeros(hits.surface.shape, bool)
    for a, b in NEIGHBOURS:
        step = hits.surface[a] != hits.surface[b]
        edge[a] |= step
        edge[b] |= step
    for _ in range(reach - 1):
        grown = np.pad(edge, 1)
        edge = grown[1:-1, 1:-1] | grown[:-2, 1:-1] | grown[2:, 1:-1] | grown[1:-1, :-2] | grown[1:-1, 2:]
    return edge


def co_visible(hits: Hits, source: Hits, camera: Camera, pose: np.ndarray) -> np.ndarray:
    """Pixels of `hits` that the source saw too: all four source pixels round the point show its surface there."""
    points = moved(hits.points, np.linalg.inv(pose))
    seen = (hits.surface >= 0) & (points[..., 2] > 0)
    z = np.where(seen, points[..., 2], 1)
    u, v = (np.floor(part).astype(int) for part in camera.pixel_at(points[..., 0], points[..., 1], z))
    for du, dv in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column, row = np.clip(u + du, 0, camera.width - 1), np.clip(v + dv, 0, camera.height - 1)
        seen &= (column == u + du) & (row == v + dv) & (source.surface[row, column] == hits.surface)
        seen &= abs(source.depth[row, column] - z) < SAME_DEPTH * z
    return seen


def score_picture(
    image: np.ndarray, surface: np.ndarray, truth: np.ndarray, hits: Hits, seen: np.ndarray
) -> PictureScore:
    """Compares a picture with the truth.

    image    (h, w, 4) uint8
    surface  (h, w) number of the surface that each pixel shows, -1 for none
    truth    (h, w, 3) sRGB, 0..255, of `hits`
    seen     (h, w) from `co_visible`
    """
    drawn = image[..., 3] > 0
    judged = drawn & seen & ~near_edge(hits)
    error = image[judged][:, :3].astype(float) - np.round(truth[judged])
    spill = (surface[drawn] != hits.surface[drawn]).mean()
    return PictureScore(decibels(error), float((seen & ~drawn).sum() / seen.sum()), float(spill))
