"""Draws a small `mermaid` flowchart as SVG, which GitHub draws itself: boxes in rows, arrows downwards.

It knows lines of names with arrows between them, `cli --> viewer --> rendering`, and puts each name one row below the
lowest that points to it.
"""

from itertools import pairwise

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

BOX_W, BOX_H, ACROSS, DOWN, MARGIN = 116, 34, 170, 62, 8


class Mermaid(SphinxDirective):
    has_content = True

    def run(self) -> list[nodes.Node]:
        chains = [[one.strip() for one in line.split("-->")] for line in self.content if "-->" in line]
        arrows = [arrow for chain in chains for arrow in pairwise(chain)]
        return [nodes.raw("", drawing(arrows), format="html")]


def drawing(arrows: list[tuple[str, str]]) -> str:
    """Return the SVG of a graph without circles."""
    places = placed(arrows)
    width = max(x for x, _ in places.values()) + BOX_W / 2 + MARGIN
    height = max(y for _, y in places.values()) + BOX_H / 2 + MARGIN
    lines = [f'<path d="{path(places[a], places[b])}" marker-end="url(#tip)"/>' for a, b in arrows]
    boxes = [
        f'<rect x="{x - BOX_W / 2:g}" y="{y - BOX_H / 2:g}" width="{BOX_W}" height="{BOX_H}" rx="6"/>'
        f'<text x="{x:g}" y="{y:g}">{name}</text>'
        for name, (x, y) in places.items()
    ]
    tip = '<marker id="tip" markerWidth="9" markerHeight="8" refX="8" refY="4" orient="auto"><path d="M0 0 9 4 0 8z"/>'
    told = ", ".join(f"{above} imports {below}" for above, below in arrows)
    return (
        f'<svg class="layers" viewBox="0 0 {width:g} {height:g}" style="max-width: {width:g}px" role="img" '
        f'aria-label="{told}"><defs>{tip}</marker></defs>{"".join(lines)}{"".join(boxes)}</svg>'
    )


def placed(arrows: list[tuple[str, str]]) -> dict[str, tuple[float, float]]:
    """Return the middle of each box."""
    names = list(dict.fromkeys(name for arrow in arrows for name in arrow))
    rows = dict.fromkeys(names, 0)
    for _ in names:
        for above, below in arrows:
            rows[below] = max(rows[below], rows[above] + 1)
    beside = {row: [name for name in names if rows[name] == row] for row in rows.values()}
    middle = MARGIN + BOX_W / 2 + ACROSS * (max(map(len, beside.values())) - 1) / 2
    return {
        name: (middle + ACROSS * (k - (len(found) - 1) / 2), MARGIN + BOX_H / 2 + DOWN * row)
        for row, found in sorted(beside.items())
        for k, name in enumerate(found)
    }


def path(start: tuple[float, float], end: tuple[float, float]) -> str:
    """Return an arrow to the box below; around the boxes between them, if there are some, to its side."""
    (x, y), (x_end, y_end) = start, end
    if y_end - y > 1.5 * DOWN and x != x_end:
        side = x_end + (BOX_W / 2 if x > x_end else -BOX_W / 2)
        return f"M{x:g} {y + BOX_H / 2:g} V{y_end:g} H{side:g}"
    return f"M{x:g} {y + BOX_H / 2:g} L{x_end:g} {y_end - BOX_H / 2:g}"


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("mermaid", Mermaid)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
