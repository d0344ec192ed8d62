"""Measures speed: each stage beside its limit, cost over the number of points; shows tables and a chart."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import moderngl
import numpy as np
from rich.console import Console

from ..files.pictures.picture_files import save_image
from ..gpu.core.steps import Timing
from ..gpu.points.tiles import LARGEST_WHOLE, TILE_POINTS
from ..notes.errors import ContextError
from ..renderer.renderer import Renderer
from ..scene.camera import Camera, orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from .charts import INK, PALE, brief, new_figure, new_table, png
from .measure import clocked
from .scenes import standard_camera
from .tracing import as_frame, sphere_and_wall, trace

COLORS = {"points": "#c98a2e", "compute": "#d03a2b", "stage": "#3f7fb5"}


def show_speed(results: dict[str, Any], console: Console) -> None:
    """Prints the tables, and on what they were measured."""
    name = results["gl"]["renderer"]
    where = f"{name}, a software renderer: these figures are those of the CPU" if results["is_software"] else name
    console.print(where, soft_wrap=True)
    title = "milliseconds for one new frame of 640x480 points, turned by 15 degrees"
    table = new_table(title, "stage", "ms", "limit ms", "times the limit", "clock")
    for stage in results["stages"]:
        ratio = brief(stage["ms"] / stage["limit_ms"])
        table.add_row(stage["name"], brief(stage["ms"]), brief(stage["limit_ms"]), ratio, stage["clock"])
    console.print(table)
    rates = ", ".join(f"{kind.upper()} {rate / 1e9:.3g} GB/s" for kind, rate in results["bandwidth"].items())
    console.print(f"limit: bytes that a stage must move, divided by the bandwidth of a copy ({rates})", soft_wrap=True)
    table = new_table("one picture of 32x24 points: what is paid beside its pixels", "change", "calls", "microseconds")
    for row in results["overhead"]:
        table.add_row(row["change"], str(row["calls"]), brief(row["us"]))
    console.print(table)
    columns = "rasterizer", "new frame", "million per second", "other view", "other light", "splats", "GPU MB"
    table = new_table("milliseconds from frame to NumPy, by number of points", "points", *columns)
    for row in results["points"]:
        rate = row["points"] / row["live_ms"] / 1e3
        cells = [row["live_ms"], rate, row["view_ms"], row["light_ms"], row["splats_ms"], row["memory_mb"]]
        table.add_row(f"{row['points']:,}".replace(",", " "), row["rasterizer"], *map(brief, cells))
    console.print(table)
    console.print(f"cold start: `pointshade render` of the vase takes {results['cold_start_s']:.2f} s")


def speed_chart(results: dict[str, Any], *more: Callable[[Any], None]) -> bytes:
    """A PNG of two panels: stages with their limits, time over points. more: draw further ones, given their axes."""
    figure = new_figure(3.4)
    stages, points, *others = panels = figure.subplots(1, 2 + len(more))
    _draw_stages(stages, results["stages"])
    _draw_points(points, results["points"])
    for draw, axes in zip(more, others, strict=True):
        draw(axes)
    for axes in panels:
        axes.tick_params(labelsize=7, color=INK, labelcolor=INK)
        axes.spines[["top", "right"]].set_visible(False)
        axes.xaxis.label.set_size(8)
        axes.yaxis.label.set_size(8)
    figure.suptitle(results["gl"]["renderer"], fontsize=8, color=INK)
    return png(figure)


def _draw_stages(axes: Any, stages: list[dict[str, Any]]) -> None:
    names, places = [stage["name"] for stage in stages], np.arange(len(stages))[::-1]
    axes.barh(places, [stage["ms"] for stage in stages], height=0.6, color=COLORS["stage"])
    for place, stage in zip(places, stages, strict=True):
        axes.plot([stage["limit_ms"]] * 2, [place - 0.4, place + 0.4], color=INK, lw=1.5)
    axes.set_yticks(places, names)
    axes.set(xscale="log", xlabel="milliseconds, 307 200 points; bar: limit")


def _draw_points(axes: Any, rows: list[dict[str, Any]]) -> None:
    for name in ("points", "compute"):
        own = [row for row in rows if row["rasterizer"] == name]
        points = [row["points"] for row in own]
        for key, style, label in (("live_ms", "o-", "new frame"), ("light_ms", "s:", "other light")):
            line = {"color": COLORS[name], "ms": 3, "lw": 1, "label": f"{name}, {label}"}
            axes.plot(points, [row[key] for row in own], style, **line)
    base = rows[-1]
    ends = np.array([rows[0]["points"], base["points"]])
    axes.plot(ends, base["live_ms"] * ends / base["points"], color=PALE, lw=3, zorder=0, label="linear")
    axes.set(xscale="log", yscale="log", xlabel="points", ylabel="milliseconds")
    axes.legend(fontsize=6, frameon=False)


# 80 thousand to 100 million points
SIZES = ((320, 250), (640, 480), (1920, 1080), (3840, 2160), (7680, 4320), (12288, 8192))
QUICK_SIZES = 3
WIDEST = 1920  # of the pictures drawn
YAW = 15  # degrees by which views are turned
PATIENCE = 60.0  # seconds for one size and rasteriser; a slower one is left out, with a note
PACKAGES = Path(__file__).resolve().parents[2]  # the folder that holds the package
COPY = 64 * 2**20  # bytes of the copy that measures a bandwidth
COPIED_BY_GROUP = 256 * 16
COPY_SHADER = """#version 430 core
layout(local_size_x = 256) in;
layout(std430, binding = 0) restrict writeonly buffer Target { uvec4 target[]; };
layout(std430, binding = 1) restrict readonly buffer Source { uvec4 source[]; };
void main() { target[gl_GlobalInvocationID.x] = source[gl_GlobalInvocationID.x]; }
"""
Advance = Callable[[], None]


def measure_speed(device: int, rounds: int, sizes: Sequence[tuple[int, int]], advance: Advance) -> dict[str, Any]:
    """Everything that `bench --speed` shows, ready for JSON."""
    with Renderer(device=device) as renderer:
        context = renderer.context
        results: dict[str, Any] = {"gl": context.limits(), "is_software": context.is_software, "rounds": rounds}
        results["bandwidth"] = bandwidths(renderer)
        results["stages"] = measure_stages(renderer, rounds, results["bandwidth"])
        results["overhead"] = measure_overhead(renderer, rounds)
        advance()
    results["points"] = measure_points(device, rounds, sizes, advance)
    results["cold_start_s"] = cold_start(device, rounds)
    advance()
    return results


def bandwidths(renderer: Renderer) -> dict[str, float]:
    """Bytes per second, read and written, of the best of several copies: of the driver, and of NumPy in main memory."""

    def best(copy: Callable[[], object], copies: int = 1) -> float:
        return max(2 * COPY * copies / (clocked(copy)[1] / 1e3) for _ in range(8))

    with renderer.context.in_use():
        gl, is_software = renderer.context.gl, renderer.context.is_software
        target, source = gl.buffer(reserve=COPY), gl.buffer(reserve=COPY)
        gl.finish()
        gpu = max(best(partial(copy, times), times) for copy, times in copies(target, source, is_software))
        target.release()
        source.release()
    ones, others = np.ones(COPY, np.uint8), np.ones(COPY, np.uint8)
    return {"gpu": gpu, "cpu": best(lambda: np.copyto(others, ones))}


def copies(
    target: moderngl.Buffer, source: moderngl.Buffer, is_software: bool
) -> Iterator[tuple[Callable[[int], None], int]]:
    """Ways to copy COPY bytes some times, and how often: what copies buffers for a GPU is a small part of it."""
    gl = target.ctx

    def by_driver(times: int) -> None:
        for _ in range(times):
            gl.copy_buffer(target, source)
        gl.finish()

    yield by_driver, 1
    if gl.version_code < 430:
        return
    shader = gl.compute_shader(COPY_SHADER)
    target.bind_to_storage_buffer(0)
    source.bind_to_storage_buffer(1)

    def by_shader(times: int) -> None:
        for _ in range(times):
            shader.run(COPY // COPIED_BY_GROUP)
        gl.finish()

    yield by_shader, 1 if is_software else 16  # the wait counts, too
    shader.release()


def timed(lap: Timing) -> float:
    """Milliseconds by the GPU's timer, if there is one."""
    return lap.wall_ms if lap.gpu_ms is None else lap.gpu_ms


