"""Several noisy views of generated glossy things whose colours without highlights are known."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.measure import add_kinect_noise, generator, round_disparity
from pointshade_gl.bench.scenes import box, pose_at, standard_camera
from pointshade_gl.bench.tracing import Array, Hits, TracedSurface, encode, moved_surface, plane, sphere, trace

from ..benchmarks.traced_light import shade

PIVOT = (0.0, 0.05, 1.6)
VIEWS = (-30, 6), (-15, 14), (0, 4), (15, 12), (30, 8)  # yaw and pitch, degrees
NEW_VIEWS = (-8, 9), (3, 5), (8, 8)  # between them
NEAREST = 2  # frames whose highlights are judged in a new view: what they see it shows
INSIDE = 8.0  # of 255 steps by which a highlight shows
COLOR_NOISE = 2.0  # steps


@dataclass(frozen=True)
class Scene:
    """What is there, and what is seen from the poses of frames."""

    light: ps.Light
    gloss: Array
    parts: list[TracedSurface]
    taken: list[tuple[Array, Hits]]  # pose, and what is hit from there


class GlossyViews:
    """Frames of a scene, and what new views of it show.

    frames   with the highlights of one light in their colours
    camera   of all of them and of new views
    """

    def __init__(self, scene: Scene, frames: list[ps.Frame], camera: ps.Camera):
        self._scene, self.frames, self.camera = scene, frames, camera

    def with_frames(self, frames: list[ps.Frame]) -> GlossyViews:
        """Other frames of the scene; highlights are where those of these frames are."""
        other = GlossyViews(self._scene, frames, self.camera)
        other.truths = self.truths
        return other

    @cached_property
    def truths(self) -> list[tuple[Array, Array, Array]]:
        """Of each new view: pose, (h, w, 3) sRGB without highlights, 0..255, and (h, w) in which part of it the frames
        nearest to it have a highlight."""
        light, gloss, truths = self._scene.light, self._scene.gloss, []
        for yaw, pitch in NEW_VIEWS:
            pose = ps.orbit_pose(None, PIVOT, yaw, pitch)
            hits = trace(self._scene.parts, self.camera, pose)
            plain = encode(_picture(hits, light, 0 * gloss, pose))
            shown = np.zeros(plain.shape[:2])
            for frame in sorted(self.frames, key=lambda one: np.linalg.norm(one.pose[:3, 3] - pose[:3, 3]))[:NEAREST]:
                seen = encode(_picture(hits, light, gloss, frame.pose)) - plain
                shown = np.maximum(shown, seen.mean(-1) * _is_visible(hits, frame))
            truths.append((pose, plain, shown > INSIDE))
        return truths


def glossy_views(seed: int, size: tuple[int, int] = (640, 480), matt: bool = False) -> GlossyViews:
    """Balls and a box before a wall, plain and textured, coloured, grey and white. matt: without highlights"""
    scene, camera, frames = _scene(seed, size), standard_camera(*size), []
    for k, (pose, hits) in enumerate(scene.taken):
        colors = encode(_picture(hits, scene.light, scene.gloss * (not matt), pose))
        frames.append(_taken(hits, colors, camera, pose, generator(seed, "view", str(k))))
    return GlossyViews(scene, frames, camera)


@lru_cache(4)
def _scene(seed: int, size: tuple[int, int]) -> Scene:
    chance, camera = generator(seed, "glossy"), standard_camera(*size)
    parts, gloss = _parts(chance)
    towards = np.array((*chance.uniform((-0.7, -1.1), (0.7, -0.5)), -1.0))
    light = ps.Light(direction=tuple((-towards).tolist()))
    poses = [
        ps.orbit_pose(None, PIVOT, yaw + chance.uniform(-3, 3), pitch + chance.uniform(-3, 3)) for yaw, pitch in VIEWS
    ]
    return Scene(light, gloss, parts, [(pose, trace(parts, camera, pose)) for pose in poses])


def errors_of(renderer: ps.Renderer, views: GlossyViews, **options) -> tuple[float, float]:
    """Mean absolute difference of new views from the truth, in steps of 255: inside highlights, and outside them."""
    inside, outside = [], []
    for pose, plain, shown in views.truths:
        picture = renderer.render(views.frames, camera=views.camera, pose=pose, shading="none", **options)
        off, drawn = np.abs(picture[..., :3] - plain).mean(-1), picture[..., 3] > 0
        inside.append(off[shown & drawn])
        outside.append(off[~shown & drawn])
    return float(np.concatenate(inside).mean()), float(np.concatenate(outside).mean())


def _parts(chance: np.random.Generator) -> tuple[list[TracedSurface], Array]:
    """The surfaces of a scene; strength and exponent of the highlights on each."""
    color = chance.uniform(0.08, 0.5, 3)
    color[chance.integers(3)] = 0.04
    paints = [_plain(color), _plain(chance.uniform(0.12, 0.4)), _plain(0.6), _waves(chance), _checks(chance)]
    order = chance.permutation(5)
    places = [(-0.48, 0.12, 1.65), (-0.16, 0.16, 1.4), (0.2, 0.13, 1.55), (0.5, 0.1, 1.7)]
    radii = chance.uniform(0.13, 0.19, 4)
    balls = [
        sphere(np.array(at) + chance.uniform(-0.03, 0.03, 3), radius, paints[k])
        for at, radius, k in zip(places, radii, order, strict=False)
    ]
    turned = pose_at((0.1, -0.2, 1.85), chance.uniform(10, 60), chance.uniform(-30, 30))
    cube = moved_surface(replace(box((0.14, 0.1, 0.12)), albedo=paints[order[4]]), turned)
    table = plane((0, -1, -0.05), (0, 0.3, 1.6), _waves(chance))
    wall = plane((*chance.normal(0, 0.1, 2), -1), (0, 0, 2.5), _checks(chance))
    gloss = np.stack([chance.uniform(0.4, 0.9, 7), chance.uniform(12, 60, 7)], -1)
    gloss[5:, 0] *= (0.3, 0)
    return [*balls, cube, table, wall], gloss


def _plain(color):
    return lambda points: np.broadcast_to(color, points.shape)


def _waves(chance):
    ways, phases = chance.normal(0, 18, (3, 3)), chance.uniform(0, 6.3, 3)
    base = chance.uniform(0.2, 0.4, 3)
    return lambda points: base * (1 + 0.4 * np.sin(points @ ways.T + phases))


def _checks(chance):
    dark, bright = np.sort(chance.uniform(0.05, 0.5, (2, 3)), 0)
    return lambda points: np.where(
        (np.floor(points / 0.05 + 0.3).astype(int).sum(-1) % 2 == 0)[..., None], dark, bright
    )


def _picture(hits: Hits, light: ps.Light, gloss: Array, pose: Array) -> Array:
    """Linear RGB of what was hit, as it looks from a pose."""
    matt = shade(hits, light, ps.Material(0.35, 0.65, 0), pose[:3, 3])
    for k, (strength, exponent) in enumerate(gloss):
        here = hits.surface == k
        if strength and here.any():
            some = Hits(*(getattr(hits, field.name)[here] for field in fields(Hits)))
            matt[here] = shade(some, light, ps.Material(0.35, 0.65, strength, max(exponent, 1)), pose[:3, 3])
    return matt


def _is_visible(hits: Hits, frame: ps.Frame) -> Array:
    """Whether a frame has the points that were hit."""
    camera, there = frame.camera, (hits.points - frame.pose[:3, 3]) @ frame.pose[:3, :3]
    z = np.maximum(there[..., 2], 1e-6)
    u = np.clip(np.rint(camera.fx * there[..., 0] / z + camera.cx), 0, camera.width - 1).astype(int)
    v = np.clip(np.rint(camera.fy * there[..., 1] / z + camera.cy), 0, camera.height - 1).astype(int)
    return np.abs(frame.depth[v, u] / z - 1) < 0.02


def _taken(hits: Hits, colors: Array, camera: ps.Camera, pose: Array, chance: np.random.Generator) -> ps.Frame:
    depth = round_disparity(add_kinect_noise(hits.depth, 1, chance), 1 / 8, chance)
    noisy = np.clip(np.round(colors + chance.normal(0, COLOR_NOISE, colors.shape)), 0, 255).astype(np.uint8)
    return ps.Frame(noisy, np.where(hits.depth > 0, depth, 0), camera, pose)
