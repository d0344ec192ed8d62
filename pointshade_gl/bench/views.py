"""Measures several views of one thing: normals at the source or at the target, flicker, and cost over the number."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median
from typing import Any

import moderngl
import numpy as np

from ..estimation.multi_view import COMPARED
from ..renderer.renderer import Renderer
from ..scene.appearance import NORMALS_AT, Material, NormalsAt
from ..scene.camera import Camera, orbit_pose
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.node import Node
from ..scene.objects import PointObject
from .measure import angle, clocked
from .picture_scores import SAME_DEPTH, decibels, near_edge
from .scenes import standard_camera
from .shapes import box, pose_at
from .speed import peak_memory_mb
from .stress import add_kinect_noise, generator, round_disparity
from .tracing import Array, Hits, Surface, encode, moved, plane, shade, sphere, trace, waves

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


def things() -> list[Surface]:
    """A ball and a box on a floor before a wall."""
    cube = moved(replace(box((0.15, 0.22, 0.15)), albedo=waves), pose_at((0.42, 0.28, 1.75), yaw=30))
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


class Stage:
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
    stage = Stage(plan)
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


def quality(renderer: Renderer, stage: Stage, frames: Sequence[Frame], place: NormalsAt) -> dict[str, float]:
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


def flicker(stage: Stage, errors: Sequence[Array], pictures: Sequence[np.ndarray]) -> float:
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
    device: int, stage: Stage, plan: ViewsPlan, frames: Sequence[Frame], advance: Advance
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


def lap(renderer: Renderer, stage: Stage, frames: Sequence[Frame], turn: int) -> dict[str, float]:
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
