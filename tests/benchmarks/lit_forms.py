"""Compares the forms of points, and numbers of samples, with ray-traced truth: angles, sizes; where splats are lit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rich.console import Console
from traced_light import decibels, shade

from pointshade_gl.bench.charts import INK, brief, headline, new_figure, new_table, plain, png
from pointshade_gl.bench.measure import clocked
from pointshade_gl.bench.scenes import box, pose_at, standard_camera
from pointshade_gl.bench.tracing import (
    Array,
    Hits,
    TracedSurface,
    as_frame,
    encode,
    moved_surface,
    plane,
    sphere,
    trace,
)
from pointshade_gl.renderer.renderer import Renderer
from pointshade_gl.scene.appearance import FRAME_SPLATS, Material, Shading
from pointshade_gl.scene.camera import Camera, orbit_pose
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.light import Light

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LARGEST = 4  # pixels of the largest view on each side of a pixel of the source
RAYS = 2  # on each side of a pixel of that view
BAND_ROWS = 128  # of rays that are traced at once
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
    for first in range(0, camera.height, BAND_ROWS):
        yield replace(camera, cy=camera.cy - first, height=min(BAND_ROWS, camera.height - first))


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


MOST_PAIRS = 1 << 22  # of pixels that are compared at once


def outline(mask: np.ndarray) -> np.ndarray:
    """(n, 2) pixels of a mask at its border, without those at the picture's."""
    inside = mask[1:-1, :-2] & mask[1:-1, 2:] & mask[:-2, 1:-1] & mask[2:, 1:-1]
    return np.argwhere(mask[1:-1, 1:-1] & ~inside) + 1


def outline_distance(drawn: np.ndarray, true: np.ndarray) -> float:
    """Pixels from the outline of one mask to the nearest of the other, mean; the picture's diagonal without any."""
    ours, theirs = outline(drawn).astype(np.float32), outline(true).astype(np.float32)
    if not len(ours) or not len(theirs):
        return float(np.hypot(*drawn.shape))
    parts = np.array_split(ours, -(-len(ours) * len(theirs) // MOST_PAIRS))
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


FORMS = {"footprint": "#3d9463", "round": "#3f7fb5", "mesh": "#d03a2b"}
WAYS = {MADE: "^", RESOLVED: "v", PHONG: "o"}
LIT_COLOR = "#8a4f9e"
CHART_ROWS = (  # key, scale of the view, factor, label of the axis
    ("psnr", SCALES[0], 1, "a quarter the size\nPSNR, dB"),
    ("psnr", SCALES[1], 1, "the source's size\nPSNR, dB"),
    ("psnr", SCALES[2], 1, "four times the size\nPSNR, dB"),
    ("holes", 1, 100, "the source's size\nholes, %"),
    ("spill", 1, 100, "the source's size\nspill, %"),
    ("outline", 1, 1, "the source's size\noutline, pixels off"),
)


def form_chart(results: dict[str, Any]) -> bytes:
    """A PNG: a row of panels for each measure and size, a column for each angle; last, where splats are lit."""
    forms = results["forms"]
    yaws = list(dict.fromkeys(row["yaw"] for row in forms["rows"]))
    figure = new_figure(11.5)
    panels = figure.subplots(len(CHART_ROWS) + 1, len(yaws), sharex="row", sharey="row", squeeze=False)
    for (key, scale, factor, label), row in zip(CHART_ROWS, panels, strict=False):
        row[0].set_ylabel(label, fontsize=7.5)
        for yaw, axes in zip(yaws, row, strict=True):
            for form, color in FORMS.items():
                own = [r for r in forms["rows"] if (r["yaw"], r["scale"], r["splat"]) == (yaw, scale, form)]
                ms, values = [r["ms"] for r in own], [factor * r[key] for r in own]
                axes.plot(ms, values, color=color, lw=1, alpha=0.6)
                axes.scatter(ms, values, [6 + 8 * r["samples"] ** 0.5 for r in own], color=color, zorder=3)
        if key != "psnr":
            row[0].set_ylim(
                bottom=0, top=1.1 * max(factor * r[key] for r in forms["rows"] if r["scale"] == scale) + 1e-9
            )
    panels[-1][0].set_ylabel("splats by GL points\nPSNR, dB", fontsize=7.5)
    for yaw, axes in zip(yaws, panels[-1], strict=True):
        for row in forms["lit"]:
            if row["yaw"] == yaw:
                axes.plot(row["ms"], row["psnr"], WAYS[row["way"]], color=LIT_COLOR, ms=5, fillstyle=_fill(row["way"]))
    for yaw, axes in zip(yaws, panels[0], strict=True):
        axes.set_title(f"turned by {yaw}°" if yaw else "own camera", fontsize=9, fontweight="bold", color=INK)
    for axes in panels.flat:
        _set_clock(axes)
    width, height = forms["size"]
    where = results["gl"]["renderer"].split(" (")[0]
    figure.supxlabel(f"milliseconds for a new view of {width}x{height} points ({where}, wall clock)", fontsize=8.5)
    _legend(figure)
    return png(figure)


def _fill(way: str) -> Any:
    return "none" if way == RESOLVED else "full"


def _set_clock(axes: Axes) -> None:
    from matplotlib.ticker import LogLocator

    plain(axes)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    axes.minorticks_off()
    axes.xaxis.set_major_formatter("{x:g}")


def _legend(figure: Any) -> None:
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color=color, lw=2, label=form) for form, color in FORMS.items()]
    entries += [Line2D([], [], color=INK, lw=0, marker="o", ms=3, label="dots from left: 1, 4, 16 samples")]
    entries += [
        Line2D([], [], color=LIT_COLOR, lw=0, marker=mark, ms=5, fillstyle=_fill(way), label=way)
        for way, mark in WAYS.items()
    ]
    headline(figure, "Forms of points, and samples, against ray-traced truth", entries)


def show_forms(forms: dict[str, Any], console: Console) -> None:
    """Prints PSNR, holes, spill and outline of each form at the source's size, and where splats are lit."""
    yaws = list(dict.fromkeys(row["yaw"] for row in forms["rows"]))
    angles = [f"{yaw}°" for yaw in yaws]
    title = "forms at the source's size: PSNR dB / holes % / spill % / pixels that the outline is off"
    table = new_table(title, "form", "samples", "ms", *angles)
    rows = {(row["splat"], row["samples"], row["yaw"]): row for row in forms["rows"] if row["scale"] == 1}
    for splat, samples in dict.fromkeys(key[:2] for key in rows):
        own = [rows[splat, samples, yaw] for yaw in yaws]
        cells = [f"{r['psnr']:.1f}/{100 * r['holes']:.2f}/{100 * r['spill']:.2f}/{r['outline']:.2f}" for r in own]
        table.add_row(splat, str(samples), brief(median(r["ms"] for r in own)), *cells)
    console.print(table)
    table = new_table("splats by GL points: milliseconds to draw and light them / PSNR dB", "lit", *angles)
    for way in dict.fromkeys(row["way"] for row in forms["lit"]):
        table.add_row(way, *(f"{brief(r['ms'])}/{r['psnr']:.1f}" for r in forms["lit"] if r["way"] == way))
    console.print(table)
