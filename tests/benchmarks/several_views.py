"""Measures several views of one thing, and shows it as tables and as a chart.

Run by hand: pointshade bench --views [--quick] [-o FOLDER], in a clone.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from rich.console import Console
from traced_light import SAME_DEPTH, decibels, near_edge, shade

from pointshade_gl.bench import command
from pointshade_gl.bench.charts import INK, brief, headline, new_figure, new_table, plain, png, title, wide_console
from pointshade_gl.bench.measure import add_kinect_noise, angle, clocked, generator, round_disparity
from pointshade_gl.bench.scenes import box, pose_at, standard_camera
from pointshade_gl.bench.speed import peak_memory_mb
from pointshade_gl.bench.tracing import Array, Hits, TracedSurface, encode, moved_surface, plane, sphere, trace, waves
from pointshade_gl.estimation.multi_view import COMPARED
from pointshade_gl.notes.notes import silence
from pointshade_gl.renderer.renderer import Renderer
from pointshade_gl.scene.appearance import NORMALS_AT, Material, NormalsAt
from pointshade_gl.scene.camera import Camera, orbit_pose
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.light import Light
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.objects import PointObject

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PIVOT = (0.05, 0.1, 1.6)
YAWS, PITCHES = (-36.0, 36.0), (2.0, 20.0)  # degrees, between which the views stand
NEW_VIEW, STEP = (5.0, 9.0), 0.3  # yaw and pitch that are scored, and the degrees of a step of the path
LIGHT, MATERIAL = Light(position=(-1.0, -1.2, 0.0)), Material()
POSE_ERRORS = {"exact poses": 0.0, "poses 2 mm off": 0.002, "poses 1 cm off": 0.01}  # metres
TIMED = "poses 2 mm off"
Advance = Callable[[], None]


@dataclass(frozen=True)
class ViewsPlan:
    """How much is measured. counts: of views; path: pictures that flicker is measured on; rounds of timing."""

    size: tuple[int, int]
    counts: tuple[int, ...]
    path: int
    rounds: int


FULL_VIEWS = ViewsPlan((640, 480), (1, 2, 4, 8, 16, 30), 5, 3)
QUICK_VIEWS = ViewsPlan((160, 120), (1, 2, 4, 8), 3, 3)


def bench_views(output: Path, quick: bool, seed: int, device: int) -> str:
    """Writes results.json and chart.png of several views to a folder; prints tables. Returns one line about them."""
    command.prepare(output)
    plan = QUICK_VIEWS if quick else FULL_VIEWS
    silence()  # poses are wrong on purpose
    with command.progress(steps_of(plan)) as advance:
        results = measure_views(device, plan, seed, advance)
    command.write(output, {"chart.png": views_chart(results)}, results)
    show_views(results, wide_console())
    return f"{output}: chart.png, results.json: up to {max(plan.counts)} views on {results['gl']['renderer']}"


def things() -> list[TracedSurface]:
    """A ball and a box on a floor before a wall."""
    cube = moved_surface(replace(box((0.15, 0.22, 0.15)), albedo=waves), pose_at((0.42, 0.28, 1.75), yaw=30))
    walls = plane((0.15, 0, -1), (0, 0, 2.4), waves), plane((0, -1, 0), (0, 0.5, 0), waves)
    return [sphere((-0.12, 0.1, 1.5), 0.3, waves), cube, *walls]


def halton(k: int, base: int) -> float:
    """The k-th number of a row that fills 0 to 1 evenly, however far it goes (Halton 1960)."""
    share, result = 1.0, 0.0
    while k:
        share /= base
        result += share * (k % base)
        k //= base
    return result


def pose_of(k: int) -> Array:
    """Where the k-th camera stands, from 0: any first few look from all sides."""
    shares = halton(k + 1, 2), halton(k + 1, 3)
    turns = (low + share * (high - low) for share, (low, high) in zip(shares, (YAWS, PITCHES), strict=True))
    return orbit_pose(None, PIVOT, *turns)


def taken(hits: Hits, camera: Camera, pose: Array, error: float, random: np.random.Generator) -> Frame:
    """What a camera like a Kinect takes: noise, 1/8 pixel of disparity; its pose off by a shift of `error` metres and
    a turn that shifts as much two metres away."""
    depth = round_disparity(add_kinect_noise(hits.depth, 1, random), 1 / 8, random)
    colors = encode(hits.albedo) + random.normal(0, 2, hits.albedo.shape)
    shift, turn = (v / np.linalg.norm(v) * error for v in random.normal(0, 1, (2, 3)))
    wrong = pose @ pose_at(shift, *np.degrees(turn / 2))
    return Frame(np.clip(np.round(colors), 0, 255).astype(np.uint8), np.where(hits.depth > 0, depth, 0), camera, wrong)


class BenchStage:
    """The scene as traced: from the cameras, and along the path, whose middle is scored."""

    def __init__(self, plan: ViewsPlan):
        self.camera = standard_camera(*plan.size)
        self.poses = [pose_of(k) for k in range(max(plan.counts))]
        yaw, pitch = NEW_VIEW
        self.path = [orbit_pose(None, PIVOT, yaw + STEP * (k - plan.path // 2), pitch) for k in range(plan.path)]
        self.seen = [trace(things(), self.camera, pose) for pose in self.poses]
        self.truths = [trace(things(), self.camera, pose) for pose in self.path]

    def frames(self, error: float, seed: int) -> list[Frame]:
        """What all cameras take with poses that are `error` metres off; the noise is the same for all errors."""
        views = enumerate(zip(self.seen, self.poses, strict=True))
        return [taken(hits, self.camera, pose, error, generator(seed, "view", str(k))) for k, (hits, pose) in views]

    def lit(self, k: int) -> Array:
        """The true picture, sRGB 0..255, from the k-th place of the path."""
        return encode(shade(self.truths[k], LIGHT, MATERIAL, self.path[k][:3, 3]))

    def scene(self, frames: Sequence[Frame], place: NormalsAt) -> Scene:
        """The frames as one object, seen from the middle of the path."""
        return Scene((Node(PointObject(frames, normals_at=place)),), self.camera, self.path[len(self.path) // 2])


def measure_views(device: int, plan: ViewsPlan, seed: int, advance: Advance) -> dict[str, Any]:
    """Everything that `bench --views` shows, ready for JSON."""
    stage = BenchStage(plan)
    advance()
    with Renderer(device=device) as renderer:
        results: dict[str, Any] = {"gl": renderer.context.limits(), "is_software": renderer.context.is_software}
        results |= {"seed": seed, "size": list(plan.size), "counts": list(plan.counts), "timed": TIMED}
        results["quality"] = {}
        for name, error in POSE_ERRORS.items():
            frames = stage.frames(error, seed)
            rows: dict[str, list[dict[str, float]]] = {place: [] for place in NORMALS_AT}
            for count in plan.counts:
                for place in NORMALS_AT:
                    rows[place].append(quality(renderer, stage, frames[:count], place))
                advance()
            results["quality"][name] = rows
    results["cost"] = measure_cost(device, stage, plan, stage.frames(POSE_ERRORS[TIMED], seed), advance)
    results["fits"] = fits(results["cost"])
    results["peak_mb"] = peak_memory_mb()
    return results


def steps_of(plan: ViewsPlan) -> int:
    """How often `measure_views` advances."""
    return 1 + (len(POSE_ERRORS) + 1) * len(plan.counts)


def quality(renderer: Renderer, stage: BenchStage, frames: Sequence[Frame], place: NormalsAt) -> dict[str, float]:
    """normals: their mean error in degrees; psnr: of the lit picture, dB; flicker, see there. All away from edges."""
    middle = len(stage.path) // 2
    scene, hits = stage.scene(frames, place), stage.truths[middle]
    depth = renderer.render_depth(scene)
    judged = (np.abs(depth - hits.depth) < 3 * SAME_DEPTH * hits.depth) & ~near_edge(hits)
    truth = (hits.normals @ stage.path[middle][:3, :3])[judged]
    found = angle(renderer.render_normals(scene)[judged], truth)
    pictures = [renderer.render(scene, LIGHT, pose=pose) for pose in stage.path]
    errors = [picture[..., :3] - stage.lit(k) for k, picture in enumerate(pictures)]
    psnr = decibels(errors[middle][judged])
    return {"normals": float(found.mean()), "psnr": psnr, "flicker": flicker(stage, errors, pictures)}


def flicker(stage: BenchStage, errors: Sequence[Array], pictures: Sequence[np.ndarray]) -> float:
    """By how many of 255 steps (rms) a point's error changes from one picture of a path to the next."""
    changes = []
    for (k, before), (j, after) in pairwise(enumerate(stage.truths)):
        seen = (before.points - stage.path[j][:3, 3]) @ stage.path[j][:3, :3]
        at = seen[..., :2] / seen[..., 2:] * stage.camera.fx + (stage.camera.cx, stage.camera.cy)
        nearest = np.clip(np.round(at).astype(int), 0, np.array(before.depth.shape[::-1]) - 1)
        place = nearest[..., 1], nearest[..., 0]
        known = (np.abs(after.depth[place] - seen[..., 2]) < SAME_DEPTH * seen[..., 2]) & ~near_edge(before, 3)
        known &= (pictures[k][..., 3] > 0) & (pictures[j][..., 3] > 0)[place] & ~near_edge(after, 3)[place]
        changes.append(((between_pixels(errors[j], at[known]) - errors[k][known]) ** 2).mean())
    return float(np.sqrt(np.mean(changes)))


