"""What merging pixels of one plane saves, and whether it is seen, by its tolerance: a part of `bench --speed`.

Run by hand: pointshade bench --speed, in a clone, where a software renderer draws.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from pointshade_gl.bench.charts import brief, new_table
from pointshade_gl.bench.scenes import standard_camera
from pointshade_gl.bench.speed import COLORS, YAW, timed
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace
from pointshade_gl.files.frames.frame_files import load_frame
from pointshade_gl.notes.errors import ContextError
from pointshade_gl.renderer.renderer import Renderer
from pointshade_gl.scene.camera import Camera, orbit_pose
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.visible import MERGE

TOLERANCES = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
F = np.float32
SIDES = 4, 2  # pixels of the blocks that are merged, the larger first
SLANTED = F(0.05)  # least cosine between a normal and the ray, as in shaders/common/splat.glsl
Floats = NDArray[np.float32]
Rows = list[dict[str, Any]]


def show_merging(rows: Rows, console: Console) -> None:
    """Prints a table."""
    columns = "tolerance", "splats", "share", "splats ms", "PSNR dB"
    table = new_table("merging pixels of one plane, seen from 15 degrees to the side", "scene", *columns)
    for row in rows:
        share = f"{100 * row['splats'] / row['points']:.3g} %"
        cells = f"{row['tolerance']:g}", str(row["splats"]), share, brief(row["splats_ms"]), brief(row["psnr"])
        table.add_row(row["scene"], *cells, style="bold" if row["is_default"] else None)
    console.print(table)


def panel_of(rows: Rows) -> Callable[[Any], None]:
    """Draws a panel of `speed_chart`, given its axes."""
    return partial(_draw, rows=rows)


def _draw(axes: Any, rows: Rows) -> None:
    other = axes.twinx()
    for k, scene in enumerate(dict.fromkeys(row["scene"] for row in rows)):
        own = [row for row in rows if row["scene"] == scene]
        at = [max(row["tolerance"], 1e-7) for row in own]
        style = ("-", "--", ":")[k]
        shares = [100 * row["splats"] / row["points"] for row in own]
        axes.plot(at, shares, style, color=COLORS["stage"], lw=1, label=scene)
        other.plot(at, [row["psnr"] or np.nan for row in own], style, color=COLORS["compute"], lw=1)
    axes.set(xscale="log", xlabel="tolerance of merging, share of 1/z (left end: 0)")
    axes.set_ylabel("splats, % of the points", color=COLORS["stage"])
    other.set_ylabel("PSNR, dB", color=COLORS["compute"], fontsize=8)
    other.tick_params(labelsize=7)
    other.spines[["top"]].set_visible(False)
    axes.legend(fontsize=6, frameon=False)


def count_splats(depth: Floats, normals: Floats, camera: Camera, tolerance: float) -> int:
    """Return the number of splats: one for each block of pixels on one plane, one for each other pixel.

    depth      (h, w), 0 = nothing
    normals    (h, w, 3), 0 where missing
    tolerance  how far off the plane pixels may lie, as a share of 1/z
    """
    pad = (0, -depth.shape[0] % SIDES[0]), (0, -depth.shape[1] % SIDES[0])
    depth, normals = np.pad(depth, pad), np.pad(normals, (*pad, (0, 0)))
    rest, count = depth > 0, 0
    for side in SIDES:
        merged = rest[::side, ::side] & _on_plane(depth, normals, camera, side, tolerance)
        count += int(merged.sum())
        rest &= ~merged.repeat(side, 0).repeat(side, 1)
    return count + int(rest.sum())


def _on_plane(depth: Floats, normals: Floats, camera: Camera, side: int, tolerance: float) -> NDArray[np.bool_]:
    """Return which blocks lie on the plane of their first pixel: there 1/z changes linearly."""
    first, normal = depth[::side, ::side], normals[::side, ::side]
    known = first > 0
    v, u = np.indices(first.shape).astype(F) * F(side)
    fx, fy, cx, cy = np.array(camera.intrinsics, F)
    x, y = (u - cx) / fx, (v - cy) / fy
    cosine = np.minimum(normal[..., 0] * x + normal[..., 1] * y + normal[..., 2], -SLANTED * np.sqrt(x * x + y * y + 1))
    z = np.where(known, first, F(1))
    slope_u, slope_v = normal[..., 0] / (fx * (cosine * z)), normal[..., 1] / (fy * (cosine * z))
    for j, i in np.ndindex(side, side):
        there = depth[j::side, i::side]
        known &= there > 0
        error = np.abs(F(1) / np.where(known, there, F(1)) - (F(1) / z + (slope_u * F(i) + slope_v * F(j))))
        known &= error < F(tolerance) * (F(1) / z)
    return known


def measure_merging(device: int, rounds: int) -> Rows:
    """For each scene and tolerance: splats drawn, ms of the splats step, PSNR beside the picture without merging. The
    view is turned by YAW; PSNR is None where the pictures are the same."""
    camera = standard_camera(640, 480)
    source = trace(sphere_and_wall(), camera)
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
            error = (renderer.render(frame, pose=pose).astype(float) - exact)[exact[..., 3] > 0]
            psnr = float(10 * np.log10(255**2 / (error**2).mean())) if error.any() else None
            splats = count_splats(frame.depth, normals, frame.camera, tolerance)
            row = {"scene": scene, "tolerance": tolerance, "splats": splats, "points": frame.points_known}
            rows.append(row | {"splats_ms": median(times[1:]), "psnr": psnr, "is_default": tolerance == MERGE})
    for renderer in renderers:
        renderer.release()
    return rows
