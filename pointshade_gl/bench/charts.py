"""Draws the results: error against time and against stress. matplotlib is imported when needed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from .measure import BROKEN, CONDITIONS, STRESSES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # left, bottom, right, top
DIRECTIONS, RINGS = 24, 16  # places round its point where a label is tried
OVER_LABEL, OVER_POINT, OUTSIDE = 20.0, 1.0, 100.0  # what a covered pixel costs


def place_labels(points: ArrayLike, sizes: Sequence[tuple[float, float]], room: Box, reach: float) -> Array:
    """(n, 2) middles of n labels of `sizes` (width, height), each near its point; `points` is (n, 2).

    room   the box they must stay in
    reach  how far labels keep from points

    Labels are placed in the given order, as near as there is room; without room, where they cover least.
    """
    marks = np.asarray(points, float).reshape(-1, 2)
    angles = np.pi / 2 + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS  # the first one is above
    around = np.stack([np.cos(angles), np.sin(angles)], -1)
    taken = np.zeros((0, 4))
    obstacles = np.hstack([marks - reach, marks + reach])
    for k, (mark, size) in enumerate(zip(marks, np.asarray(sizes, float), strict=True)):
        away = reach + np.arange(RINGS)[:, None, None] * size[1] / 3
        middles = (mark + around * (away + size / 2)).reshape(-1, 2)
        boxes = np.hstack([middles - size / 2, middles + size / 2])
        cost = OVER_LABEL * common(boxes, taken).sum(-1)
        cost += OVER_POINT * common(boxes, np.delete(obstacles, k, 0)).sum(-1)
        cost += OUTSIDE * (size.prod() - common(boxes, np.array([room])).sum(-1))
        taken = np.vstack([taken, boxes[np.argmin(np.round(cost, 6))]])
    return (taken[:, :2] + taken[:, 2:]) / 2


def common(a: Array, b: Array) -> Array:
    """(n, m) the area that each of n boxes (n, 4) shares with each of m."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.maximum(high - low, 0).prod(-1)


Name = TypeVar("Name")
WIDTH, DPI = 9.0, 200  # inches and dots: sharp on a page 900 pixels wide
COLUMNS = 3
LEAST = 1e-3  # degrees; exact answers have no logarithm
INK, PALE, BAD = "#333333", "#cccccc", "#f6ebe8"
FAMILIES = {  # start of a method's name: the text in the legend, and the colour
    "auto": ("auto", "#d03a2b"),
    "adaptive": ("adaptive", "#8a4f9e"),
    "sparse": ("sparse", "#3f8f8c"),
    "star": ("star, star-borrow", "#3d9463"),
    "plane-fit": ("plane fits, by their width in pixels", "#3f7fb5"),
    "triangles": ("triangles, by their number", "#c98a2e"),
    "": ("differences: central, one-sided", "#7d7d7d"),
}
CURVES = "plane-fit", "triangles"  # families whose members differ in size only: a line joins them
CLOCKS = {"gpu_ms": "GPU time", "wall_ms": "wall clock"}


def check_matplotlib() -> None:
    """Raises ValueError with what to install; ask before a long measurement."""
    try:
        import matplotlib.figure  # noqa: F401 - only whether it is there
    except ImportError:
        raise ValueError("charts need matplotlib: pip install '.[bench]' in the clone") from None


def family(method: str) -> str:
    return next(start for start in FAMILIES if method.startswith(start))


def color(method: str) -> str:
    return FAMILIES[family(method)][1]


def short(method: str) -> str:
    """The name beside a point: the colour already shows the family."""
    last = method.rsplit("-", 1)[-1]
    return last if last.isdigit() else {"star-borrow": "borrow"}.get(method, method)