def stage_bytes(points: int, pixels: int) -> dict[str, int]:
    """What each stage must at least read and write, bytes.

    A point has depth (4), colour (3) and, once its normal is known, a surface (16). A pixel of the view has the nearest
    1/z (4), a colour (4) and, for a second light, a surface (16) with albedo (8).
    """
    return {
        "Frame": 14 * points,  # depth and colour are copied
        "upload": 14 * points,
        "surface": 20 * points,  # depth in, surface out
        "splats": 16 * points + 12 * pixels,  # surfaces in; 1/z cleared, read and written
        "resolve and light": 27 * pixels,  # 1/z, surface and colour in, picture out
        "light alone": 28 * pixels,  # surface and albedo in, picture out
        "read back": 8 * pixels,
        "PNG": 4 * pixels,
    }


def measure_stages(renderer: Renderer, rounds: int, bandwidth: dict[str, float]) -> list[dict[str, Any]]:
    """One new frame of 640x480 points, turned: [{name, ms, clock, limit_ms}], medians."""
    camera = standard_camera(640, 480)
    first = as_frame(trace(sphere_and_wall(), camera), camera)
    pose, steps = orbit_pose(None, first.pivot, yaw=YAW), renderer.steps
    laps: dict[str, list[tuple[float, str]]] = defaultdict(list)  # milliseconds, by which clock

    def by_wall(name: str, job: Callable[[], Any]) -> Any:
        result, ms = clocked(job)
        laps[name].append((ms, "wall"))
        return result

    def by_step(name: str, step: str) -> None:
        lap = steps.laps[step]
        laps[name].append((timed(lap), "wall" if lap.gpu_ms is None else "GPU"))

    with tempfile.TemporaryDirectory() as folder:
        frame = first
        for _ in range(rounds + 1):
            frame = by_wall("Frame", lambda: Frame(first.color, first.depth, camera))
            steps.timed = True
            renderer.draw(frame, pose=pose)
            for name in ("upload", "surface", "splats"):
                by_step(name, name)
            by_step("resolve and light", "resolve")
            for _ in range(2):
                renderer.draw(frame, Light(position=(1, -1, 0)), pose=pose)
            by_step("light alone", "light")
            steps.timed = False
            target = renderer.draw(frame, pose=pose)
            with renderer.context.gl as gl:
                gl.finish()
                image = by_wall("read back", target.read)
            picture = np.frombuffer(image, np.uint8).reshape(480, 640, 4)
            by_wall("PNG", lambda picture=picture: save_image(Path(folder) / "a.png", picture))
    needed = stage_bytes(frame.points_known, camera.width * camera.height)
    rows = []
    for name, times in laps.items():
        limit = needed[name] / bandwidth["cpu" if name in ("Frame", "PNG") else "gpu"]
        row = {"name": name, "ms": median(ms for ms, _ in times[1:]), "clock": times[-1][1]}
        rows.append(row | {"limit_ms": 1e3 * limit})
    return rows