def between_pixels(picture: Array, at: Array) -> np.ndarray:
    """Return the values (n, 3) of a picture at places (n, 2), bilinear; outside, those of its border."""
    corner = np.floor(at)
    last = np.array(picture.shape[1::-1]) - 1
    (left, top), (right, bottom) = (np.clip(corner.astype(int) + k, 0, last).T for k in (0, 1))
    x, y = (at - corner).astype(np.float32).T[..., None]
    values, one = picture.astype(np.float32), np.float32(1)
    above = values[top, left] * (one - x) + values[top, right] * x
    below = values[bottom, left] * (one - x) + values[bottom, right] * x
    return above * (one - y) + below * y


def measure_cost(
    device: int, stage: BenchStage, plan: ViewsPlan, frames: Sequence[Frame], advance: Advance
) -> list[dict[str, Any]]:
    """For each number of views, medians of milliseconds from call to NumPy, see `milliseconds`.

    source, target   a new view, by where normals are found
    normals, votes   once for a set: uploads and normals of the frames; their comparison
    gpu_mb           of all textures and buffers, with all normals at the target
    """
    rows = []
    with Renderer(device=device) as renderer:
        for count in plan.counts:
            turns = range(plan.rounds + 1)  # the first one compiles
            _, *laps = [lap(renderer, stage, frames[:count], turn) for turn in turns]
            row = {"count": count, "pairs": count * min(count - 1, COMPARED), "gpu_mb": gpu_bytes(renderer) / 1e6}
            rows.append(row | {name: median(one[name] for one in laps) for name in laps[0]})
            advance()
    return rows


