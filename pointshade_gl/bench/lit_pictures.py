"""Compares whole pictures with ray-traced truth: every estimator with every shading model and shape of splat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from statistics import median
from typing import Any

import numpy as np

from ..renderer.renderer import Renderer
from ..scene.appearance import NOT_LIT, SHADINGS, Material, Shading, Splat
from ..scene.camera import Camera, orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from ..scene.noise import Method
from .measure import clocked
from .picture_scores import co_visible, score_picture
from .scenes import standard_camera
from .stress import CONDITIONS, generator
from .tracing import Array, Hits, as_frame, encode, shade, sphere_and_wall, trace

SPOILED = "clean", "1mm-noise", "kinect"
SHAPES: tuple[Splat, ...] = "footprint", "round"  # of splats; meshes: forms.py
LIT: tuple[Shading, ...] = tuple(shading for shading in SHADINGS if shading not in NOT_LIT)
LIGHT, YAW = Light(position=(-1.0, -1.0, -0.5)), 15


def turned(source: Hits, camera: Camera) -> tuple[Array, Hits, Array, np.ndarray]:
    """The sphere and the wall from the side: pose, what is hit, that in sRGB (0..255) by LIGHT, what the source saw."""
    pose = orbit_pose(None, (0, 0, 1.8), YAW)
    hits = trace(sphere_and_wall(), camera, pose)
    truth = encode(shade(hits, LIGHT, Material(), pose[:3, 3]))
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
                image, ms = clocked(partial(renderer.render, frame, LIGHT, pose=pose, **options))
                laps[job].append(ms)
                if turn == 0:
                    score = score_picture(image, shown[splat], truth, hits, seen)
                    rows.append({"method": method, "shading": shading, "splat": splat} | vars(score))
                advance()
        found["rows"][name] = [row | {"ms": median(laps[job][1:])} for job, row in zip(jobs, rows, strict=True)]
    return found
