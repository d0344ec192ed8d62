"""Measures speed and accuracy of every normal estimator, and how much noise, rounding and holes it withstands."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from statistics import fmean, median
from typing import Any, TypeVar
from zlib import crc32

import moderngl
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from ..notes.version import __version__
from ..renderer.renderer import Renderer
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.noise import Method
from .scenes import MIDDLE, SCENES, KnownScene, make_scene, pose_at, standard_camera

Depth = NDArray[np.float64]
Spoil = Callable[[Depth, float, Generator], Depth]
BASELINE = 525 * 0.075  # focal length in pixels times metres between the eyes of a Kinect
BLOB_RADII = 2.0, 6.0  # pixels


def generator(seed: int, *names: str) -> Generator:
    """Random numbers that depend on their purpose (names), not on what was measured before."""
    return np.random.default_rng([seed, *(crc32(name.encode()) for name in names)])


def add_noise(depth: Depth, millimetres: float, random: Generator) -> Depth:
    return depth + random.normal(0, millimetres / 1000, depth.shape)


def add_smooth_noise(depth: Depth, millimetres: float, random: Generator) -> Depth:
    """Noise that neighbours share, like that of filters in cameras: blurred over 5 pixels, then as strong as before."""
    noise = random.normal(0, 1, depth.shape)
    for axis in (0, 1):
        noise = sum((w * np.roll(noise, k, axis) for k, w in enumerate((1, 4, 6, 4, 1))), np.zeros_like(noise))
    return depth + noise / noise.std() * millimetres / 1000


def add_outliers(depth: Depth, percent: float, random: Generator) -> Depth:
    """Single pixels that are wrong by up to a tenth of their depth."""
    wrong = random.random(depth.shape) * 100 < percent
    return np.where(wrong, depth * random.uniform(0.9, 1.1, depth.shape), depth)


def add_kinect_noise(depth: Depth, factor: float, random: Generator) -> Depth:
    """Nguyen, Izadi, Lovell 2012, axial part."""
    return depth + random.normal(0, factor, depth.shape) * (0.0012 + 0.0019 * (depth - 0.4) ** 2)


def round_depth(depth: Depth, millimetres: float, _: Generator) -> Depth:
    return np.round(depth * 1000 / millimetres) * millimetres / 1000


def round_disparity(depth: Depth, pixels: float, _: Generator) -> Depth:
    steps = np.maximum(np.round(BASELINE / np.where(depth > 0, depth, np.inf) / pixels), 1)
    return BASELINE / (steps * pixels)


def drop_pixels(depth: Depth, percent: float, random: Generator) -> Depth:
    return np.where(random.random(depth.shape) * 100 < percent, 0, depth)


def drop_blobs(depth: Depth, percent: float, random: Generator) -> Depth:
    """Discs of 2 to 6 pixels radius until that share of the picture is gone."""
    h, w = depth.shape
    gone = np.zeros((h, w), bool)
    while gone.mean() * 100 < percent:
        for _ in range(max(1, h * w // 20_000)):
            v, u, radius = random.integers(h), random.integers(w), random.uniform(*BLOB_RADII)
            top, left = max(v - 6, 0), max(u - 6, 0)
            rows, columns = np.ogrid[top : min(v + 7, h), left : min(u + 7, w)]
            gone[top : v + 7, left : u + 7] |= (rows - v) ** 2 + (columns - u) ** 2 <= radius**2
    return np.where(gone, 0, depth)


def drop_both(depth: Depth, percent: float, random: Generator) -> Depth:
    """Half of the share are single pixels, half are blobs."""
    return drop_blobs(drop_pixels(depth, percent / 2, random), percent / 2, random)


def scale_to(depth: Depth, distance: float, _: Generator, unit: float = 1) -> Depth:
    """The whole scene made so large or small that its middle is `distance` metres away; depth in `unit` per metre."""
    return depth * (distance * unit / MIDDLE)


def everything(depth: Depth, factor: float, random: Generator) -> Depth:
    """A sensor's bad day: Kinect noise, millimetres, 5 % holes."""
    return drop_both(round_depth(add_kinect_noise(depth, factor, random), 1, random), 5, random)


