"""Compares what is drawn of points with ray-traced truth: forms, samples, angles, sizes; and where splats are lit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from ..renderer.renderer import Renderer
from ..scene.appearance import FRAME_SPLATS, Material, Shading
from ..scene.camera import Camera, orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from .form_truth import LARGEST, MIDDLE, Truth, source_frames, trace_seen
from .measure import clocked
from .picture_scores import decibels, outline_distance
from .scenes import standard_camera
from .tracing import Array, encode

SAMPLES = 1, 4, 16
YAWS = 0, 15, 30, 60
SCALES = 0.25, 1, LARGEST  # pixels of the view for each of the source, on a side
LIGHT = Light(position=(-1.0, -1.0, -0.5))
LIT_ROUNDS = 7  # of a few quick steps
MADE, RESOLVED, PHONG = "flat, lit in the vertex shader", "flat, lit in the resolve pass", "phong, in the resolve pass"
Advance = Callable[[], None]


class Job(NamedTuple):
    """One picture."""

    samples: int
    scale: float
    splat: str


class View(NamedTuple):
    """Who looks, at which size, and the truth."""

    camera: Camera
    pose: Array
    truth: Truth


def jobs() -> Iterator[Job]:
    """In this order no picture is the last one with more samples, which would cost less."""
    return (Job(*values) for values in product(SAMPLES, SCALES, FRAME_SPLATS))


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


def view_of(source: Camera, scale: float, pose: Array, truth: Truth) -> View:
    width, height = (round(scale * side) for side in (source.width, source.height))
    return View(source.resized(width, height), pose, truth.reduced(round(LARGEST / scale)))


def measure_view(
    renderer: Renderer, scene: Frame, objects: Frame, views: dict[float, View], rounds: int, advance: Advance
) -> list[dict[str, Any]]:
    laps: dict[Job, list[float]] = {job: [] for job in jobs()}
    scores: dict[Job, dict[str, float]] = {}
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


def measure_lit(renderer: Renderer, scene: Frame, view: View) -> list[dict[str, Any]]:
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