def error_chart(results: dict[str, Any]) -> bytes:
    """A PNG: milliseconds against mean angular error, one panel per condition, the Pareto front drawn."""
    conditions, methods, clock = results["conditions"], results["methods"], results["clock"]
    figure, panels = new_panels(len(conditions), 2.45, shared=True)
    data = {c: [(results["times"][m][c][clock], results["errors"][m][c]["all"]) for m in methods] for c in conditions}
    for axes, condition in zip(panels, conditions, strict=True):
        points = np.maximum(data[condition], LEAST)
        front = points[pareto_front(*points.T)]
        title(axes, CONDITIONS[condition].title)
        axes.step(*front.T, where="post", color=PALE, lw=3.5, zorder=1)
        for start in CURVES:
            own = points[[family(m) == start for m in methods]]
            axes.plot(*own.T, color=FAMILIES[start][1], lw=0.8, alpha=0.5)
        for method, point in zip(methods, points, strict=True):
            mark(axes, method, *point)
    width, height = results["size"]
    where = f"{CLOCKS[clock]}, {results['gl']['renderer'].split(' (')[0]}"
    figure.supxlabel(f"milliseconds for {width}x{height} pixels ({where})", fontsize=8.5)
    figure.supylabel("mean angular error, degrees", fontsize=8.5)
    front = {"color": PALE, "lw": 3.5, "label": "best for its time (Pareto front)"}
    legend(figure, methods, "Error against time: lower left is better", front)
    for axes, condition in settled(figure, panels, conditions):
        found = zip(methods, data[condition], strict=True)
        words = [f"auto {error:.2g}°" if m == "auto" else short(m) for m, (_, error) in found]
        label_points(axes, np.maximum(data[condition], LEAST), words, methods)
    return png(figure)


def stability_chart(results: dict[str, Any]) -> bytes:
    """A PNG: error against the strength of a stress, one panel per stress; a cross where an estimator breaks."""
    stability, methods = results["stability"], results["methods"]
    figure, panels = new_panels(len(stability), 2.0)
    broken = {name: [m for m in methods if found["breaks"][m] is not None] for name, found in stability.items()}
    for axes, (name, found) in zip(panels, stability.items(), strict=True):
        title(axes, STRESSES[name].title)
        axes.set_xlabel(STRESSES[name].axis, fontsize=7.5, labelpad=1)
        axes.set_ylim(0.005, 100)
        axes.axhspan(BROKEN, 100, color=BAD, zorder=0)
        for method in reversed(methods):
            line = {"auto": {"lw": 3, "zorder": 4}, "adaptive": {"lw": 1.2, "zorder": 5, "ls": (0, (2, 2))}}
            errors = np.maximum(found["errors"][method], LEAST)
            axes.plot(found["strengths"], errors, color=color(method), **line.get(method, {"lw": 0.9, "alpha": 0.7}))
        for method in broken[name]:
            axes.plot(found["breaks"][method], BROKEN, "x", color=color(method), ms=4, mew=1.2, zorder=5)
    figure.supylabel("mean angular error, degrees", fontsize=8.5)
    cross = {"color": INK, "marker": "x", "lw": 0, "ms": 5, "label": f"breaks: passes {BROKEN:g}°"}
    legend(figure, methods, f"Error under increasing stress; {who_holds(stability, methods)}", cross)
    for axes, name in settled(figure, panels, stability):
        crosses = [(stability[name]["breaks"][m], BROKEN) for m in broken[name]]
        label_points(axes, np.reshape(crosses, (-1, 2)), [short(m) for m in broken[name]], broken[name], above=True)
    return png(figure)


def who_holds(stability: dict[str, Any], methods: Sequence[str]) -> str:
    """The chart in a few words: the methods that break under the fewest stresses."""
    counts = {m: sum(found["breaks"][m] is not None for found in stability.values()) for m in methods}
    fewest = min(counts.values())
    names = ", ".join(m for m in methods if counts[m] == fewest)
    return f"broken least, by {fewest} of {len(stability)}: {names}" if fewest else f"never broken: {names}"


def pareto_front(times: Sequence[float], errors: Sequence[float]) -> list[int]:
    """The indices of the methods that no other beats in both time and error, in order of time."""
    front: list[int] = []
    for k in sorted(range(len(times)), key=lambda k: (times[k], errors[k])):
        if not front or errors[k] < errors[front[-1]]:
            front.append(k)
    return front


def new_figure(height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)  # otherwise the picture is drawn again for each text that is measured
    return figure


def new_panels(count: int, height: float, shared: bool = False) -> tuple[Figure, list[Axes]]:
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure = new_figure(height * rows + 0.9)
    panels = list(figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=True).flat)
    for axes in panels[count:]:
        axes.remove()
    for axes in panels[:count]:
        axes.set(xscale="log", yscale="log")
        plain(axes)
        axes.minorticks_off()  # they take most of the drawing time, and nobody reads them
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter("{x:g}")
    return figure, panels[:count]


