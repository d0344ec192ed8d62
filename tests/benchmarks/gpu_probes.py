"""Probes of a driver, for on_a_gpu.py; they print what they find: python tests/benchmarks/gpu_probes.py PROBE REPORT"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from speed_against import measure_jobs
from speed_jobs import NOISE, ball_and_wall

import pointshade_gl as ps
from pointshade_gl.bench.charts import wide_console
from pointshade_gl.bench.command import write
from pointshade_gl.bench.measure import clocked
from pointshade_gl.bench.speed import SIZES, measure_speed, show_speed, speed_chart
from pointshade_gl.gpu.context.context import _cuda_numbers, egl_device

LIMITS = (
    "GL_MAX_COLOR_ATTACHMENTS", "GL_MAX_VIEWPORT_DIMS", "GL_MAX_TEXTURE_IMAGE_UNITS", "GL_MAX_ARRAY_TEXTURE_LAYERS",
    "GL_MAX_SHADER_STORAGE_BLOCK_SIZE", "GL_MAX_COMPUTE_WORK_GROUP_COUNT", "GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS",
)  # fmt: skip


def probe_environment(report: Path) -> None:
    """Print facts about the driver as JSON."""
    facts: dict[str, Any] = {"versions": f"Python {platform.python_version()}, NumPy {np.__version__}"}
    facts["versions"] += f", moderngl {moderngl.__version__}"  # type: ignore[attr-defined]
    facts["first picture, s"] = "{:.2f}, again {:.2f}".format(*(_first_picture(report) for _ in range(2)))
    with ps.Renderer() as renderer:
        facts |= renderer.context.limits()
        facts["is software"] = renderer.context.is_software
        facts["limits"] = ", ".join(f"{name[3:]} {renderer.context.info.get(name)}" for name in LIMITS)
        assert renderer.render(ps.load_frame("vase")).any(), "the vase is an empty picture"
    facts["CUDA numbers of the EGL devices"] = _cuda_numbers()
    print(json.dumps(facts))


def _first_picture(report: Path) -> float:
    begin = time.perf_counter()
    command = [sys.executable, "-m", "pointshade_gl", "render", "-o", str(report / "vase.png"), "--quiet"]
    subprocess.run(command, check=True)
    return time.perf_counter() - begin


def probe_rasterizers(_: Path) -> None:
    """Print how pictures of the two rasterisers differ, and what each costs. Fails if they cover other pixels."""
    color, depth, camera = ball_and_wall(640, 480)
    noisy = depth + np.random.default_rng(0).normal(0, NOISE, depth.shape).astype(np.float32)
    scenes = {
        "vase": ps.load_frame("vase"),
        "ball": ps.Frame(color, depth, camera),
        "noisy": ps.Frame(color, noisy, camera),
    }
    with ps.Renderer(rasterizer="points") as points:
        if points.context.gl.version_code < 430:
            print("no OpenGL 4.3: only points")
            return
        with ps.Renderer(rasterizer="compute") as compute:
            print(f"{'':16}{'covered by one':>15}{'> 2 steps':>11}{'mean':>8}{'points ms':>11}{'compute ms':>12}")
            worst = 0.0
            for name, frame in scenes.items():
                for yaw in (0, 15, 40, 75):
                    both = [_drawn(one, frame, yaw) for one in (points, compute)]
                    (first, first_ms), (second, second_ms) = both
                    other = float(((first[..., 3] > 0) != (second[..., 3] > 0)).mean())
                    steps = np.abs(first.astype(int) - second)
                    share, worst = float((steps.max(-1) > 2).mean()), max(worst, other)
                    numbers = f"{other:15.5f}{share:11.5f}{steps.mean():8.3f}{first_ms:11.2f}{second_ms:12.2f}"
                    print(f"{name:8}{yaw:6}°{'':1}{numbers}", flush=True)
    if worst > 0.001:
        sys.exit(f"they cover other pixels: {worst:.5f} of them, expected at most 0.001")


def _drawn(renderer: Any, frame: Any, yaw: float) -> tuple[Any, float]:
    """A view of a frame, and the median of how long a new frame takes. Fails if it is not the same each time."""
    pictures, times = [], []
    for _ in range(4):
        begin = time.perf_counter()
        new = ps.Frame(frame.color, frame.depth, frame.camera)
        pictures.append(renderer.render(new, ps.Light(position=(-0.5, -1, 0)), yaw=yaw))
        times.append(1e3 * (time.perf_counter() - begin))
    assert all(np.array_equal(pictures[0], one) for one in pictures), "the same call gives another picture"
    return pictures[0], float(np.median(times[1:]))


def probe_cuda(_: Path) -> None:
    """Print which EGL device is which CUDA device. Fails if the name of what draws is not that of nvidia-smi."""
    print(f"CUDA numbers of the EGL devices: {_cuda_numbers()}")
    if not shutil.which("nvidia-smi"):
        print("no nvidia-smi: nothing to compare with")
        return
    asked = ["nvidia-smi", "--query-gpu=index,name", "--format=csv,noheader"]
    rows = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip().splitlines()
    visible = os.environ.get("CUDA_VISIBLE_DEVICES", "")
    for index, name in (row.split(", ", 1) for row in rows):
        if visible and index not in visible.split(","):
            continue
        device = egl_device(index, visible)
        with ps.Renderer(device=device) as renderer:
            drawing = renderer.context.renderer
        print(f"GPU {index} ({name}): EGL device {device}, {drawing}")
        if name.lower().removeprefix("nvidia ") not in drawing.lower():
            sys.exit(f"GPU {index} is {name}, but EGL device {device} is {drawing}")


def probe_clouds(_: Path) -> None:
    """Print what a cloud costs: its first picture, which finds the normals, then other views and lights."""
    with ps.Renderer() as renderer:
        count = 10**5 if renderer.context.is_software else 10**7
        ball = np.random.default_rng(0).normal(size=(count, 3))
        ball /= np.linalg.norm(ball, axis=1, keepdims=True)
        places = (ball * (1 + 0.05 * np.sin(8 * ball[:, :1]))).astype(np.float32)
        cloud = ps.PointCloud(places, colors=(127 + 120 * ball).astype(np.uint8))

        def ms(yaw: float, x: float) -> float:
            picture, ms = clocked(lambda: renderer.render(cloud, ps.Light(position=(x, -3, 0)), yaw=yaw))
            assert picture[..., 3].any(), "the cloud is an empty picture"
            return ms

        first, views, lights = ms(0, 0), [ms(k, 0) for k in (1, 2, 3)], [ms(3, k) for k in (1, 2, 3)]
    view, light = np.median(views), np.median(lights)
    print(f"{count} points: first picture {first:.0f} ms, new view {view:.1f} ms, new light {light:.1f} ms")


def probe_batch(_: Path) -> None:
    """Print how many new frames a second processes draw together. Fails where they draw another picture than one."""
    cores, frames = os.cpu_count() or 1, [ps.Frame(*ball_and_wall(640, 480)) for _ in range(64)]
    expected = ps.render(frames[0], yaw=15)
    for workers in sorted({1, min(4, cores), min(8, cores)}):
        pictures = ps.batch.map(frames, view=ps.View(yaw=15), workers=workers)
        for _k in range(2 * workers):  # until all have started
            next(pictures)
        rest, ms = clocked(lambda pictures=pictures: list(pictures))
        print(f"{workers} workers: {1e3 * len(rest) / ms:.0f} pictures a second", flush=True)
        assert all(np.array_equal(one, expected) for one in rest), f"{workers} workers draw another picture"


def probe_speed(report: Path) -> None:
    """Measure as `bench --speed` does: tables, speed.json and, with matplotlib, speed.png."""
    with ps.Renderer() as renderer:
        sizes = SIZES[:2] if renderer.context.is_software else SIZES[:4]
    results = measure_speed(0, 3, sizes, lambda: None)
    results["jobs"] = measure_jobs(0, 3)
    write(report, {}, results, "speed.json")
    show_speed(results, wide_console())
    try:
        write(report, {"speed.png": speed_chart(results)}, results, "speed.json")
    except ImportError:
        print("no chart without matplotlib")


PROBES: dict[str, Callable[[Path], None]] = {
    "environment": probe_environment, "rasterizers": probe_rasterizers, "cuda": probe_cuda, "speed": probe_speed,
    "clouds": probe_clouds, "batch": probe_batch,
}  # fmt: skip


if __name__ == "__main__":
    PROBES[sys.argv[1]](Path(sys.argv[2]))
