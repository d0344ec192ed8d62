"""Measures speed: each stage beside its limit, the memory bandwidth; cost over the number of points; merging."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ..files.frames.frame_files import load_frame
from ..files.pictures.picture_files import save_image
from ..gpu.core.steps import Lap
from ..gpu.points.tiles import LARGEST_WHOLE, TILE_POINTS
from ..notes.errors import ContextError
from ..renderer.renderer import Renderer
from ..scene.camera import Camera, orbit_pose
from ..scene.frame import Frame
from ..scene.light import Light
from ..scene.visible import MERGE
from .against import measure_jobs
from .lit_pictures import LIGHT, YAW, turned
from .measure import clocked
from .merged import count_splats
from .picture_scores import decibels, score_picture
from .scenes import standard_camera
from .tracing import as_frame, sphere_and_wall, trace

# 80 thousand to 100 million points
SIZES = ((320, 250), (640, 480), (1920, 1080), (3840, 2160), (7680, 4320), (12288, 8192))
QUICK_SIZES = 3
WIDEST = 1920  # of the pictures drawn
PATIENCE = 60.0  # seconds for one size and rasteriser; a slower one is left out, with a note
TOLERANCES = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
COPY = 64 * 2**20  # bytes of the copy that measures a bandwidth
Advance = Callable[[], None]


def measure_speed(device: int, rounds: int, sizes: Sequence[tuple[int, int]], advance: Advance) -> dict[str, Any]:
    """Everything that `bench --speed` shows, ready for JSON."""
    with Renderer(device=device) as renderer:
        context = renderer.context
        results: dict[str, Any] = {"gl": context.limits(), "is_software": context.is_software, "rounds": rounds}
        results["bandwidth"] = {"gpu": gpu_bandwidth(renderer), "cpu": cpu_bandwidth()}
        results["stages"] = measure_stages(renderer, rounds, results["bandwidth"])
        advance()
    results["points"] = measure_points(device, rounds, sizes, advance)
    results["merging"] = measure_merging(device, rounds)
    advance()
    results["jobs"] = measure_jobs(device, rounds)
    results["cold_start_s"] = results["jobs"]["first picture"]["ms"] / 1e3
    advance()
    return results


def steps_of(sizes: Sequence[tuple[int, int]]) -> int:
    """How often `measure_speed` advances."""
    return len(sizes) + 3


def gpu_bandwidth(renderer: Renderer) -> float:
    """Bytes per second, read and written, at which the driver copies from buffer to buffer: the best of several."""
    with renderer.context.gl as gl:
        source, target = gl.buffer(reserve=COPY), gl.buffer(reserve=COPY)
        gl.finish()
        found = bandwidth(lambda: (gl.copy_buffer(target, source), gl.finish()))
        source.release()
        target.release()
    return found


def cpu_bandwidth() -> float:
    """The same for NumPy's copy in main memory."""
    source, target = np.ones(COPY, np.uint8), np.ones(COPY, np.uint8)
    return bandwidth(lambda: np.copyto(target, source))


def bandwidth(copy: Callable[[], object]) -> float:
    """The best of several copies."""
    return max(2 * COPY / (clocked(copy)[1] / 1e3) for _ in range(8))


def timed(lap: Lap) -> float:
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
    laps: dict[str, list[float]] = {}
    clocks: dict[str, str] = {}

    def by_wall(name: str, job: Callable[[], Any]) -> Any:
        result, ms = clocked(job)
        laps.setdefault(name, []).append(ms)
        clocks[name] = "wall"
        return result

    def by_step(name: str, step: str) -> None:
        lap = steps.laps[step]
        laps.setdefault(name, []).append(timed(lap))
        clocks[name] = "wall" if lap.gpu_ms is None else "GPU"

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
    limits = {
        name: size / bandwidth["cpu" if name in ("Frame", "PNG") else "gpu"] * 1e3 for name, size in needed.items()
    }
    return [
        {"name": name, "ms": median(times[1:]), "clock": clocks[name], "limit_ms": limits[name]}
        for name, times in laps.items()
    ]


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
    """Bytes of the textures and buffers: depth, colour and surface of points, all results of the passes for pixels.

    Of a frame that is drawn in tiles, those of one tile.
    """
    points = points if points <= LARGEST_WHOLE else TILE_POINTS
    left = 4 if rasterizer == "compute" else 8
    return points * (4 + 3 + 16) + pixels * (left + 16 + 8 + 4)


def peak_memory_mb() -> float | None:
    """The most main memory that this process has held so far; None if the system does not count it."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def measure_merging(device: int, rounds: int) -> list[dict[str, Any]]:
    """For each scene and tolerance: splats drawn, ms of the splats step, PSNR in a view turned by 15 degrees.

    PSNR compares with ray-traced truth for the analytic scene, with the picture without merging for the others.
    """
    camera = standard_camera(640, 480)
    source = trace(sphere_and_wall(), camera)
    turned_pose, hits, truth, seen = turned(source, camera)
    frames = {"sphere and wall": as_frame(source, camera), "vase": load_frame("vase")}
    noise = np.random.default_rng(0).normal(0, 0.002, source.depth.shape)
    frames["sphere and wall, 2 mm noise"] = Frame(None, np.where(source.depth > 0, source.depth + noise, 0), camera)
    try:
        renderers = [Renderer(device=device, rasterizer="compute", merge=tolerance) for tolerance in TOLERANCES]
    except ContextError:
        return []
    rows = []
    for scene, frame in frames.items():
        pose = orbit_pose(None, frame.pivot, YAW)
        laps: list[list[float]] = [[] for _ in renderers]
        for _ in range(rounds + 1):
            for times, renderer in zip(laps, renderers, strict=True):
                renderer.steps.timed = True
                renderer.steps.forget("splats")
                renderer.draw(frame, pose=pose)
                times.append(timed(renderer.steps.laps["splats"]))
        exact = renderers[0].render(frame, pose=pose)
        normals = np.nan_to_num(renderers[0].estimate_normals(frame))
        for tolerance, times, renderer in zip(TOLERANCES, laps, renderers, strict=True):
            image = renderer.render(frame, pose=pose)
            if scene == "sphere and wall":
                lit = renderer.render(frame, LIGHT, pose=turned_pose)
                psnr = score_picture(lit, hits.surface, truth, hits, seen).psnr
            else:
                error = (image.astype(float) - exact)[exact[..., 3] > 0]
                psnr = decibels(error) if error.any() else None
            splats = count_splats(frame.depth, normals, frame.camera, tolerance)
            row = {"scene": scene, "tolerance": tolerance, "splats": splats, "points": frame.points_known}
            rows.append(row | {"splats_ms": median(times[1:]), "psnr": psnr, "is_default": tolerance == MERGE})
    for renderer in renderers:
        renderer.release()
    return rows
