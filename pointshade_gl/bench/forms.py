"""Compares what is drawn of points with ray-traced truth: estimators, shadings, forms, samples, angles, sizes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from ..renderer.renderer import Renderer
from ..scene.appearance import FRAME_SPLATS, NOT_LIT, SHADINGS, Material, Shading, Splat
from ..scene.camera import Camera, moved, orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from ..scene.noise import Method
from .measure import CONDITIONS, clocked, generator
from .scenes import box, pose_at, standard_camera
from .tracing import (
    NEIGHBOURS,
    Array,
    Hits,
    TracedSurface,
    as_frame,
    encode,
    moved_surface,
    plane,
    shade,
    sphere,
    sphere_and_wall,
    trace,
)

LARGEST = 4  # pixels of the largest view on each side of a pixel of the source
RAYS = 2  # on each side of a pixel of that view
ROWS = 128  # of rays that are traced at once
SEEN = 1e-4  # share of the distance by which a point may lie behind the first surface and still be seen


@dataclass(frozen=True)
class Truth:
    """Means over the pixels (h, w) of a view.

    known    share of the pixel that shows something that the source saw
    light    (h, w, 3) linear, of that part
    objects  share that shows objects which the source saw, as if there was no wall
    """

    known: Array
    light: Array
    objects: Array

    def reduced(self, by: int) -> Truth:
        """In a picture so many times as small."""
        known = _means(self.known, by)
        light = _means(self.known[..., None] * self.light, by) / np.maximum(known, 1e-9)[..., None]
        return Truth(known, light, _means(self.objects, by))


def texture(points: Array) -> Array:
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.5 + 0.4 * np.stack([np.sin(40 * x + 17 * y), np.sin(31 * y - 25 * z), np.cos(37 * x - 28 * z)], -1)


def surfaces(far: bool) -> list[TracedSurface]:
    """The ball and the box; far: their other sides, seen from inside."""
    cube = moved_surface(box((0.17, 0.22, 0.17), far), pose_at((0.42, 0.1, 1.45), 35, 15))
    return [sphere((-0.25, 0.0, 1.5), 0.33, texture, far), replace(cube, albedo=texture)]


WALL = plane((0.1, -0.06, -1), (0, 0, 2.4), texture)
MIDDLE = (0.0, 0.0, 1.5)  # which the views turn about


def source_frames(camera: Camera) -> tuple[Frame, Frame]:
    """What a perfect camera takes at the origin: the scene, and its objects without the wall."""
    objects = surfaces(False)
    return as_frame(trace([*objects, WALL], camera), camera), as_frame(trace(objects, camera), camera)


def trace_seen(source: Camera, pose: Array, light: Light, material: Material) -> Truth:
    """The view of a camera like the source's at a pose (4, 4), LARGEST times as large, lit.

    A surface shows the light that falls on the side that the source saw, from behind as well.
    """
    fine = source.resized(LARGEST * RAYS * source.width, LARGEST * RAYS * source.height)
    bands = [_trace_band(band, source, pose, light, material).reduced(RAYS) for band in _bands(fine)]
    parts = ((band.known, band.light, band.objects) for band in bands)
    return Truth(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _bands(camera: Camera) -> Iterator[Camera]:
    """Cameras that see some rows of its picture each, from the top."""
    for first in range(0, camera.height, ROWS):
        yield replace(camera, cy=camera.cy - first, height=min(ROWS, camera.height - first))


def _trace_band(camera: Camera, source: Camera, pose: Array, light: Light, material: Material) -> Truth:
    rays, eye = camera.rays() @ pose[:3, :3].T, pose[:3, 3]
    depth, normals = np.full(rays.shape[:-1], np.inf), np.zeros(rays.shape)
    objects = np.zeros(depth.shape)
    near = [*surfaces(False), WALL]
    for surface in (*surfaces(False), *surfaces(True), WALL):
        t, n = surface.meet(eye, rays)
        nearer = t < depth
        nearer[nearer] = _is_seen(eye + t[nearer][:, None] * rays[nearer], near, source)
        depth[nearer], normals[nearer] = t[nearer], n[nearer]
        if surface is not WALL:
            objects[nearer] = 1
    known = np.isfinite(depth)
    points = eye + np.where(known, depth, 1)[..., None] * rays
    normals *= np.where((normals * points).sum(-1, keepdims=True) > 0, -1, 1)  # towards the source
    hits = Hits(np.where(known, depth, 0), points, normals, texture(points), known.astype(np.int64) - 1)
    return Truth(known.astype(float), shade(hits, light, material, eye), objects)


def _is_seen(points: Array, near: Sequence[TracedSurface], source: Camera) -> np.ndarray:
    """Whether a camera at the origin sees these points (n, 3) of the surfaces."""
    at = source.project(points)
    inside = (at > -0.5).all(-1) & (at < (source.width - 0.5, source.height - 0.5)).all(-1)
    first = np.min([surface.meet(np.zeros(3), points)[0] for surface in near], 0)
    return inside & (first > 1 - SEEN)


def _means(values: Array, by: int) -> Array:
    """Over squares of so many pixels a side."""
    height, width = values.shape[0] // by, values.shape[1] // by
    return values.reshape(height, by, width, by, *values.shape[2:]).mean((1, 3))


SAME_DEPTH = 0.01  # two depths that differ by less than this share belong to one surface
TOGETHER = 1 << 22  # pairs of pixels that are compared at once


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


def outline(mask: np.ndarray) -> np.ndarray:
    """(n, 2) pixels of a mask at its border, without those at the picture's."""
    inside = mask[1:-1, :-2] & mask[1:-1, 2:] & mask[:-2, 1:-1] & mask[2:, 1:-1]
    return np.argwhere(mask[1:-1, 1:-1] & ~inside) + 1


