"""Draws the quality of whole pictures: PSNR against milliseconds."""

from __future__ import annotations

from typing import Any

import numpy as np

from .charts import INK, color, label_points, legend, mark, new_panels, png, settled, short, title
from .lit_pictures import LIT, SPOILED
from .stress import CONDITIONS


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
