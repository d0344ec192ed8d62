"""Compares pictures of pointshade_gl with truth from make_truth.py, and prints figures beside their targets.

    python -m tests.truth.compare TRUTH_DIR [--rasterizer auto|points] [--scenes table,stairs] [--each]

Exit code 0 if all targets are met, otherwise 1. Fed are depth, 8-bit albedo, the camera and a matte material.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, encode, patch, plane, trace

from .files import MATTE, Truth, View, as_light, load
from .lamps import Lamp, lambert
from .measures import STEP, decibels, edges, grown, linear, overlap, seen_by_frame
from .shell import shaded_by_shell

SHADOW_ERROR = 0.25  # share of the light; what differs by more is a shadow's fault, not the shading's
TEETH = 0.05  # % of what is judged: false shadow that does not touch a true one
LIT = 0.03  # light on white; where less would arrive, a shadow is not to be seen
SIZES = (0.7, 0.993, 1.1, 1.37)  # of pictures from the frame's own direction, beside the frame's own
AWAY = {0: 36, 10: 33, 25: 32, 40: 32}  # dB at an angle
HOLES = {10: 0.2, 25: 0.25, 40: 0.4}  # % at an angle


class Figure(NamedTuple):
    """One number of one scene, and the bound of the mean over scenes; `least` says on which side it lies."""

    row: str
    column: str
    value: float
    target: float | None = None
    least: bool = True

    def meets(self, value: float) -> bool:
        return self.target is None or (value >= self.target if self.least else value <= self.target)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--rasterizer", default="auto", choices=("auto", "points", "compute"))
    parser.add_argument("--scenes", default="", help="only these")
    parser.add_argument("--pictures", type=Path, help="a folder for a picture of each scene, lamp and angle")
    parser.add_argument("--each", action="store_true", help="a table of each scene, too")
    given = parser.parse_args()
    scenes = [truth for truth in load(given.truth) if not given.scenes or truth.name in given.scenes.split(",")]
    figures: dict[str, list[Figure]] = {}
    with ps.Renderer(rasterizer=given.rasterizer) as renderer:
        for truth in scenes:
            figures[truth.name] = list(measured(renderer, truth))
            if given.pictures:
                write_pictures(renderer, truth, given.pictures)
            if given.each:
                print_table(truth.name, figures[truth.name])
        figures["a board"] = [Figure("over-exposed x4", "dB", overexposed(renderer), 40)]
    missed = print_table("mean of " + ", ".join(figures), [figure for own in figures.values() for figure in own])
    print("all targets met" if not missed else "missed: " + "; ".join(missed))
    return 1 if missed else 0


def measured(renderer: ps.Renderer, truth: Truth) -> Iterator[Figure]:
    for lamp in truth.lamps:
        for yaw in truth.lit_angles(lamp):
            yield from light_figures(renderer, truth, lamp, yaw)
    for yaw in truth.angles[1:]:
        yield from turned_figures(renderer, truth, yaw)
    yield from seam_figures(renderer, truth)


def light_figures(renderer: ps.Renderer, truth: Truth, lamp: Lamp, yaw: int) -> Iterator[Figure]:
    view, light, row = truth.view(yaw), truth.light(lamp, yaw), f"{lamp.name} {yaw}"
    picture, share = with_share(renderer, truth, lamp, view)
    dark, truly = share < 0.5, light.max(-1) == 0
    seen = seen_by_frame(truth, view) & (picture[..., 3] > 0)
    yield Figure(row, "dB seen", decibels(picture, light, seen))
    calm = seen & ~edges(view) & (np.abs(share - ~truly) < SHADOW_ERROR)
    yield Figure(row, "dB away", decibels(picture, light, calm), AWAY[yaw] if lamp.name != "side" else None)
    judged = seen & reached(lamp, view)
    full = overlap(dark & judged, truly & judged)
    wanted = 0.9 if truth.name == "table" and lamp.name in ("sun", "point") else None
    yield Figure(row, "IoU truth", full)
    if wanted and yaw == 0:
        yield Figure(f"table {lamp.name} {yaw}", "IoU truth", full, wanted)
    shell = shell_shadow(truth, lamp, view, judged & (dark != truly), truly)
    yield Figure(row, "IoU shell", overlap(dark & judged, shell & judged), 0.96 if lamp.name != "side" else None)
    teeth = dark & judged & ~grown(truly, 2)
    yield Figure(row, "teeth %", 100 * teeth.sum() / judged.sum(), TEETH, False)


def shell_shadow(truth: Truth, lamp: Lamp, view: View, asked: np.ndarray, truly: np.ndarray) -> np.ndarray:
    """(h, w) the true shadow, but where asked that of the frame's own surface."""
    shadow = truly.copy()
    shadow[asked] = shaded_by_shell(truth, lamp, view.points[asked])
    return shadow


