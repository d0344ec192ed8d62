"""Where the time of one picture goes: the stages of the pipeline, each timed until the GPU has finished it."""

from __future__ import annotations

import time
from statistics import median

from ..camera import Camera, orbit_pose
from ..frame import Frame
from ..renderer import Renderer
from .tracing import as_frame, sphere_and_wall, trace

ROUNDS = 15


def time_stages(renderer: Renderer, rounds: int = ROUNDS) -> list[tuple[str, float]]:
    """(stage, milliseconds) on 640x480 points turned by 15 degrees, median of interleaved rounds."""
    camera = Camera(525, 525, 319.5, 239.5, 640, 480)
    first = as_frame(trace(sphere_and_wall(), camera), camera)
    pose = orbit_pose(None, first.pivot, yaw=15)
    jobs = {
        "frame": lambda: Frame(first.color, first.depth, camera),
        "normals": lambda: renderer.estimate_normals(first),
        "same frame": lambda: renderer.render(first, pose=pose),
        "new frame": lambda: renderer.render(Frame(first.color, first.depth, camera), pose=pose),
    }
    laps: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds + 1):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            laps[name].append((time.perf_counter() - start) * 1e3)
    return [(name, median(times[1:])) for name, times in laps.items()]  # the first round warms up