def outline_distance(drawn: np.ndarray, true: np.ndarray) -> float:
    """Pixels from the outline of one mask to the nearest of the other, mean; the picture's diagonal without any."""
    ours, theirs = outline(drawn).astype(np.float32), outline(true).astype(np.float32)
    if not len(ours) or not len(theirs):
        return float(np.hypot(*drawn.shape))
    parts = np.array_split(ours, -(-len(ours) * len(theirs) // TOGETHER))
    nearest = [np.sqrt(((part[:, None] - theirs) ** 2).sum(-1).min(1)) for part in parts]
    return float(np.concatenate(nearest).mean())


SAMPLES = 1, 4, 16
YAWS = 0, 15, 30, 60
SCALES = 0.25, 1, LARGEST  # pixels of the view for each of the source, on a side
LIGHT = Light(position=(-1.0, -1.0, -0.5))
LIT_ROUNDS = 7  # of a few quick steps
MADE, RESOLVED, PHONG = "flat, lit in the vertex shader", "flat, lit in the resolve pass", "phong, in the resolve pass"
Advance = Callable[[], None]


class FormJob(NamedTuple):
    """One picture."""

    samples: int
    scale: float
    splat: str


class FormView(NamedTuple):
    """Who looks, at which size, and the truth."""

    camera: Camera
    pose: Array
    truth: Truth


def jobs() -> Iterator[FormJob]:
    """In this order no picture is the last one with more samples, which would cost less."""
    return (FormJob(*values) for values in product(SAMPLES, SCALES, FRAME_SPLATS))


def count_forms(rounds: int) -> int:
    """How many times `measure_forms` will call `advance`."""
    return len(YAWS) * (1 + len(list(jobs())) * (rounds + 1) + 1)


def measure_forms(renderer: Renderer, size: tuple[int, int], rounds: int, advance: Advance) -> dict[str, Any]:
    """{size, rows, lit}: the scores of each form at each angle, size and number of samples, and where splats are lit.

    size    of the source picture, multiples of 4
    rounds  of timing, interleaved, after one that is not timed

    A row has yaw, scale, splat, samples, ms (of `Renderer.render`, a new view, by the wall clock) and the values of
    `score_form`; a row of `lit` has yaw, way, ms (of the steps that draw points) and psnr.
    """
    source = standard_camera(*size)
    scene, objects = source_frames(source)
    rows, lit = [], []
    with Renderer(context=renderer.context.gl, rasterizer="points") as points:
        for yaw in YAWS:
            pose = orbit_pose(None, MIDDLE, yaw, 8 if yaw else 0)
            truth = trace_seen(source, pose, LIGHT, Material())
            views = {scale: view_of(source, scale, pose, truth) for scale in SCALES}
            advance()
            rows += [{"yaw": yaw} | row for row in measure_view(renderer, scene, objects, views, rounds, advance)]
            lit += [{"yaw": yaw} | row for row in measure_lit(points, scene, views[1])]
            advance()
    return {"size": list(size), "rows": rows, "lit": lit}


def view_of(source: Camera, scale: float, pose: Array, truth: Truth) -> FormView:
    width, height = (round(scale * side) for side in (source.width, source.height))
    return FormView(source.resized(width, height), pose, truth.reduced(round(LARGEST / scale)))


def measure_view(
    renderer: Renderer, scene: Frame, objects: Frame, views: dict[float, FormView], rounds: int, advance: Advance
) -> list[dict[str, Any]]:
    laps: dict[FormJob, list[float]] = {job: [] for job in jobs()}
    scores: dict[FormJob, dict[str, float]] = {}
    for turn in range(rounds + 1):
        for job in jobs():
            view = views[job.scale]
            options: dict[str, Any] = {"camera": view.camera, "pose": view.pose, "normals": "star", "splat": job.splat}
            image, ms = clocked(partial(renderer.render, scene, LIGHT, samples=job.samples, **options))
            laps[job].append(ms)
            if turn == 0:
                alone = renderer.render(objects, LIGHT, samples=job.samples, **options)
                scores[job] = score_form(image, alone, view.truth)
            advance()
    return [job._asdict() | {"ms": median(laps[job][1:])} | scores[job] for job in jobs()]


def measure_lit(renderer: Renderer, scene: Frame, view: FormView) -> list[dict[str, Any]]:
    """The same view by GL points: lit in the vertex shader, or in the passes after it."""
    laps: dict[str, list[float]] = {MADE: [], RESOLVED: [], PHONG: []}
    images = {}
    options: dict[str, Any] = {"camera": view.camera, "pose": view.pose, "normals": "star"}
    steps = renderer.steps
    elsewhere: dict[str, Any] = options | {"pose": orbit_pose(view.pose, MIDDLE, 1)}

    def draw(way: str, names: Sequence[str], shading: Shading) -> None:
        steps.laps.clear()
        images[way] = renderer.render(scene, LIGHT, shading=shading, **options)
        laps[way].append(sum(lap.wall_ms for name, lap in steps.laps.items() if name in names))

    steps.timed = True
    for _ in range(LIT_ROUNDS + 1):
        renderer.render(scene, LIGHT, shading="flat", **elsewhere)
        draw(MADE, ["lit splats"], "flat")
        steps.forget("splats")
        draw(RESOLVED, ["splats", "light", "resolve"], "flat")  # a second light on a view takes this way
        steps.forget("splats")
        draw(PHONG, ["splats", "resolve"], "phong")
    steps.timed = False
    return [{"way": way, "ms": median(laps[way][1:]), "psnr": psnr(images[way], view.truth)} for way in laps]


def score_form(image: np.ndarray, alone: np.ndarray, truth: Truth) -> dict[str, float]:
    """How close a picture comes to the truth, edges included.

    image    (h, w, 4) uint8, of the scene
    alone    the same of its objects without the wall

    psnr     dB, of the drawn pixels all of which the source saw
    holes    share of these pixels that are not drawn
    spill    share of the pixels drawn of the objects where none belongs
    outline  pixels from the objects' drawn outline to the true one, mean
    """
    known, objects, mine = truth.known > 1 - 1e-9, truth.objects >= 0.5, alone[..., 3] > 127
    return {
        "psnr": psnr(image, truth),
        "holes": float((known & (image[..., 3] <= 127)).sum() / max(known.sum(), 1)),
        "spill": float((mine & ~objects).sum() / max(mine.sum(), 1)),
        "outline": outline_distance(mine, objects),
    }


def psnr(image: np.ndarray, truth: Truth) -> float:
    judged = (truth.known > 1 - 1e-9) & (image[..., 3] > 127)
    error = image[judged][:, :3].astype(float) - np.round(encode(truth.light[judged]))
    return decibels(error) if judged.any() else 0.0


SPOILED = "clean", "1mm-noise", "kinect"
SHAPES: tuple[Splat, ...] = "footprint", "round"  # of splats; meshes: forms.py
LIT: tuple[Shading, ...] = tuple(shading for shading in SHADINGS if shading not in NOT_LIT)
PICTURE_LIGHT, YAW = Light(position=(-1.0, -1.0, -0.5)), 15


def turned(source: Hits, camera: Camera) -> tuple[Array, Hits, Array, np.ndarray]:
    """The sphere and the wall from the side: pose, what is hit, that in sRGB (0..255) by LIGHT, what the source saw."""
    pose = orbit_pose(None, (0, 0, 1.8), YAW)
    hits = trace(sphere_and_wall(), camera, pose)
    truth = encode(shade(hits, PICTURE_LIGHT, Material(), pose[:3, 3]))
    return pose, hits, truth, co_visible(hits, source, camera, np.eye(4))


def count_pictures(methods: Sequence[Method], rounds: int) -> int:
    """How many times `measure_pictures` will call `advance`."""
    return len(SPOILED) * len(methods) * len(LIT) * len(SHAPES) * (rounds + 1)


def measure_pictures(
    renderer: Renderer,
    size: tuple[int, int],
    methods: Sequence[Method],
    rounds: int,
    seed: int,
    advance: Callable[[], None],
) -> dict[str, Any]:
    """PSNR and milliseconds of a sphere before a wall, seen from 15 degrees to the side: {condition: [row, ...]}.

    The time is that of `Renderer.render`, from arrays to array, by the wall clock: the median of interleaved rounds.
    """
    camera = standard_camera(*size)
    source = trace(sphere_and_wall(), camera)
    pose, hits, truth, seen = turned(source, camera)
    colors = as_frame(source, camera).color
    numbers = np.repeat(source.surface[..., None] + 1, 3, -1).astype(np.uint8)
    found: dict[str, Any] = {"size": list(size), "yaw": YAW, "rows": {}}
    for name in SPOILED:
        depth = CONDITIONS[name].spoil(source.depth, CONDITIONS[name].strength, generator(seed, name, "picture"))
        frame, numbered = Frame(colors, depth, camera), Frame(numbers, depth, camera)
        shown = {
            splat: renderer.render(numbered, pose=pose, shading="none", splat=splat)[..., 0].astype(int) - 1
            for splat in SHAPES
        }
        jobs = list(product(methods, LIT, SHAPES))
        laps: dict[tuple[Method, Shading, Splat], list[float]] = {job: [] for job in jobs}
        rows = []
        for turn in range(rounds + 1):  # the first one warms up; its pictures are scored
            for job in jobs:
                method, shading, splat = job
                options: dict[str, Any] = {"normals": method, "shading": shading, "splat": splat}
                image, ms = clocked(partial(renderer.render, frame, PICTURE_LIGHT, pose=pose, **options))
                laps[job].append(ms)
                if turn == 0:
                    score = score_picture(image, shown[splat], truth, hits, seen)
                    rows.append({"method": method, "shading": shading, "splat": splat} | vars(score))
                advance()
        found["rows"][name] = [row | {"ms": median(laps[job][1:])} for job, row in zip(jobs, rows, strict=True)]
    return found