def plain(axes: Axes) -> None:
    """A panel of two pale axes and a grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(PALE)
    axes.margins(0.08)
    axes.tick_params(labelsize=7, color=PALE, labelcolor=INK)
    axes.grid(True, color="#eeeeee", lw=0.6, zorder=0)


def title(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize=9, fontweight="bold", loc="left", color=INK)


def mark(axes: Axes, method: str, x: float, y: float) -> None:
    """A dot; a ring for auto, so that the method that it chose stays visible."""
    ring: Any = {"ms": 8, "mew": 2, "fillstyle": "none", "zorder": 4}
    axes.plot(x, y, "o", color=color(method), **(ring if method == "auto" else {"ms": 3.5, "zorder": 3}))


def settled(figure: Figure, panels: Sequence[Axes], names: Iterable[Name]) -> Iterator[tuple[Axes, Name]]:
    """The panels with their names, after their places in pixels are fixed."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    yield from zip(panels, names, strict=True)


def label_points(axes: Axes, points: Any, words: Sequence[str], methods: Sequence[str], above: bool = False) -> None:
    """Writes a label beside each point, or above all points. points: (n, 2) in data coordinates."""
    from matplotlib.patheffects import withStroke

    order = sorted(range(len(methods)), key=lambda k: methods[k] != "auto")  # auto gets the best place
    texts = []
    for k in order:
        strong = methods[k] == "auto"
        text = axes.annotate(words[k], points[k], ha="center", va="center", zorder=6, color=color(methods[k]))
        text.set(fontsize=8 if strong else 6.5, fontweight="bold" if strong else "normal")
        text.set_path_effects([withStroke(linewidth=1.6, foreground="white")])
        texts.append(text)
    sizes = [(box.width + 3, box.height * 0.85) for box in (text.get_window_extent() for text in texts)]
    to_pixels, room = axes.transData, axes.get_window_extent()
    places = to_pixels.transform(points[order]) if order else np.zeros((0, 2))
    bottom = places[:, 1].max() if above and order else room.y0
    middles = place_labels(places, sizes, (room.x0, bottom, room.x1, room.y1), reach=DPI / 22)
    for k, text, place, middle, size in zip(order, texts, places, middles, sizes, strict=True):
        text.set_position(to_pixels.inverted().transform(middle))
        gap = np.maximum(np.abs(middle - place) - np.array(size) / 2, 0)
        if np.hypot(*gap) > DPI / 12:  # far away: join them by a line
            ends = to_pixels.inverted().transform([place, middle])
            axes.plot(*ends.T, color=color(methods[k]), lw=0.5, alpha=0.6, zorder=2)


def legend(figure: Figure, methods: Sequence[str], text: str, last: dict[str, Any]) -> None:
    """The headline, the families in use, and one more entry."""
    from matplotlib.lines import Line2D

    used = [start for start in FAMILIES if any(family(m) == start for m in methods)]
    entries = [Line2D([], [], color=FAMILIES[s][1], lw=3, label=FAMILIES[s][0]) for s in used]
    headline(figure, text, [*entries, Line2D([], [], **last)])


def headline(figure: Figure, text: str, entries: Sequence[Line2D], columns: int = 4) -> None:
    style: Any = {"fontsize": 8, "frameon": False, "columnspacing": 1.6, "handlelength": 1.4, "alignment": "left"}
    style["title_fontproperties"] = {"size": 12, "weight": "bold"}
    figure.legend(handles=entries, loc="outside upper left", title=text, ncols=columns, **style)


def png(figure: Figure) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", facecolor="white")
    return buffer.getvalue()


PLAIN_WIDTH = 150  # columns of a table in a file


def wide_console() -> Console:
    """A console on stdout: as wide as the terminal, or wide enough for every table if the output is a file."""
    console = Console()
    return console if console.is_terminal else Console(width=PLAIN_WIDTH)


def new_table(title: str, first: str, *numbers: str) -> Table:
    """A table of a column of names, and columns of numbers."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    table.add_column(first, no_wrap=True)
    for name in numbers:
        table.add_column(name, justify="right")
    return table


def bold(method: str) -> str | None:
    return "bold" if method == "auto" else None


def brief(value: float | None) -> str:
    """Two digits, whole numbers from 100 on; a dash for None."""
    return "-" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.2g}"