def lap(renderer: Renderer, stage: BenchStage, frames: Sequence[Frame], turn: int) -> dict[str, float]:
    """The times of `measure_cost`, once each; from turn to turn another place is the first."""
    new = [Frame(frame.color, frame.depth, frame.camera, frame.pose) for frame in frames]
    scenes = {place: stage.scene(new, place) for place in NORMALS_AT}
    first = milliseconds(renderer, scenes["source"], stage.path[0])
    for name in ("consensus", "agreement", "trust"):
        renderer.steps.forget(name)
    again = milliseconds(renderer, scenes["source"], stage.path[0])
    turns = NORMALS_AT if turn % 2 else NORMALS_AT[::-1]
    views = {place: milliseconds(renderer, scenes[place], stage.path[k]) for k, place in enumerate(turns, 1)}
    return views | {"normals": max(first - again, 0.0), "votes": max(again - views["source"], 0.0)}


def milliseconds(renderer: Renderer, scene: Scene, pose: Array) -> float:
    """Of a picture by the wall clock; of a software renderer CPU time, as its wall clock depends on what else runs."""
    clock = time.process_time if renderer.context.is_software else time.perf_counter
    return clocked(lambda: renderer.render(scene, LIGHT, pose=pose), clock)[1]


def gpu_bytes(renderer: Renderer) -> int:
    """Bytes of all textures and buffers of a renderer's context, as it was asked for them."""
    gl, total = renderer.context.gl, 0
    for item in gc.get_objects():
        if isinstance(item, moderngl.Buffer) and item.ctx is gl and not _is_released(item):
            total += item.size
        elif isinstance(item, moderngl.Texture | moderngl.Renderbuffer) and item.ctx is gl and not _is_released(item):
            width, height = item.size
            total += width * height * item.components * int(item.dtype[-1])
    return total


