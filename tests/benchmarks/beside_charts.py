"""Draws the charts beside other programs from measured results, and prints their rows for the README.

Run by hand: python tests/benchmarks/beside_charts.py RESULTS FOLDER. RESULTS is a folder of JSON files: frames.json,
large.json (compare.py with 307 200 and 8.3 million points), films.json (film_beside_others.py) and clouds.json
(clouds_beside_others.py); what is missing is left out. Pictures of the others are written to FOLDER. They are drawn for
the width of a phone, on white, so that they are as legible on a dark page. Colours: Okabe, Ito 2008.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from peers import OURS

from pointshade_gl.bench.charts import DPI, INK, PALE, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 4.5  # inches: 900 pixels
SIZE = 10  # points: 11 pixels high on a phone
LOOKS = {  # in compare.py, its name, colour and mark
    "ours": (OURS, "#007a5a", "D"),
    "pyvista": ("PyVista", "#0072b2", "o"),
    "open3d": ("Open3D", "#b34d00", "s"),
}
COLORS = {name: color for name, color, _ in LOOKS.values()} | {"CloudCompare": "#8a4f7d"}
FIGURES = (  # file, figure of compare.py, what it is, its unit
    ("frames", "live_ms", "new frame", "ms"),
    ("frames", "draw_ms", "new view", "ms"),
    ("frames", "relight_ms", "new light", "ms"),
    ("frames", "first_png_s", "first PNG", "s"),
    ("frames", "peak_rss_mb", "memory", "MB"),
    ("large", "live_ms", "8.3 M points", "ms"),
    ("large", "peak_rss_mb", "their memory", "MB"),
)
TEXT = {"va": "center", "fontsize": SIZE, "fontweight": "bold"}
BESIDE = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "center", "fontsize": SIZE}
JOBS = {"normals": "read it, all normals", "picture": "read it, first picture", "view": "then a new view"}


def new_figure(height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def bare(axes: Axes, title: str = "", under: str = "") -> None:
    """A panel without ticks: the values stand beside the marks."""
    axes.spines[:].set_visible(False)
    axes.tick_params(left=False, bottom=False, labelbottom=False, labelleft=False)
    axes.set_title(title, fontsize=SIZE + 1, fontweight="bold", loc="left", color=INK)
    if under:
        axes.set_xlabel(under, fontsize=SIZE - 1.5, color=INK, loc="left")


def brief(value: float, digits: int = 3) -> str:
    return f"{value:.0f}" if value >= 10 ** (digits - 1) else f"{value:#.{digits}g}"


def measured(results: dict[str, Any]) -> str:
    """When and on what: these charts are those of a software renderer."""
    return f"{results['cores']} CPU cores without a GPU, {date.fromisoformat(results['date']):%B %Y}"


def frames_chart(results: dict[str, Any]) -> bytes:
    """A PNG: how many times as long, and as much memory, the others take; a row for each figure, logarithmic."""
    from matplotlib.ticker import NullLocator

    rows = [one for one in FIGURES if one[0] in results]
    figure = new_figure(0.44 * len(rows) + 1.2)
    axes = figure.subplots()
    bare(axes)
    title = {"x": 0.01, "ha": "left", "color": INK}
    figure.suptitle("How many times as much the others take", **title, fontsize=SIZE + 1, fontweight="bold")
    figure.supxlabel(f"307 200 points; {measured(results['frames'])}", **title, fontsize=SIZE - 1.5)
    axes.axvline(1, color=COLORS[OURS], lw=3)
    least = most = 1.0
    for k, (file, key, what, unit) in enumerate(rows):
        values = results[file]["middle"]
        own = values["ours"][key]
        axes.annotate(f"{what} ", (0, -k), (-52, 0), **BESIDE, ha="right", fontweight="bold", color=INK)
        axes.annotate(f"{brief(own)} {unit}", (0, -k), (-5, 0), **BESIDE, ha="right", color=COLORS[OURS])
        others = [name for name in LOOKS if name != "ours" and values.get(name, {}).get(key)]
        for place, name in enumerate(sorted(others, key=lambda name: values[name][key])):
            ratio, (_, color, mark) = values[name][key] / own, LOOKS[name]
            least, most = min(least, ratio), max(most, ratio)
            axes.plot(ratio, -k, mark, color=color, ms=7, zorder=3)
            side = {"ha": "right"} if place < len(others) - 1 else {}
            shift = (-7 if side else 7, 0)
            text = f"{brief(ratio, 2)}×"
            axes.annotate(text, (ratio, -k), shift, textcoords="offset points", **TEXT, **side, color=color)
    axes.set(xscale="log", xlim=(0.97 if least == 1 else least / 2.6, 2.6 * most), ylim=(-len(rows) + 0.5, 1.1))
    axes.xaxis.set_major_locator(NullLocator())
    axes.xaxis.set_minor_locator(NullLocator())
    axes.annotate(OURS, (0, 0.85), (-5, 0), **BESIDE, ha="right", fontweight="bold", color=COLORS[OURS])
    for x, name in zip((0.1, 0.55), ("pyvista", "open3d"), strict=True):
        text, color, mark = LOOKS[name]
        axes.plot(x, 0.85, mark, color=color, ms=7, transform=axes.get_yaxis_transform())
        axes.annotate(text, (x, 0.85), (7, 0), **BESIDE, fontweight="bold", color=color)
    return png(figure)


def bars(axes: Axes, rows: Sequence[tuple[str, str, float, str]]) -> None:
    """Bars from the top: the text above each, its program, its length, and the value at its end."""
    most = max(row[2] for row in rows)
    for k, (text, program, length, value) in enumerate(rows):
        axes.barh(-k, length, 0.34, color=COLORS[program])
        axes.text(0, -k + 0.22, text, va="bottom", fontsize=SIZE, color=INK)
        axes.text(
            length + 0.015 * most, -k, value, va="center", fontsize=SIZE, color=COLORS[program], fontweight="bold"
        )
    axes.axvline(0, color=PALE, lw=1)
    axes.set(xlim=(0, 1.28 * most), ylim=(-len(rows) + 0.7, 0.75))


def films_chart(films: dict[str, Any]) -> bytes:
    """A PNG: frames a second."""
    texts = {
        OURS: f"{OURS}, 4 samples, denoised",
        f"{OURS}, 1 sample": f"{OURS}, 1 sample, denoised",
        "PyVista": "PyVista, not denoised",
        "Open3D": "Open3D, not denoised",
    }
    rows = [
        (texts[row["program"]], row["program"].split(",")[0], row["frames_a_second"], f"{row['frames_a_second']:.1f}")
        for row in sorted(films["rows"], key=lambda row: -row["frames_a_second"])
    ]
    figure = new_figure(0.55 * len(rows) + 0.8)
    axes = figure.subplots()
    bare(axes, "Frames a second, from files to film", f"640x480 pixels with a Kinect's noise\n{measured(films)}")
    bars(axes, rows)
    return png(figure)


def clouds_chart(clouds: dict[str, Any]) -> bytes:
    """A PNG of a panel for each job: CPU seconds, a new view in CPU milliseconds."""
    panels = {job: cloud_rows(clouds, job) for job in JOBS}
    figure = new_figure(0.5 * sum(map(len, panels.values())) + 0.6 * len(panels) + 0.3)
    heights = [len(rows) + 0.6 for rows in panels.values()]
    for axes, (job, rows) in zip(figure.subplots(len(panels), height_ratios=heights), panels.items(), strict=True):
        what = f"{clouds['points'] / 1e6:g} million points: " if job == "normals" else ""
        bare(axes, f"{what}{JOBS[job]}", measured(clouds) if job == "view" else "")
        bars(axes, rows)
    return png(figure)


def cloud_rows(clouds: dict[str, Any], job: str) -> list[tuple[str, str, float, str]]:
    """Rows of bars, the shortest first."""
    rows = []
    for row in clouds["rows"]:
        program = row["program"]
        if job == "normals" and row["job"] == job:
            error = clouds["degrees"][program]
            told = f", off by {error['box']:.2f}° (box), {error['torus']:.2f}° (torus)" if len(error) == 2 else ""
            rows.append((f"{program}{told}", program, row["cpu_s"], f"{brief(row['cpu_s'], 2)} CPU s"))
        elif job != "normals" and row["job"] in ("picture", "lit"):
            what = "a surface" if program == OURS else "dots"
            text = f"{program}, {'lit, with a shadow' if row['job'] == 'lit' else f'{what} without light'}"
            value = row["view_cpu_ms"] if job == "view" else row["cpu_s"]
            rows.append((text, program, value, f"{brief(value, 2)} CPU {'ms' if job == 'view' else 's'}"))
    return sorted(rows, key=lambda row: row[2])


def markdown(results: dict[str, Any]) -> str:
    """The rows of the README's tables."""
    lines = []
    if "frames" in results:
        files = {file: results[file] for file in ("frames", "large") if file in results}
        lines.append(", ".join(f"{name}: {one['date']}, {one['rounds']} rounds" for name, one in files.items()))
        for name, (text, *_) in LOOKS.items():
            version = results["frames"]["versions"].get(name) or ""
            own = {file: one["middle"].get(name, {}) for file, one in files.items()}
            found = [(own.get(file, {}).get(key), unit) for file, key, _, unit in FIGURES]
            cells = [f"{brief(value)} {unit}" if value else "-" for value, unit in found]
            lines.append(f"| {text} {version} | {' | '.join(cells)} |")
        for file, one in files.items():
            base = one["middle"]["ours"]
            for name, row in one["middle"].items():
                times = [f"{key} {row[key] / base[key]:.1f}" for f, key, *_ in FIGURES if f == file and row.get(key)]
                lines.append(f"{name}, times ours ({file}): {', '.join(times)}")
    for row in results.get("films", {}).get("rows", ()):
        lines.append(f"| {row['program']} {row['version']} | {row['frames_a_second']:.1f} | {row['cpu_ms']:.0f} ms |")
    for row in results.get("clouds", {}).get("rows", ()):
        view = f"{row['view_ms']:.0f} ms" if row["view_ms"] else ""
        cells = f"{row['job']} | {row['cpu_s']:.2g} s | {row['memory_gb']:.1f} GB | {view}"
        lines.append(f"| {row['program']} {row['version']} | {cells} |")
    for name, errors in results.get("clouds", {}).get("degrees", {}).items():
        lines.append(f"{name}, mean error of normals: {', '.join(f'{s} {e:.2g}°' for s, e in errors.items())}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("folder", type=Path)
    asked = parser.parse_args()
    files = {name: asked.results / f"{name}.json" for name in ("frames", "large", "films", "clouds")}
    results = {name: json.loads(file.read_text()) for name, file in files.items() if file.is_file()}
    if not results:
        sys.exit(f"{asked.results}: has none of {', '.join(file.name for file in files.values())}")
    asked.folder.mkdir(parents=True, exist_ok=True)
    if "frames" in results:
        (asked.folder / "beside_frames.png").write_bytes(frames_chart(results))
    for name, chart in {"films": films_chart, "clouds": clouds_chart}.items():
        if name in results:
            (asked.folder / f"beside_{name}.png").write_bytes(chart(results[name]))
    print(markdown(results))


if __name__ == "__main__":
    main()
