"""Draws what forms of points and numbers of samples cost and give: quality against milliseconds, a column per angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .charts import INK, headline, new_figure, plain, png
from .forms import MADE, PHONG, RESOLVED, SCALES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMS = {"footprint": "#3d9463", "round": "#3f7fb5", "mesh": "#d03a2b"}
WAYS = {MADE: "^", RESOLVED: "v", PHONG: "o"}
LIT = "#8a4f9e"
ROWS = (  # key, scale of the view, factor, label of the axis
    ("psnr", SCALES[0], 1, "a quarter the size\nPSNR, dB"),
    ("psnr", SCALES[1], 1, "the source's size\nPSNR, dB"),
    ("psnr", SCALES[2], 1, "four times the size\nPSNR, dB"),
    ("holes", 1, 100, "the source's size\nholes, %"),
    ("spill", 1, 100, "the source's size\nspill, %"),
    ("outline", 1, 1, "the source's size\noutline, pixels off"),
)


def form_chart(results: dict[str, Any]) -> bytes:
    """A PNG: a row of panels for each measure and size, a column for each angle; last, where splats are lit."""
    forms = results["forms"]
    yaws = list(dict.fromkeys(row["yaw"] for row in forms["rows"]))
    figure = new_figure(11.5)
    panels = figure.subplots(len(ROWS) + 1, len(yaws), sharex="row", sharey="row", squeeze=False)
    for (key, scale, factor, label), row in zip(ROWS, panels, strict=False):
        row[0].set_ylabel(label, fontsize=7.5)
        for yaw, axes in zip(yaws, row, strict=True):
            for form, color in FORMS.items():
                own = [r for r in forms["rows"] if (r["yaw"], r["scale"], r["splat"]) == (yaw, scale, form)]
                ms, values = [r["ms"] for r in own], [factor * r[key] for r in own]
                axes.plot(ms, values, color=color, lw=1, alpha=0.6)
                axes.scatter(ms, values, [6 + 8 * r["samples"] ** 0.5 for r in own], color=color, zorder=3)
        if key != "psnr":
            row[0].set_ylim(
                bottom=0, top=1.1 * max(factor * r[key] for r in forms["rows"] if r["scale"] == scale) + 1e-9
            )
    panels[-1][0].set_ylabel("splats by GL points\nPSNR, dB", fontsize=7.5)
    for yaw, axes in zip(yaws, panels[-1], strict=True):
        for row in forms["lit"]:
            if row["yaw"] == yaw:
                axes.plot(row["ms"], row["psnr"], WAYS[row["way"]], color=LIT, ms=5, fillstyle=_fill(row["way"]))
    for yaw, axes in zip(yaws, panels[0], strict=True):
        axes.set_title(f"turned by {yaw}°" if yaw else "own camera", fontsize=9, fontweight="bold", color=INK)
    for axes in panels.flat:
        _set_clock(axes)
    width, height = forms["size"]
    where = results["gl"]["renderer"].split(" (")[0]
    figure.supxlabel(f"milliseconds for a new view of {width}x{height} points ({where}, wall clock)", fontsize=8.5)
    _legend(figure)
    return png(figure)


def _fill(way: str) -> Any:
    return "none" if way == RESOLVED else "full"


def _set_clock(axes: Axes) -> None:
    from matplotlib.ticker import LogLocator

    plain(axes)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    axes.minorticks_off()
    axes.xaxis.set_major_formatter("{x:g}")


def _legend(figure: Any) -> None:
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color=color, lw=2, label=form) for form, color in FORMS.items()]
    entries += [Line2D([], [], color=INK, lw=0, marker="o", ms=3, label="dots from left: 1, 4, 16 samples")]
    entries += [
        Line2D([], [], color=LIT, lw=0, marker=mark, ms=5, fillstyle=_fill(way), label=way)
        for way, mark in WAYS.items()
    ]
    headline(figure, "Forms of points, and samples, against ray-traced truth", entries)
