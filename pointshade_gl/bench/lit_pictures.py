"""Compares whole pictures with ray-traced truth: every estimator with every shading model and shape of splat."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from itertools import product
from statistics import median
from typing import Any

import numpy as np

from ..rendering.renderer import Renderer
from ..scene.appearance import SHADINGS, Material, Shading, Splat
from ..scene.camera import orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from ..scene.normal_methods import Method
from .picture_scores import co_visible, score_picture
from .scenes import standard_camera
from .stress import CONDITIONS, generator
from .tracing import as_frame, encode, shade, sphere_and_wall, trace

SPOILED = "clean", "1mm-noise", "kinect"
SHAPES: tuple[Splat, ...] = "footprint", "round"  # of splats; meshes: forms.py
LIT: tuple[Shading, ...] = tuple(shading for shading in SHADINGS if shading != "none")
LIGHT, YAW = Light(position=(-1.0, -1.0, -0.5)), 15


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
    pose = orbit_pose(None, (0, 0, 1.8), YAW)
    hits = trace(sphere_and_wall(), camera, pose)
    truth = encode(shade(hits, LIGHT, Material(), pose[:3, 3]))
    seen, colors = co_visible(hits, source, camera, np.eye(4)), as_frame(source, camera).color
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
                start = time.perf_counter()
                image = renderer.render(frame, LIGHT, pose=pose, normals=method, shading=shading, splat=splat)
                laps[job].append((time.perf_counter() - start) * 1e3)
                if turn == 0:
                    score = score_picture(image, shown[splat], truth, hits, seen)
                    rows.append({"method": method, "shading": shading, "splat": splat} | vars(score))
                advance()
        found["rows"][name] = [row | {"ms": median(laps[job][1:])} for job, row in zip(jobs, rows, strict=True)]
    return found
