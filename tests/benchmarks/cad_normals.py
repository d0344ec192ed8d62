"""Measures normals on depth that was rendered from CAD models, whose normals are known, with noise or without.

Run by hand: python tests/benchmarks/cad_normals.py MODEL ... [--noise 0,0.1] [--methods auto,star] [--csv FILE]

MODEL is a folder of the 3F2N data set, or laid out as it is: `params.txt` (fx fy cx cy), `depth/000001.bin` (float32,
640x480, background 1), `normal/000001.png` (16 bits a channel). --frames takes so many of each. Noise is Gaussian, in
percent of the frame's median distance. Each line is a method; its columns are mean angular errors in degrees over all
pixels of the model (a missing normal counts as one that faces the viewer), and milliseconds for a frame on this
machine, median of five. D2NT (Feng et al. 2023), if `pip install d2nt` has brought it, stands beside ours.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import pointshade_gl as ps
from pointshade_gl.files.pictures.picture_files import read_deep_colors

SIZE = 640, 480


class Model:
    """A frame of a CAD model: depth (h, w), the camera, and true normals (h, w, 3), camera axes, towards the viewer."""

    def __init__(self, folder: Path, number: int):
        fx, fy, cx, cy = np.loadtxt(folder / "params.txt").ravel()[:4]
        self.camera = ps.Camera(fx, fy, cx, cy, *SIZE)
        depth = np.fromfile(folder / f"depth/{number:06}.bin", "<f4").reshape(SIZE[::-1])
        self.known = depth != 1
        self.depth = np.where(self.known, depth, 0)
        truth = 1 - read_deep_colors(folder / f"normal/{number:06}.png")[..., :3] / 32767.5
        self.truth = truth / np.linalg.norm(truth, axis=-1, keepdims=True)
        rays = self.camera.rays()
        self.facing = -rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def noisy(self, percent: float) -> np.ndarray:
        """The depth with Gaussian noise, the same for all methods."""
        sigma = percent / 100 * np.median(self.depth[self.known])
        noise = np.random.default_rng(1).normal(0, 1, self.depth.shape) * sigma
        return np.where(self.known, self.depth + noise, 0).astype(np.float32)

    def error(self, normals: np.ndarray) -> float:
        """Mean angle to the true normals, degrees."""
        normals = np.where(np.isfinite(normals).all(-1, keepdims=True), normals, self.facing)
        normals = np.where((normals * self.facing).sum(-1, keepdims=True) < 0, -normals, normals)
        cosine = (normals * self.truth).sum(-1)[self.known]
        return float(np.degrees(np.arccos(cosine.clip(-1, 1))).mean())


def estimators(names: list[str]) -> dict[str, Callable[[Model, np.ndarray], np.ndarray]]:
    """Ours by their names, and D2NT where it is installed."""
    renderer = ps.Renderer()

    def ours(name: Any) -> Callable[[Model, np.ndarray], np.ndarray]:
        return lambda model, depth: renderer.estimate_normals(ps.Frame(None, depth, model.camera), name)

    found = {name: ours(name) for name in names}
    try:
        from d2nt import depth2normal  # pyright: ignore[reportMissingImports]
    except ImportError:
        return found

    def theirs(version: str) -> Callable[[Model, np.ndarray], np.ndarray]:
        def estimate(model: Model, depth: np.ndarray) -> np.ndarray:
            c = model.camera
            matrix = np.array([[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])
            with np.errstate(all="ignore"):
                return depth2normal(np.where(depth > 0, depth, 1), matrix, version=version)  # its background is 1

        return estimate

    return found | {version: theirs(version) for version in ("d2nt_basic", "d2nt_v2", "d2nt_v3")}


def milliseconds(estimate: Callable[[Model, np.ndarray], np.ndarray], model: Model) -> float:
    times = []
    for percent in (0.0, 0.1, 0.1, 0.1, 0.1, 0.1):
        depth = model.noisy(percent)
        began = time.perf_counter()
        estimate(model, depth)
        times.append(1000 * (time.perf_counter() - began))
    return float(np.median(times[1:]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", type=Path, metavar="MODEL")
    parser.add_argument("--noise", default="0,0.03,0.1,0.3", help="percent of the median distance")
    parser.add_argument("--methods", default="auto,star,plane-fit-9,one-sided,triangles-8")
    parser.add_argument("--frames", type=int, default=1)
    parser.add_argument("--csv", type=Path)
    args = parser.parse_args()
    levels = [float(level) for level in args.noise.split(",")]
    numbers = [
        (folder, int(path.stem))
        for folder in args.models
        for path in sorted((folder / "depth").glob("*.bin"))[: args.frames]
    ]
    models = [Model(*one) for one in numbers]
    rows = [["method", *(f"{level:g} %" for level in levels), "ms"]]
    for name, estimate in estimators(args.methods.split(",")).items():
        errors = [np.mean([model.error(estimate(model, model.noisy(level))) for model in models]) for level in levels]
        rows.append([name, *(f"{error:.2f}" for error in errors), f"{milliseconds(estimate, models[0]):.0f}"])
    for row in rows:
        sys.stdout.write(f"{row[0]:14s}" + "".join(f"{cell:>9s}" for cell in row[1:]) + "\n")
    if args.csv:
        with args.csv.open("w", newline="") as file:
            csv.writer(file).writerows(rows)


if __name__ == "__main__":
    main()