def _is_released(item: Any) -> bool:
    return isinstance(item.mglo, moderngl.mgl.InvalidObject)  # type: ignore[attr-defined]


def fits(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Straight lines through the costs of two views and more: {name: {start, slope, off}}.

    off  the largest distance from the line, as a share of the largest value. Votes are a line over the pairs.
    """
    several = [row for row in rows if row["count"] > 1]
    found = {}
    for name in (*NORMALS_AT, "normals", "votes", "gpu_mb"):
        x = np.array([row["pairs" if name == "votes" else "count"] for row in several], float)
        y = np.array([row[name] for row in several])
        slope, start = np.polyfit(x, y, 1)
        off = np.abs(start + slope * x - y).max() / y.max()
        found[name] = {"start": float(start), "slope": float(slope), "off": float(off)}
    return found


COLORS = {"source": "#3f7fb5", "target": "#d03a2b", "normals": "#3d9463", "votes": "#8a4f9e", "gpu_mb": "#c98a2e"}
QUALITIES = {  # what is measured, and the label of its panels
    "normals": "error of normals, degrees\n(low is good)",
    "psnr": "lit picture, PSNR in dB\n(high is good)",
    "flicker": "flicker, 8-bit steps\n(low is good)",
}
ONCE = "normals", "votes"
HELD = ("gpu_mb",)
COSTS = {  # what is measured, its name, and the unit of its straight line
    "source": ("source", "ms a view"),
    "target": ("target", "ms a view"),
    "normals": ("upload and normals", "ms a view"),
    "votes": ("votes", "ms a pair"),
    "gpu_mb": ("all images", "MB a view"),
}


def show_views(results: dict[str, Any], console: Console) -> None:
    """Prints the tables, and on what they were measured."""
    name = results["gl"]["renderer"]
    where = f"{name}, a software renderer: times are CPU time, of all cores" if results["is_software"] else name
    console.print(where, soft_wrap=True)
    conditions = results["quality"]
    for quality, label in QUALITIES.items():
        table = new_table(f"{' '.join(label.split())}: source / target", "views", *conditions)
        for k, count in enumerate(results["counts"]):
            cells = (
                " / ".join(f"{rows[place][k][quality]:.2f}" for place in NORMALS_AT) for rows in conditions.values()
            )
            table.add_row(str(count), *cells)
        console.print(table)
    width, height = results["size"]
    columns = "new view, source", "new view, target", "once: upload, normals", "once: votes", "pairs", "GPU MB"
    table = new_table(f"milliseconds and memory for views and pictures of {width}x{height} pixels", "views", *columns)
    for row in results["cost"]:
        keys = (*NORMALS_AT, *ONCE, "pairs", "gpu_mb")
        table.add_row(str(row["count"]), *(brief(row[key]) for key in keys))
    console.print(table)
    for name, fit in results["fits"].items():
        console.print(f"{straight_line(name, fit)}; off this line by at most {100 * fit['off']:.1f} % of the largest")


def straight_line(name: str, fit: dict[str, float]) -> str:
    """A cost as a formula."""
    label, unit = COSTS[name]
    return f"{label}: {fit['start']:.2g} + {fit['slope']:.2g} {unit}"


def views_chart(results: dict[str, Any]) -> bytes:
    """A PNG: three rows of panels, one column per error of the poses, and a row of costs with their straight lines."""
    figure = new_figure(9.4)
    conditions, counts = results["quality"], results["counts"]
    rows = figure.subplots(len(QUALITIES) + 1, len(conditions), squeeze=False)
    for axes, condition in zip(rows[0], conditions, strict=True):
        title(axes, f"Kinect noise, {condition}")
    for row, (quality, label) in zip(rows, QUALITIES.items(), strict=False):
        for axes, found in zip(row, conditions.values(), strict=True):
            plain(axes)
            axes.set_ylabel(label if axes is row[0] else "", fontsize=8)
            for place in NORMALS_AT:
                axes.plot(counts, [cell[quality] for cell in found[place]], "o-", color=COLORS[place], ms=3.5, lw=1.5)
            axes.set_xscale("log", base=2)
            axes.set_xticks(counts, map(str, counts))
        _share_height(row, from_zero=quality != "psnr")
    for axes in rows[-2]:
        axes.set_xlabel("views", fontsize=8)
    kind = "CPU" if results["is_software"] else "wall clock"
    costs = {f"each new view, ms ({kind})": NORMALS_AT, f"once for a set, ms ({kind})": ONCE, "GPU memory, MB": HELD}
    for axes, (text, names) in zip(rows[-1], costs.items(), strict=True):
        _draw_costs(axes, text, names, results)
    _headline(figure, results)
    return png(figure)


def _draw_costs(axes: Axes, text: str, names: Sequence[str], results: dict[str, Any]) -> None:
    """Costs over the number of views; a pale line is the straight one, that of votes straight over the pairs."""
    plain(axes)
    title(axes, text)
    rows = results["cost"]
    for name in names:
        fit, color = results["fits"][name], COLORS[name]
        straight = {
            row["count"]: fit["start"] + fit["slope"] * row["pairs" if name == "votes" else "count"]
            for row in rows
            if row["count"] > 1
        }
        axes.plot(*zip(*straight.items(), strict=True), color=color, lw=4, alpha=0.25, zorder=1)
        values = [row[name] for row in rows]
        axes.plot([row["count"] for row in rows], values, "o", color=color, ms=3.5, label=straight_line(name, fit))
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.25 * axes.get_ylim()[1])  # room for the legend
    axes.set_xlabel("views", fontsize=8)
    axes.legend(fontsize=7, frameon=False, loc="upper left")


def _share_height(row: np.ndarray, from_zero: bool) -> None:
    """Equal heights mean equal values in a row of panels."""
    low, high = np.transpose([axes.get_ylim() for axes in row])
    top = high.max() + 0.03 * np.ptp([low, high])
    for axes in row:
        axes.set_ylim(0 if from_zero else low.min(), top)


def _headline(figure: Any, results: dict[str, Any]) -> None:
    from matplotlib.lines import Line2D

    names = {"source": "in each frame, then mixed (source)", "target": "in the picture, on the merged depth (target)"}
    entries = [
        Line2D([], [], color=COLORS[place], marker="o", ms=4, lw=1.5, label=names[place]) for place in NORMALS_AT
    ]
    entries.append(Line2D([], [], color=INK, alpha=0.25, lw=4, label="straight lines through the costs"))
    width, height = results["size"]
    headline(figure, f"Where normals of several views are estimated, {width}x{height} pixels", entries, 3)
    figure.supxlabel(results["gl"]["renderer"].split(" (")[0], fontsize=8, color=INK)