def measure_overhead(renderer: Renderer, rounds: int) -> list[dict[str, Any]]:
    """What a picture of 32x24 points costs beside its pixels: [{change, calls of Python and C, microseconds}], medians.
    change: what is another than in the picture before: nothing ("same"), the light, the view, or the frame ("new")."""
    first, rows = hilly(32, 24), []
    poses, lights = [orbit_pose(None, (0, 0, 2), yaw=k) for k in range(3)], [Light((k, -1, 0)) for k in range(3)]
    for change in ("same", "light", "view", "new"):
        calls, times = 0, []
        for k in range(3 + max(rounds, 9) * 2):
            light, pose = lights[k % 3 if change == "light" else 0], poses[k % 3 if change == "view" else 0]
            frame = hilly(32, 24) if change == "new" else first
            draw = partial(renderer.render, frame, light=light, pose=pose)
            if k == 2:
                calls = calls_of(draw)
            else:
                times.append(1e3 * clocked(draw)[1])
        rows.append({"change": change, "calls": calls, "us": median(times[2:])})
    return rows


def calls_of(work: Callable[[], object]) -> int:
    """Return how many functions of Python and of C are called."""
    count, before = 0, sys.getprofile()

    def note(_: object, event: str, function: object) -> None:
        nonlocal count
        count += event in ("call", "c_call") and function is not sys.setprofile

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