def untouched(depth: Depth, _: float, __: Generator) -> Depth:
    return depth


def telephoto(camera: Camera, factor: float) -> tuple[Camera, ArrayLike]:
    """A longer lens from further away: the scene's middle keeps its size in pixels."""
    return replace(camera, fx=camera.fx * factor, fy=camera.fy * factor), pose_at((0, 0, MIDDLE * (1 - factor)))


def wide_angle(camera: Camera, factor: float) -> tuple[Camera, ArrayLike]:
    """A shorter lens at the same place."""
    return replace(camera, fx=camera.fx / factor, fy=camera.fy / factor), np.eye(4)


@dataclass(frozen=True)
class Condition:
    """One kind of damage to depth, at one strength."""

    title: str
    spoil: Spoil
    strength: float = 0.0


@dataclass(frozen=True)
class Stress:
    """One kind of damage at increasing strengths: to the depth (`spoil`), or to the camera (`look`)."""

    title: str
    axis: str
    strengths: tuple[float, ...]
    spoil: Spoil = untouched
    look: Callable[[Camera, float], tuple[Camera, ArrayLike]] | None = None


CONDITIONS = {
    "clean": Condition("clean", untouched),
    "16-bit": Condition("16-bit steps of 0.2 mm", round_depth, 0.2),
    "1mm-steps": Condition("1 mm steps", round_depth, 1),
    "1mm-noise": Condition("1 mm noise", add_noise, 1),
    "kinect": Condition("Kinect noise", add_kinect_noise, 1),
    "disparity": Condition("1/8 px disparity", round_disparity, 1 / 8),
    "holes-5": Condition("5 % holes", drop_both, 5),
    "holes-20": Condition("20 % holes", drop_both, 20),
    "bad-day": Condition("Kinect, 1 mm steps, 5 % holes", everything, 1),
}

DISTANCES = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
SHARES = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 40.0)
STRESSES = {
    "noise": Stress("Gaussian noise", "sigma, mm", (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30), add_noise),
    "smooth-noise": Stress("noise shared by neighbours", "sigma, mm", (0.03, 0.1, 0.3, 1, 3, 10, 30), add_smooth_noise),
    "sensor-noise": Stress("Kinect noise", "times a Kinect's", (0.03, 0.1, 0.3, 1, 2, 4, 8), add_kinect_noise),
    "steps": Stress("depth in steps", "step, mm", (0.02, 0.05, 0.2, 0.5, 1, 2, 5, 10, 20), round_depth),
    "disparity-steps": Stress(
        "disparity in steps", "step, px", (1 / 256, 1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1), round_disparity
    ),
    "outliers": Stress("wild pixels", "wrong, %", (0.1, 0.3, 1, 3, 10, 20), add_outliers),
    "hole-pixels": Stress("missing pixels", "missing, %", SHARES, drop_pixels),
    "hole-blobs": Stress("missing blobs", "missing, %", SHARES, drop_blobs),
    "distance-m": Stress("scene scaled, metres", "distance, m", DISTANCES, scale_to),
    "distance-mm": Stress("scene scaled, millimetres", "distance, m", DISTANCES, partial(scale_to, unit=1000)),
    "telephoto": Stress("long lens", "times the focal length", (1, 4, 16, 64, 256, 1024), look=telephoto),
    "wide-angle": Stress("short lens", "divisor of the focal length", (1, 2, 4, 8, 16), look=wide_angle),
}


Made = TypeVar("Made")
BORDER = 8  # pixels along the picture's border that are not scored: windows lack neighbours there
LAPS = 2  # runs that are timed before the next method's turn, after one that is not timed
BROKEN = 10.0  # degrees of mean error from which on an estimator is useless


