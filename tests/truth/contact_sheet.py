"""Draws about 30 pictures beside their truth on one sheet that a person sees through in a minute:

    python -m tests.truth.contact_sheet sheet.png

Of each: our picture, the truth, and what is wrong in red. Larger pictures are cut at their middle. Exit code 1 if
more is wrong in one than may be; names and figures are printed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import pointshade_gl as ps
from pointshade_gl.page import draw_page

from ..page.test_pictures import drawn
from ..support.browser import Browser, find_chromium
from .cases import Cell, Traced, cases
from .compare import on_check
from .files import MATTE
from .kept import scene

WIDTH, HEIGHT, CAPTION, ACROSS = 200, 150, 16, 3


def main() -> int:
    with ps.Renderer() as auto, ps.Renderer(rasterizer="points") as points:
        cells = [case.draw(points if case.rasterizer == "points" else auto) for case in cases()]
        if find_chromium():
            with TemporaryDirectory() as folder, Browser.launched(Path(folder)) as browser:
                cells.append(page_cell(browser, points))
    sheet(cells).save(sys.argv[1])
    for cell in cells:
        print(f"{'ok    ' if cell.passes else 'MISSED'} {cell.share:7.3f} % (<= {cell.bound}) {cell.name}")
    return 0 if all(cell.passes for cell in cells) else 1


def page_cell(browser: Browser, renderer: ps.Renderer) -> Cell:
    """What the browser draws of a page, lit with shadows."""
    case = Traced("table", "sun")
    kept = scene(case.scene)
    with browser.opened(draw_page(renderer, kept.frame, light=kept.light(case.lamp), material=MATTE)) as opened:
        opened.wait_until_drawn()
        cell = case.judged(drawn(opened, {}, None, [kept.light(case.lamp)])[0])
    return replace(cell, name=f"{cell.name}, page")


def sheet(cells: Sequence[Cell]) -> Image.Image:
    wide, high = 3 * WIDTH + 12, HEIGHT + CAPTION + 6
    whole = Image.new("RGB", (ACROSS * wide, -(-len(cells) // ACROSS) * high), (24, 24, 24))
    for k, cell in enumerate(cells):
        left, top = k % ACROSS * wide, k // ACROSS * high
        text = f"{cell.name}: {cell.share:.3f} % wrong, {cell.bound} allowed"
        colour = (170, 230, 170) if cell.passes else (255, 120, 110)
        ImageDraw.Draw(whole).text((left + 2, top), text, colour, ImageFont.load_default(12))
        for n, panel in enumerate((on_check(cell.picture), on_check(cell.truth), marked(cell))):
            picture = Image.fromarray(np.rint(middle(panel)).astype(np.uint8))
            whole.paste(picture, (left + n * (WIDTH + 2), top + CAPTION))
    return whole


def marked(cell: Cell) -> np.ndarray:
    """(h, w, 3) the picture in dark grey, and what is wrong in red, with a rim that can be seen."""
    dim = np.repeat(on_check(cell.picture).mean(-1, keepdims=True) * 0.3, 3, -1)
    dim[cell.wrong] = (255, 40, 40)
    return dim


def middle(panel: np.ndarray) -> np.ndarray:
    """At most WIDTH by HEIGHT pixels of the panel's middle."""
    top, left = (max(0, (side - most) // 2) for side, most in zip(panel.shape[:2], (HEIGHT, WIDTH), strict=True))
    return panel[top : top + HEIGHT, left : left + WIDTH]


if __name__ == "__main__":
    sys.exit(main())