def hilly(width: int, height: int) -> Frame:
    """Soft hills in which every pixel has a depth; the same view at any size."""
    camera = Camera.from_fov(50, width, height)
    u, v = np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    depth = 2 + 0.3 * v + 0.1 * np.sin(7 * u) * np.cos(5 * v)
    color = np.empty((height, width, 3), np.uint8)
    color[..., 0], color[..., 1], color[..., 2] = 127 + 100 * u, 127 + 100 * v, 128
    return Frame(color, depth, camera)


def measure_points(
    device: int, rounds: int, sizes: Sequence[tuple[int, int]], advance: Advance
) -> list[dict[str, Any]]:
    """For each size and rasteriser: live (a new frame to NumPy), view (another camera), light (another light), ms.

    splats_ms is the rasterising alone, by the GPU's timer if there is one; None of a frame that is drawn in tiles.
    memory_mb is the size of textures and buffers. A rasteriser that would take too long is left out of larger sizes.
    """
    rows = []
    renderers = {}
    for name in ("points", "compute"):
        try:
            renderers[name] = Renderer(device=device, rasterizer=name)
        except ContextError:
            continue  # no OpenGL 4.3
    for width, height in sizes:
        frame = hilly(width, height)
        target = frame.camera.resized(min(width, WIDEST), min(height, WIDEST * height // width))
        for name, renderer in renderers.items():
            last = next((row for row in reversed(rows) if row["rasterizer"] == name), None)
            expected = last["live_ms"] / 1e3 * frame.depth.size / last["points"] if last else 0.0
            repeats = rounds if expected < 0.3 else max(2, rounds // 3)
            if 3 * expected * repeats > PATIENCE:
                continue
            row = {"points": frame.depth.size, "size": [width, height], "rasterizer": name}
            laps = point_laps(renderer, frame, target, repeats)
            row |= {key: median(times) if times else None for key, times in laps.items()}
            row["memory_mb"] = held_bytes(frame.depth.size, target.width * target.height, name) / 1e6
            rows.append(row | {"process_mb": peak_memory_mb()})
        advance()
    for renderer in renderers.values():
        renderer.release()
    return rows


def point_laps(renderer: Renderer, frame: Frame, camera: Camera, repeats: int) -> dict[str, list[float]]:
    """The times of `measure_points`, one of each kind per repeat."""
    poses = [orbit_pose(None, (0, 0, 2), YAW + k) for k in range(3)]
    laps: dict[str, list[float]] = {"live_ms": [], "view_ms": [], "light_ms": [], "splats_ms": []}

    def draw(key: str | None, shown: Frame, view: int, light: float) -> None:
        options: dict[str, Any] = {"camera": camera, "pose": poses[view], "normals": "star"}
        _, ms = clocked(lambda: renderer.render(shown, Light(position=(light, -1, 0)), **options))
        if key:
            laps[key].append(ms)

    draw(None, frame, 0, 0)  # compiles the shaders
    for k in range(repeats):
        new, copied = clocked(lambda: Frame(frame.color, frame.depth, frame.camera))
        draw("live_ms", new, 0, 0)
        laps["live_ms"][-1] += copied
        draw("view_ms", new, 1 + k % 2, 0)
        draw(None, new, 1 + k % 2, 0.1)
        draw("light_ms", new, 1 + k % 2, 0.2)
        renderer.steps.timed = True
        renderer.steps.laps.clear()
        draw(None, new, 0, 0)
        renderer.steps.timed = False
        if step := renderer.steps.laps.get("splats"):
            laps["splats_ms"].append(timed(step))
    return laps


def held_bytes(points: int, pixels: int, rasterizer: str) -> int:
    """Bytes of the textures and buffers: depth, colour and surface of points, all results of the passes for pixels. Of
    a frame that is drawn in tiles, those of one tile."""
    points = points if points <= LARGEST_WHOLE else TILE_POINTS
    left = 4 if rasterizer == "compute" else 8
    return points * (4 + 3 + 16) + pixels * (left + 16 + 8 + 4)


def peak_memory_mb() -> float | None:
    """The most main memory that this process has held so far; None if the system does not count it."""
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def cold_start(device: int, rounds: int) -> float:
    """Median seconds of a command, from its start to its picture on disk, after one that is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        output = str(Path(folder) / "a.png")
        command = [sys.executable, "-m", "pointshade_gl", "render", "-o", output, "--device", str(device)]
        run = partial(subprocess.run, command, cwd=PACKAGES, check=True, capture_output=True)
        return median([clocked(run)[1] for _ in range(rounds + 1)][1:]) / 1e3