@dataclass(frozen=True)
class Plan:
    """How much is measured. `every`: every how many-th strength of a stress; `rounds` of timing, interleaved."""

    size: tuple[int, int]
    scenes: tuple[str, ...]
    stress_scenes: tuple[str, ...]
    every: int
    rounds: int
    timed_scene: str = "overlap"

    def strengths(self, stress: Stress) -> list[float]:
        return [float(s) for s in stress.strengths[:: -self.every][::-1]]  # the strongest is always measured

    def steps(self, methods: int, conditions: Sequence[str], stresses: Sequence[str]) -> int:
        """How many times a `Measurement` calls `advance`."""
        estimates = len(conditions) * (len(self.scenes) + self.rounds)
        estimates += sum(len(self.strengths(STRESSES[name])) for name in stresses) * len(self.stress_scenes)
        return estimates * methods


FULL = Plan((640, 480), tuple(SCENES), ("sphere", "stairs", "overlap"), 1, 5)
QUICK = Plan((320, 240), ("grazing-85", "torus", "stairs", "rods", "overlap"), ("overlap",), 2, 3)


class Measurement:
    """One run: the renderer, the plan, the methods, and the scenes traced so far."""

    def __init__(
        self, renderer: Renderer, plan: Plan, methods: Sequence[Method], seed: int, advance: Callable[[], None]
    ):
        self.renderer, self.plan, self.methods, self.seed, self.advance = renderer, plan, methods, seed, advance
        self.camera = standard_camera(*plan.size)
        self.scene = cache(partial(make_scene, standard=self.camera))

    def errors(self, scene: KnownScene, frame: Frame) -> dict[str, Any]:
        """{method: {"all", "edge"}}: mean angular errors in degrees, of known pixels and near depth edges (None: none).

        A missing normal counts as one that faces the viewer. Methods run without options: triangles without a depth
        step.
        """
        facing = -scene.camera.rays()
        facing = (facing / np.linalg.norm(facing, axis=-1, keepdims=True)).astype(np.float32)
        known = np.zeros(scene.depth.shape, bool)
        known[BORDER:-BORDER, BORDER:-BORDER] = True
        known &= (frame.depth > 0) & (scene.depth > 0)
        truth, edge, facing = scene.normals[known], scene.edge[known], facing[known]
        result = {}
        for method in self.methods:
            normals = self.renderer.estimate_normals(frame, method)[known]
            normals = np.where(np.isfinite(normals), normals, facing)
            error = angle(normals, truth)
            result[method] = {"all": float(error.mean()), "edge": float(error[edge].mean()) if edge.any() else None}
            self.advance()
        return result

    def conditions(self, conditions: Sequence[str]) -> dict[str, Any]:
        """{method: {condition: {"all", "edge", "scenes"}}}"""
        found: dict[str, Any] = {method: {} for method in self.methods}
        scenes = [self.scene(name) for name in self.plan.scenes]
        for name in conditions:
            rows = {scene.name: self.errors(scene, self.spoiled(scene, name)) for scene in scenes}
            for method in self.methods:
                by_scene = {scene: row[method] for scene, row in rows.items()}
                edges = [row["edge"] for row in by_scene.values() if row["edge"] is not None]
                means = {"all": fmean(row["all"] for row in by_scene.values()), "edge": fmean(edges) if edges else None}
                found[method][name] = means | {"scenes": by_scene}
        return found

    def stability(self, stresses: Sequence[str]) -> dict[str, Any]:
        """{stress: {"strengths", "errors": {method: [...]}, "breaks": {method: strength or None}}}"""
        found: dict[str, Any] = {}
        for name in stresses:
            stress, rows = STRESSES[name], []
            strengths = self.plan.strengths(stress)
            for strength in strengths:
                row = []
                for scene_name in self.plan.stress_scenes:
                    scene = self.scene(scene_name)
                    if stress.look is not None:
                        scene = make_scene(scene_name, self.camera, *stress.look(self.camera, strength))
                    row.append(self.errors(scene, self.frame(scene, stress.spoil, strength, name)))
                rows.append(row)
            errors = {m: [fmean(each[m]["all"] for each in row) for row in rows] for m in self.methods}
            breaks = {m: breaking_point(strengths, errors[m]) for m in self.methods}
            found[name] = {"strengths": strengths, "errors": errors, "breaks": breaks}
        return found

    def times(self, conditions: Sequence[str]) -> dict[str, Any]:
        """{method: {condition: {"gpu_ms", "wall_ms"}}}, medians.

        The methods take turns, so that all meet the same conditions. GPU times are None if the driver has no timer, or
        if it draws on the CPU, after the timer has stopped.
        """
        found: dict[str, Any] = {method: {} for method in self.methods}
        scene = self.scene(self.plan.timed_scene)
        for name in conditions:
            frame = self.spoiled(scene, name)
            laps: dict[str, tuple[list[float], list[float]]] = {method: ([], []) for method in self.methods}
            for _ in range(self.plan.rounds):
                for method in self.methods:
                    gpu, wall = time_normals(self.renderer, frame, method, LAPS)
                    laps[method][0].extend(gpu)
                    laps[method][1].extend(wall)
                    self.advance()
            for method, (gpu, wall) in laps.items():
                found[method][name] = {"gpu_ms": median(gpu) if gpu else None, "wall_ms": median(wall)}
        return found

    def spoiled(self, scene: KnownScene, condition: str) -> Frame:
        return self.frame(scene, CONDITIONS[condition].spoil, CONDITIONS[condition].strength, condition)

    def frame(self, scene: KnownScene, spoil: Spoil, strength: float, why: str) -> Frame:
        depth = spoil(scene.depth.astype(float), strength, generator(self.seed, why, scene.name))
        return Frame(None, np.where(scene.depth > 0, depth, 0), scene.camera)

    def results(self, conditions: Sequence[str], stresses: Sequence[str]) -> dict[str, Any]:
        """Everything, ready for JSON: what was measured, on which machine, with which versions."""
        times = self.times(conditions)
        gpu = all(time["gpu_ms"] is not None for row in times.values() for time in row.values())
        return {
            "pointshade_gl": __version__, "gl": self.renderer.context.limits(), "python": platform.python_version(),
            "numpy": np.__version__, "moderngl": moderngl.__version__,  # type: ignore[attr-defined]
            "system": f"{platform.system()} {platform.machine()}", "seed": self.seed, "size": list(self.plan.size),
            "scenes": list(self.plan.scenes), "stress_scenes": list(self.plan.stress_scenes),
            "timed_scene": self.plan.timed_scene, "clock": "gpu_ms" if gpu else "wall_ms",
            "methods": list(self.methods), "conditions": list(conditions), "errors": self.conditions(conditions),
            "times": times, "stability": self.stability(stresses),
        }  # fmt: skip