def with_share(renderer: ps.Renderer, truth: Truth, lamp: Lamp, view: View) -> tuple[np.ndarray, np.ndarray]:
    """The picture with shadows, and which share of the lamp's light arrives, (h, w)."""
    lights = (as_light(lamp, shadow=on) for on in (True, False))
    lit, free = (renderer.render(truth.frame, light, MATTE, truth.camera, view.pose) for light in lights)
    light, most = linear(lit).max(-1), linear(free).max(-1)
    return lit, np.where(most > 0, light / np.maximum(most, 1e-6), 0)


def reached(lamp: Lamp, view: View) -> np.ndarray:
    return (view.depth > 0) & (lambert(lamp, view.points, view.normals) > LIT)


def turned_figures(renderer: ps.Renderer, truth: Truth, yaw: int) -> Iterator[Figure]:
    """Holes where the frame saw something, spill where it did not, and what is drawn in front or behind, %."""
    view, row = truth.view(yaw), f"turned {yaw}"
    seen = seen_by_frame(truth, view)
    depth = renderer.render_depth(truth.frame, truth.camera, view.pose)
    z = view.depth
    drawn = depth > 0
    yield Figure(row, "holes %", 100 * (seen & ~drawn).sum() / seen.sum(), HOLES.get(yaw), False)
    nearer = drawn & (z > 0) & (depth < (1 - STEP) * z)
    spilled = drawn & (z == 0) | nearer & ~seen
    yield Figure(row, "spilled %", 100 * spilled.sum() / drawn.sum(), 0.2 if yaw in HOLES else None, False)
    yield Figure(row, "in front %", 100 * (nearer & seen).sum() / seen.sum(), None, False)
    behind = seen & drawn & (depth > (1 + STEP) * z)
    yield Figure(row, "behind %", 100 * behind.sum() / seen.sum(), None, False)
    traced = view.visible & inside_picture(truth, view)
    yield Figure(row, "empty but traced %", 100 * (traced & ~drawn).sum() / z.size, None, False)


def inside_picture(truth: Truth, view: View) -> np.ndarray:
    """Pixels whose point all four source pixels round it could have seen."""
    c, z = truth.camera, np.maximum(view.points[..., 2], 1e-9)
    u, v = c.fx * view.points[..., 0] / z + c.cx, c.fy * view.points[..., 1] / z + c.cy
    return (view.depth > 0) & (u >= 0) & (u <= c.width - 1) & (v >= 0) & (v <= c.height - 1)


def seam_figures(renderer: ps.Renderer, truth: Truth) -> Iterator[Figure]:
    """Pixels inside the silhouette that show the background, % of the picture, at other sizes than the frame's."""
    for size in SIZES:
        camera = truth.camera.resized(round(size * truth.camera.width), round(size * truth.camera.height))
        for splat, target in (("footprint", 0.01), ("mesh", None)):
            picture = renderer.render(truth.frame, as_light(truth.lamps[0]), MATTE, camera, splat=splat)
            empty = inside_silhouette(truth, camera) & (picture[..., 3] == 0)
            yield Figure(f"size {size}", f"seams {splat} %", 100 * empty.mean(), target, False)
    picture = renderer.render(truth.frame, shading="none")
    known = truth.source.depth > 0
    wrong = (picture[..., :3] != truth.source.albedo).any(-1) & known | ((picture[..., 3] > 0) != known)
    yield Figure("size 1", "seams footprint %", 100 * wrong.mean(), 0, False)
    picture = renderer.render(truth.frame, shading="none", splat="mesh")
    inside = inside_silhouette(truth, truth.camera)
    yield Figure("size 1", "seams mesh %", 100 * (inside & (picture[..., 3] == 0)).mean(), 0.02, False)


