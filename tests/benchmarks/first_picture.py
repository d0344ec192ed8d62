"""Measures the first picture of the vase: a process from its start to the PNG, with and without shader caches.

Run by hand: python tests/benchmarks/first_picture.py [--rounds N] [--json FILE]. Medians of interleaved rounds. Mesa
keeps compiled shaders in a folder. "warm" has one that a run before has filled; "cold" has an empty one each time, as
after installing. This package keeps no shaders of its own. Python takes one sample, a command 16. "floor" is what
nothing here can change: the interpreter, NumPy and an OpenGL context.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from peers import Run, measure, middle, write_results

RENDER = ("-m", "pointshade_gl", "render", "-o", "{out}")
FLOOR = "import numpy, moderngl; moderngl.create_context(standalone=True{backend})"
BACKEND = ", backend='egl'" if sys.platform == "linux" else ""
PYTHON = ("-c", "import pointshade_gl as ps; ps.save_image('{out}', ps.render('vase'))")
JOBS = {  # the words after the interpreter, and whether the cache is warm
    "floor": (("-c", FLOOR.format(backend=BACKEND)), True),
    "Python, warm": (PYTHON, True),
    "Python, cold": (PYTHON, False),
    "command, warm": (RENDER, True),
    "command, cold": (RENDER, False),
    "command, 1 sample, warm": ((*RENDER, "--samples", "1"), True),
}


def first_picture(name: str, folder: Path) -> Run | str:
    """A job in a process of its own; `folder` holds the warm cache."""
    words, warm = JOBS[name]
    with tempfile.TemporaryDirectory() as empty:
        out = Path(empty) / "vase.png"
        cache = folder if warm else Path(empty) / "cache"
        done = measure([sys.executable, *(word.format(out=out) for word in words)], MESA_SHADER_CACHE_DIR=str(cache))
        return done if isinstance(done, str) or name == "floor" or out.is_file() else "failed: no picture"


def main() -> int:
    """Print a table. Returns 1 if a run failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path, help="a file for the results")
    asked = parser.parse_args()
    runs: dict[str, list[Run | str]] = {name: [] for name in JOBS}
    with tempfile.TemporaryDirectory() as place:
        for name in JOBS:
            if JOBS[name][1]:
                first_picture(name, Path(place))
        for _ in range(asked.rounds):
            for name in JOBS:
                runs[name].append(first_picture(name, Path(place)))
    rows, failed = [], 0
    print(f"{'':24}{'s':>7}{'CPU s':>8}{'GB':>7}")
    for name, found in runs.items():
        one = middle(found)
        if isinstance(one, str):
            failed = 1
            print(f"{name:24} {one}")
            continue
        rows.append({"job": name, "wall_s": one.wall, "cpu_s": one.cpu, "memory_gb": one.memory})
        print(f"{name:24}{one.wall:7.2f}{one.cpu:8.2f}{one.memory:7.2f}")
    write_results(asked.json, rounds=asked.rounds, rows=rows)
    return failed


if __name__ == "__main__":
    sys.exit(main())
