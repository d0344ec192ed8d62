"""Compares lit pictures with ray-traced truth: estimators and shadings here, forms and samples in lit_forms.py.

Run by hand: pointshade bench --images [--quick] [--only NAME] [-o FOLDER], in a clone.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from lit_forms import count_forms, form_chart, measure_forms, show_forms
from traced_light import PICTURE_LIGHT, YAW, score_picture, turned

from pointshade_gl.bench import command
from pointshade_gl.bench.charts import (
    INK,
    color,
    label_points,
    legend,
    mark,
    new_panels,
    png,
    settled,
    short,
    title,
    wide_console,
)
from pointshade_gl.bench.measure import CONDITIONS, clocked, generator
from pointshade_gl.bench.scenes import standard_camera
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace
from pointshade_gl.renderer.renderer import Renderer
from pointshade_gl.scene.appearance import NOT_LIT, SHADINGS, Shading, Splat
from pointshade_gl.scene.frame import Frame
from pointshade_gl.scene.noise import Method

SPOILED = "clean", "1mm-noise", "kinect"
SHAPES: tuple[Splat, ...] = "footprint", "round"  # of splats; meshes: lit_forms.py
LIT: tuple[Shading, ...] = tuple(shading for shading in SHADINGS if shading not in NOT_LIT)


def bench_images(output: Path, quick: bool, only: Sequence[str], seed: int, device: int) -> str:
    """What `pointshade bench` does; then images.png and forms.png, whose figures go into the same results.json.

    Returns one line about what was written. Raises ValueError for unknown names, or without matplotlib.
    """
    about = command.bench(output, quick, only, seed, device)
    plan, methods = command.QUICK if quick else command.FULL, command.select(only)[0]
    rounds = max(plan.rounds - 1, 1)
    few = max(rounds // 2, 1)
    results = json.loads((output / "results.json").read_text(encoding="utf-8"))
    steps = count_pictures(methods, rounds) + count_forms(few)
    with Renderer(device=device) as renderer, command.progress(steps) as advance:
        results["pictures"] = measure_pictures(renderer, plan.size, methods, rounds, seed, advance)
        half = plan.size[0] // 8 * 4, plan.size[1] // 8 * 4
        results["forms"] = measure_forms(renderer, half, few, advance)
    command.write(output, {"images.png": picture_chart(results), "forms.png": form_chart(results)}, results)
    show_forms(results["forms"], wide_console())
    return about.replace("results.json", "images.png, forms.png, results.json")


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
                image, ms = clocked(partial(renderer.render, frame, PICTURE_LIGHT, pose=pose, **options))
                laps[job].append(ms)
                if turn == 0:
                    score = score_picture(image, shown[splat], truth, hits, seen)
                    rows.append({"method": method, "shading": shading, "splat": splat} | vars(score))
                advance()
        found["rows"][name] = [row | {"ms": median(laps[job][1:])} for job, row in zip(jobs, rows, strict=True)]
    return found


def picture_chart(results: dict[str, Any]) -> bytes:
    """A PNG: a row of panels per condition, a column per shading model; dots are footprints, crosses round splats."""
    from matplotlib.ticker import LogLocator

    pictures, methods = results["pictures"], results["methods"]
    cells = [(condition, shading) for condition in SPOILED for shading in LIT]
    figure, panels = new_panels(len(cells), 2.3, shared=True)
    panels[0].set_yscale("linear")
    panels[0].xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))  # all times lie within one decade
    dots = {}
    for axes, (condition, shading) in zip(panels, cells, strict=True):
        title(axes, f"{shading}, {CONDITIONS[condition].title}")
        rows = [row for row in pictures["rows"][condition] if row["shading"] == shading]
        dots[condition, shading] = [(row["ms"], row["psnr"]) for row in rows if row["splat"] == "footprint"]
        for row in rows:
            if row["splat"] == "footprint":
                mark(axes, row["method"], row["ms"], row["psnr"])
            else:
                axes.plot(row["ms"], row["psnr"], "x", color=color(row["method"]), ms=4, mew=0.9, alpha=0.6, zorder=2)
    width, height = pictures["size"]
    figure.supxlabel(f"milliseconds for a picture of {width}x{height} pixels (wall clock)", fontsize=8.5)
    figure.supylabel("PSNR away from edges, dB", fontsize=8.5)
    round_splats = {"color": INK, "marker": "x", "lw": 0, "ms": 5, "label": "crosses: round splats"}
    legend(figure, methods, "Lit pictures against ray-traced truth: upper left is better", round_splats)
    for axes, cell in settled(figure, panels, cells):
        words = [short(m) if m != "auto" else f"auto {dots[cell][k][1]:.0f} dB" for k, m in enumerate(methods)]
        label_points(axes, np.array(dots[cell]), words, methods)
    return png(figure)
