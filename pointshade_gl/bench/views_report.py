"""Shows the measurements of several views: as tables and as a chart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from ..scene.appearance import NORMALS_AT
from .charts import INK, headline, new_figure, plain, png, title
from .tables import brief, new_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {"source": "#3f7fb5", "target": "#d03a2b", "normals": "#3d9463", "votes": "#8a4f9e", "gpu_mb": "#c98a2e"}
QUALITIES = {  # what is measured, and the label of its panels
    "normals": "error of normals, degrees\n(low is good)",
    "psnr": "lit picture, PSNR in dB\n(high is good)",
    "flicker": "flicker, 8-bit steps\n(low is good)",
}
ONCE = "normals", "votes"
HELD = ("gpu_mb",)
COSTS = {  # what is measured, its name, and the unit of its straight line
    "source": ("source", "ms a view"),
    "target": ("target", "ms a view"),
    "normals": ("upload and normals", "ms a view"),
    "votes": ("votes", "ms a pair"),
    "gpu_mb": ("all images", "MB a view"),
}


def show_views(results: dict[str, Any], console: Console) -> None:
    """Prints the tables, and on what they were measured."""
    name = results["gl"]["renderer"]
    where = f"{name}, a software renderer: times are CPU time, of all cores" if results["is_software"] else name
    console.print(where, soft_wrap=True)
    conditions = results["quality"]
    for quality, label in QUALITIES.items():
        table = new_table(f"{' '.join(label.split())}: source / target", "views", *conditions)
        for k, count in enumerate(results["counts"]):
            cells = (
                " / ".join(f"{rows[place][k][quality]:.2f}" for place in NORMALS_AT) for rows in conditions.values()
            )
            table.add_row(str(count), *cells)
        console.print(table)
    width, height = results["size"]
    columns = "new view, source", "new view, target", "once: upload, normals", "once: votes", "pairs", "GPU MB"
    table = new_table(f"milliseconds and memory for views and pictures of {width}x{height} pixels", "views", *columns)
    for row in results["cost"]:
        keys = (*NORMALS_AT, *ONCE, "pairs", "gpu_mb")
        table.add_row(str(row["count"]), *(brief(row[key]) for key in keys))
    console.print(table)
    for name, fit in results["fits"].items():
        console.print(f"{straight_line(name, fit)}; off this line by at most {100 * fit['off']:.1f} % of the largest")


def straight_line(name: str, fit: dict[str, float]) -> str:
    """A cost as a formula."""
    label, unit = COSTS[name]
    return f"{label}: {fit['start']:.2g} + {fit['slope']:.2g} {unit}"


def views_chart(results: dict[str, Any]) -> bytes:
    """A PNG: three rows of panels, one column per error of the poses, and a row of costs with their straight lines."""
    figure = new_figure(9.4)
    conditions, counts = results["quality"], results["counts"]
    rows = figure.subplots(len(QUALITIES) + 1, len(conditions), squeeze=False)
    for axes, condition in zip(rows[0], conditions, strict=True):
        title(axes, f"Kinect noise, {condition}")
    for row, (quality, label) in zip(rows, QUALITIES.items(), strict=False):
        for axes, found in zip(row, conditions.values(), strict=True):
            plain(axes)
            axes.set_ylabel(label if axes is row[0] else "", fontsize=8)
            for place in NORMALS_AT:
                axes.plot(counts, [cell[quality] for cell in found[place]], "o-", color=COLORS[place], ms=3.5, lw=1.5)
            axes.set_xscale("log", base=2)
            axes.set_xticks(counts, map(str, counts))
        _share_height(row, from_zero=quality != "psnr")
    for axes in rows[-2]:
        axes.set_xlabel("views", fontsize=8)
    kind = "CPU" if results["is_software"] else "wall clock"
    costs = {f"each new view, ms ({kind})": NORMALS_AT, f"once for a set, ms ({kind})": ONCE, "GPU memory, MB": HELD}
    for axes, (text, names) in zip(rows[-1], costs.items(), strict=True):
        _draw_costs(axes, text, names, results)
    _headline(figure, results)
    return png(figure)


def _draw_costs(axes: Axes, text: str, names: Sequence[str], results: dict[str, Any]) -> None:
    """Costs over the number of views; a pale line is the straight one, that of votes straight over the pairs."""
    plain(axes)
    title(axes, text)
    rows = results["cost"]
    for name in names:
        fit, color = results["fits"][name], COLORS[name]
        straight = {
            row["count"]: fit["start"] + fit["slope"] * row["pairs" if name == "votes" else "count"]
            for row in rows
            if row["count"] > 1
        }
        axes.plot(*zip(*straight.items(), strict=True), color=color, lw=4, alpha=0.25, zorder=1)
        values = [row[name] for row in rows]
        axes.plot([row["count"] for row in rows], values, "o", color=color, ms=3.5, label=straight_line(name, fit))
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.25 * axes.get_ylim()[1])  # room for the legend
    axes.set_xlabel("views", fontsize=8)
    axes.legend(fontsize=7, frameon=False, loc="upper left")


def _share_height(row: np.ndarray, from_zero: bool) -> None:
    """Equal heights mean equal values in a row of panels."""
    low, high = np.transpose([axes.get_ylim() for axes in row])
    top = high.max() + 0.03 * np.ptp([low, high])
    for axes in row:
        axes.set_ylim(0 if from_zero else low.min(), top)


def _headline(figure: Any, results: dict[str, Any]) -> None:
    from matplotlib.lines import Line2D

    names = {"source": "in each frame, then mixed (source)", "target": "in the picture, on the merged depth (target)"}
    entries = [
        Line2D([], [], color=COLORS[place], marker="o", ms=4, lw=1.5, label=names[place]) for place in NORMALS_AT
    ]
    entries.append(Line2D([], [], color=INK, alpha=0.25, lw=4, label="straight lines through the costs"))
    width, height = results["size"]
    headline(figure, f"Where normals of several views are estimated, {width}x{height} pixels", entries, 3)
    figure.supxlabel(results["gl"]["renderer"].split(" (")[0], fontsize=8, color=INK)
