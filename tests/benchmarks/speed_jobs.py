"""Times one version of the package, job by job: reads names of jobs from stdin, answers each with a line of JSON.

`bench --speed --against` runs the text of this file with an older version of the package, too. So it is a program of
its own, and uses only what is public.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import pointshade_gl as ps

NOISE = 0.002  # metres
JOBS = (
    "new frame", "new view", "new light", "flat shading", "shadow", "noisy frame", "large frame", "first picture"
)  # fmt: skip


class Jobs:
    """Every job prepares itself and returns what is timed."""

    def __init__(self, device: int):
        self._renderer = ps.Renderer(device=device)
        self._device = device
        self._calls = 0
        self._clean = ball_and_wall(640, 480)
        self._frame = ps.Frame(*self._clean)
        self._large: tuple | None = None

    def run(self, name: str) -> dict[str, float]:
        """Milliseconds of a job by the wall clock, and of all CPU cores together."""
        self._calls += 1
        job = getattr(self, name.replace(" ", "_"))()
        cpu, start = cpu_seconds(), time.perf_counter()
        job()
        return {"ms": (time.perf_counter() - start) * 1e3, "cpu_ms": (cpu_seconds() - cpu) * 1e3}

    def new_frame(self) -> Callable[[], object]:
        return lambda: self._draw(ps.Frame(*self._clean), yaw=15)

    def new_view(self, **options) -> Callable[[], object]:
        """Another view is drawn first, so that the frame is on the GPU, whatever job came before."""
        self._draw(self._frame, yaw=14, **options)
        return lambda: self._draw(self._frame, yaw=15 + 0.1 * (self._calls % 50), **options)

    def new_light(self) -> Callable[[], object]:
        for _ in range(2):  # a second light of the same view finds the surfaces of the first
            self._draw(self._frame, yaw=15, light=self._lamp(-1))
        return lambda: self._draw(self._frame, yaw=15, light=self._lamp(self._calls % 50))

    def flat_shading(self) -> Callable[[], object]:
        return self.new_view(shading="flat")

    def shadow(self) -> Callable[[], object]:
        """The light moves."""
        self._draw(self._frame, yaw=15, light=self._lamp(-1, shadow=True))
        return lambda: self._draw(self._frame, yaw=15, light=self._lamp(self._calls % 50, shadow=True))

    def noisy_frame(self) -> Callable[[], object]:
        color, depth, camera = self._clean
        noisy = depth + np.random.default_rng(self._calls).normal(0, NOISE, depth.shape).astype(np.float32)
        return lambda: self._draw(ps.Frame(color, noisy, camera), yaw=15)

    def large_frame(self) -> Callable[[], object]:
        self._large = self._large or ball_and_wall(1920, 1080)
        large = self._large
        return lambda: self._draw(ps.Frame(*large), yaw=15)

    def first_picture(self) -> Callable[[], object]:
        """A command, from its start to its picture on disk."""

        def run() -> None:
            with tempfile.TemporaryDirectory() as folder:
                output = str(Path(folder) / "a.png")
                command = [sys.executable, "-m", "pointshade_gl", "render", "-o", output, "--device", str(self._device)]
                subprocess.run(command, check=True, capture_output=True)

        return run

    def _draw(self, frame: ps.Frame, yaw: float, light: ps.Light | None = None, **options) -> None:
        self._renderer.render(frame, light, pose=ps.orbit_pose(None, (0, 0, 2), yaw), **options)

    def _lamp(self, turn: int, **options) -> ps.Light:
        return ps.Light(position=(np.cos(turn), -1, 0.3 * np.sin(turn)), **options)


def cpu_seconds() -> float:
    """Of this process and of those it has waited for."""
    return time.process_time() + sum(os.times()[2:4])


def ball_and_wall(width: int, height: int) -> tuple:
    """Colours, depth and camera of a ball before a wall."""
    camera = ps.Camera.from_fov(49, width, height)
    x = (np.arange(width) - camera.cx) / camera.fx
    y = ((np.arange(height) - camera.cy) / camera.fy)[:, None]
    along, middle, radius = x * x + y * y + 1, 1.8, 0.4  # |ray|^2; of the ball
    inside = middle**2 - along * (middle**2 - radius**2)
    ball = (middle - np.sqrt(np.maximum(inside, 0))) / along
    depth = np.where(inside > 0, ball, 2.4 + 0.2 * x).astype(np.float32)
    color = np.empty((height, width, 3), np.uint8)
    color[..., 0], color[..., 1], color[..., 2] = 128 + 100 * np.sin(9 * x), 128 + 100 * np.sin(9 * y), 150
    return color, depth, camera


def answer(device: int) -> None:
    """First prints which package runs here; null stands for a job that it cannot do."""
    jobs = Jobs(device)
    put(str(Path(ps.__file__).resolve().parent))
    for line in sys.stdin:
        try:
            put(jobs.run(line.strip()))
        except Exception:
            put(None)


def put(what: object) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    answer(int(sys.argv[1]))