def inside_silhouette(truth: Truth, camera: ps.Camera) -> np.ndarray:
    """(h, w) of another size: the nearest source pixel and its eight neighbours all show something."""
    known = np.pad(truth.source.depth > 0, 1, mode="edge")
    all_known = np.lib.stride_tricks.sliding_window_view(known, (3, 3)).all((-1, -2))
    c = truth.camera
    u = np.rint((np.arange(camera.width) - camera.cx) / camera.fx * c.fx + c.cx).astype(int)
    v = np.rint((np.arange(camera.height) - camera.cy) / camera.fy * c.fy + c.cy).astype(int)
    return all_known[np.ix_(np.clip(v, 0, c.height - 1), np.clip(u, 0, c.width - 1))]


def overexposed(renderer: ps.Renderer) -> float:
    """dB of a board's soft shadow at four times the light, against four times the picture at low light."""
    camera, white = ps.Camera(300, 300, 119.5, 89.5, 240, 180), lambda points: np.ones_like(points)
    board = patch((0.05, 0, 1.5), (0.2, 0, 0), (0, 0.15, 0), white)
    frame = as_frame(trace([board, plane((0, 0, -1), (0, 0, 2), white)], camera), camera)
    low, high = (
        renderer.render(
            frame, ps.Light(position=(-0.6, -0.5, 0), intensity=level, radius=0.15, shadow=True), MATTE, samples=64
        )
        for level in (1, 4)
    )
    return decibels(high, np.clip(4 * linear(low), 0, 1), low[..., 3] == 255)


def write_pictures(renderer: ps.Renderer, truth: Truth, folder: Path) -> None:
    """Ours and truth; below them shadows and the error, times 8 (magenta: a hole).

    Shadows: white right, red ours alone, blue the frame's own surface casts it, dim blue only what no picture saw does.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for lamp in truth.lamps:
        for yaw in truth.lit_angles(lamp):
            ps.save_image(folder / f"{truth.name}_{lamp.name}_{yaw:02}.png", panels(renderer, truth, lamp, yaw))


def panels(renderer: ps.Renderer, truth: Truth, lamp: Lamp, yaw: int) -> np.ndarray:
    view, light = truth.view(yaw), truth.light(lamp, yaw)
    picture, share = with_share(renderer, truth, lamp, view)
    seen = seen_by_frame(truth, view)
    true = encode(np.clip(light, 0, 1))
    judged = seen & (picture[..., 3] > 0) & reached(lamp, view)
    dark, truly = share < 0.5, light.max(-1) == 0
    shell = shell_shadow(truth, lamp, view, judged & (dark != truly), truly)
    blue = np.where(shell, 255, 90 * truly)
    masks = np.where(judged[..., None], np.stack([255 * dark, 255 * (dark & shell), blue], -1), 40)
    error = np.where(seen[..., None], np.minimum(8 * np.abs(picture[..., :3] - true), 255), 40)
    error[seen & (picture[..., 3] == 0)] = (255, 0, 255)
    whole = np.concatenate([np.concatenate([on_check(picture), true], 1), np.concatenate([masks, error], 1)])
    return np.dstack([np.rint(whole), np.full(whole.shape[:2], 255)]).astype(np.uint8)


def on_check(picture: np.ndarray) -> np.ndarray:
    """(h, w, 3) float: the picture before a grey check."""
    v, u = np.indices(picture.shape[:2]) // 8
    check = np.where((u + v) % 2, 120.0, 150.0)[..., None]
    alpha = picture[..., 3:] / 255
    return alpha * picture[..., :3] + (1 - alpha) * check


def print_table(title: str, figures: list[Figure]) -> list[str]:
    """Means / worst of equal rows and columns; targets of the means in brackets. Gives what missed them."""
    means: dict[tuple[str, str], list[Figure]] = defaultdict(list)
    for figure in figures:
        means[figure.row, figure.column].append(figure)
    rows = list(dict.fromkeys(row for row, _ in means))
    missed = []
    print(f"\n{title}")
    for row in rows:
        cells = []
        for (other, column), same in means.items():
            if other == row:
                value = float(np.mean([figure.value for figure in same]))
                ok = same[0].meets(value)
                target = "" if same[0].target is None else f" ({'>=' if same[0].least else '<='}{same[0].target:g})"
                worst = (min if same[0].least else max)(figure.value for figure in same)
                cells.append(f"{column} {value:.3f}/{worst:.3f}{target}{'' if ok else ' MISSED'}")
                missed += [] if ok else [f"{row} {column} {value:.3f}{target}"]
        print(f"{row:16s} " + "   ".join(cells))
    return missed


if __name__ == "__main__":
    sys.exit(main())
