"""Shows the speed: as tables and as a chart."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console

from .charts import INK, PALE, new_figure, png
from .tables import brief, new_table

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
    columns = "rasterizer", "new frame", "million per second", "other view", "other light", "splats", "GPU MB"
    table = new_table("milliseconds from frame to NumPy, by number of points", "points", *columns)
    for row in results["points"]:
        rate = row["points"] / row["live_ms"] / 1e3
        cells = [row["live_ms"], rate, row["view_ms"], row["light_ms"], row["splats_ms"], row["memory_mb"]]
        table.add_row(f"{row['points']:,}".replace(",", " "), row["rasterizer"], *map(brief, cells))
    console.print(table)
    columns = "tolerance", "splats", "share", "splats ms", "PSNR dB"
    table = new_table("merging pixels of one plane, seen from 15 degrees to the side", "scene", *columns)
    for row in results["merging"]:
        share = f"{100 * row['splats'] / row['points']:.3g} %"
        cells = f"{row['tolerance']:g}", str(row["splats"]), share, brief(row["splats_ms"]), brief(row["psnr"])
        table.add_row(row["scene"], *cells, style="bold" if row["is_default"] else None)
    console.print(table)
    console.print(f"cold start: `pointshade render` of the vase takes {results['cold_start_s']:.2f} s")


def show_comparison(rows: list[dict[str, Any]], against: str, console: Console) -> None:
    """Prints how long each job took before and now. Ratios above 1: it has become slower."""
    columns = "before", "now", "now/before", "half of the rounds", "CPU time now/before"
    table = new_table(f"milliseconds, {against} and this version", "job", *columns)
    for row in rows:
        ratio, cpu = (f"{row[key]:.2f}" if row[key] else "-" for key in ("ratio", "cpu_ratio"))
        spread = f"{row['spread'][0]:.2f} to {row['spread'][1]:.2f}" if row["spread"] else "-"
        before, now = (f"{row[key]:.3g}" if row[key] else "-" for key in ("before_ms", "now_ms"))
        table.add_row(row["job"], before, now, ratio, spread, cpu)
    console.print(table)


def speed_chart(results: dict[str, Any]) -> bytes:
    """A PNG of three panels: stages with their limits, time over points, merging."""
    figure = new_figure(3.4)
    stages, points, merging = figure.subplots(1, 3)
    _draw_stages(stages, results["stages"])
    _draw_points(points, results["points"])
    _draw_merging(merging, results["merging"])
    for axes in (stages, points, merging):
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
    axes.set_xscale("log")
    axes.set_xlabel("milliseconds, 307 200 points; bar: limit")


def _draw_points(axes: Any, rows: list[dict[str, Any]]) -> None:
    for name in ("points", "compute"):
        own = [row for row in rows if row["rasterizer"] == name]
        for key, style, label in (("live_ms", "o-", "new frame"), ("light_ms", "s:", "other light")):
            values = [row[key] for row in own]
            axes.plot(
                [row["points"] for row in own], values, style, color=COLORS[name], ms=3, lw=1, label=f"{name}, {label}"
            )
    base = rows[-1]
    ends = np.array([rows[0]["points"], base["points"]])
    axes.plot(ends, base["live_ms"] * ends / base["points"], color=PALE, lw=3, zorder=0, label="linear")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("points")
    axes.set_ylabel("milliseconds")
    axes.legend(fontsize=6, frameon=False)


def _draw_merging(axes: Any, rows: list[dict[str, Any]]) -> None:
    other = axes.twinx()
    for k, scene in enumerate(dict.fromkeys(row["scene"] for row in rows)):
        own = [row for row in rows if row["scene"] == scene]
        at = [max(row["tolerance"], 1e-7) for row in own]
        style = ("-", "--", ":")[k]
        axes.plot(
            at, [100 * row["splats"] / row["points"] for row in own], style, color=COLORS["stage"], lw=1, label=scene
        )
        other.plot(at, [row["psnr"] or np.nan for row in own], style, color=COLORS["compute"], lw=1)
    axes.set_xscale("log")
    axes.set_xlabel("tolerance of merging, share of 1/z (left end: 0)")
    axes.set_ylabel("splats, % of the points", color=COLORS["stage"])
    other.set_ylabel("PSNR, dB", color=COLORS["compute"], fontsize=8)
    other.tick_params(labelsize=7)
    other.spines[["top"]].set_visible(False)
    axes.legend(fontsize=6, frameon=False)