def time_normals(renderer: Renderer, frame: Frame, method: Method, laps: int) -> tuple[list[float], list[float]]:
    """Milliseconds of the surface pass alone, by the GPU's timer ([] without one) and by the wall clock. The first run,
    which may compile shaders, is not counted."""
    steps, found = renderer.steps, []
    steps.timed = True
    for _ in range(laps + 1):
        steps.forget("surface")
        renderer.estimate_normals(frame, method)
        found.append(steps.laps["surface"])
    steps.timed = False
    gpu = [lap.gpu_ms for lap in found[1:] if lap.gpu_ms is not None]
    return (gpu if len(gpu) == laps else []), [lap.wall_ms for lap in found[1:]]


def clocked(job: Callable[[], Made], clock: Callable[[], float] = time.perf_counter) -> tuple[Made, float]:
    """What a job returns, and its milliseconds by a clock."""
    start = clock()
    return job(), (clock() - start) * 1e3


def angle(normals: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Degrees between unit vectors (n, 3), by the chord: exact for small angles in float32."""
    chord = np.linalg.norm(normals - truth, axis=-1)
    return np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1)))


def breaking_point(strengths: Sequence[float], errors: Sequence[float]) -> float | None:
    """The strength at which the error first exceeds BROKEN, interpolated by logarithms between two strengths."""
    for k, error in enumerate(errors):
        if error > BROKEN:
            if k == 0:
                return strengths[0]
            share = np.log(BROKEN / errors[k - 1]) / np.log(error / errors[k - 1])
            return float(strengths[k - 1] * (strengths[k] / strengths[k - 1]) ** share)
    return None
