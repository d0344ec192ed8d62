"""Measures point clouds beside Open3D, PyVista (VTK) and CloudCompare, each step in a process of its own.

Run by hand: python tests/benchmarks/clouds_beside_others.py [POINTS] [--peers PYTHON ...] [--json FILE]. Of the PYTHONs
one has open3d, one pyvista; both need pillow. `CloudCompare` is run when it is on the path; its command line draws no
pictures. The cloud is a torus with waves, coloured, written once as binary PLY. The accuracy of normals is that of
50 000 points on a box and a torus, 2 % of them stray.

What is compared: reading; reading and all normals (30 neighbours; CloudCompare chooses its radius); reading and a first
picture of 640x480 without light, then a new view of the same cameras. The peers draw dots of 2 pixels, with holes; this
package draws a surface, and is measured once more lit, with a shadow.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from cloud_programs import END, PROGRAMS, START
from peers import OURS, ROOT, Run, measure, middle, python_with, write_results

CLOUD_COMPARE = ["-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "PLY", "-PLY_EXPORT_FMT", "BINARY_LE", "-O"]
JOBS = {
    "read": "read it",
    "normals": "read it, all normals",
    "picture": "read it, picture without light",
    "lit": "read it, lit picture with a shadow",
}
SHAPES, FEW = ("box", "torus"), 50_000
AT_ONCE = 2_000_000  # points


def write_points(file: Any, at: np.ndarray, colors: np.ndarray) -> None:
    """Append rows of a binary PLY."""
    rows = np.empty(len(at), np.dtype([("at", "<f4", 3), ("color", "u1", 3)]))
    rows["at"], rows["color"] = at, colors
    file.write(rows.tobytes())


def write_head(file: Any, count: int) -> None:
    names = [f"property float {axis}" for axis in "xyz"] + [f"property uchar {one}" for one in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {count}", *names, "end_header", ""]
    file.write("\n".join(head).encode())


def write_torus(path: Path, count: int) -> None:
    """A torus with waves, its points evenly at random, with colours."""
    rng = np.random.default_rng(20)
    with path.open("wb") as file:
        write_head(file, count)
        while count:
            u, v, keep = rng.uniform(0, 1, (3, 2 * AT_ONCE)) * np.array([[2 * np.pi], [2 * np.pi], [1.4]])
            inside = keep < 1 + 0.4 * np.cos(v)
            u, v = u[inside][: min(count, AT_ONCE)], v[inside][: min(count, AT_ONCE)]
            tube = 0.4 + 0.01 * np.sin(20 * u) * np.sin(9 * v)
            ring = 1 + tube * np.cos(v)
            colors = np.stack([128 + 100 * np.sin(5 * u), 128 + 100 * np.cos(7 * v), np.full(len(u), 150)], -1)
            write_points(file, np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], -1), colors)
            count -= len(u)


def command(tool: str, python: str, job: str, path: Path, out: Path) -> list[str]:
    """The command of a job. Normals are written if `out` is .npy (CloudCompare: .ply)."""
    if tool == "CloudCompare":
        save = ["-SAVE_CLOUDS", "FILE", str(out)] if out.suffix == ".ply" else []
        return [python, *CLOUD_COMPARE, str(path), *(["-OCTREE_NORMALS", "AUTO"] if job == "normals" else []), *save]
    _, setup, jobs = PROGRAMS[tool]
    return [python, "-c", f"{START}{setup}{jobs[job]}{END}", str(path), str(out), str(time.time())]


def run(tool: str, python: str, job: str, path: Path, out: Path) -> Run | str:
    """A job in a process of its own; of pictures the figures are those until the first was written."""
    done = measure(command(tool, python, job, path, out), QT_QPA_PLATFORM="offscreen")
    if isinstance(done, Run) and "wall" in done.said:
        return Run(*(done.said.pop(key) for key in ("wall", "cpu", "memory")), done.said)
    return done


def errors(tool: str, python: str, folder: Path) -> dict[str, float]:
    """Mean error of the normals of points that are not stray, in degrees."""
    sys.path.append(str(ROOT))
    import pointshade_gl as ps
    from tests.support.clouds import angles, cloud

    found = {}
    for shape in SHAPES:
        made, path = cloud(shape, FEW, 32, stray=True), folder / f"{shape}.ply"
        out = folder / f"{shape}-normals{'.ply' if tool == 'CloudCompare' else '.npy'}"
        with path.open("wb") as file:
            write_head(file, FEW)
            write_points(file, made.positions, np.full((FEW, 3), 200))
        done = run(tool, python, "normals", path, out)
        if isinstance(done, str):
            print(f"{tool:14} {shape:40} {done}")
            continue
        normals = np.load(out) if out.suffix == ".npy" else ps.load_cloud(out, up="z").normals
        found[shape] = float(angles(normals, made.normals)[made.genuine].mean())
    return found


def tools(pythons: list[str]) -> dict[str, str]:
    """The programs that are here: their names, and what starts them."""
    found = {name: python_with(module, pythons) for name, (module, *_) in PROGRAMS.items()}
    found |= {OURS: sys.executable, "CloudCompare": shutil.which("CloudCompare")}
    return {name: start for name, start in found.items() if start}


def jobs_of(tool: str) -> tuple[str, ...]:
    return ("read", "normals") if tool == "CloudCompare" else tuple(PROGRAMS[tool][2])


def version_of_cloud_compare() -> str:
    """Its package's, where Debian brought it: the program does not tell."""
    if not shutil.which("dpkg-query"):
        return ""
    asked = ["dpkg-query", "-W", "-f", "${Version}", "cloudcompare"]
    return subprocess.run(asked, capture_output=True, text=True).stdout.split("-")[0]


def main() -> int:
    """Print a table. Returns 1 if a program failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("points", nargs="?", type=int, default=10_000_000)
    parser.add_argument("--peers", nargs="+", default=[sys.executable], help="Pythons with open3d or pyvista")
    parser.add_argument("--only", nargs="+", default=[], help="names of programs")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--memory", type=float, help="GB that a process may take at most")
    parser.add_argument("--json", type=Path, help="a file for the results")
    asked = parser.parse_args()
    if asked.memory:
        resource.setrlimit(resource.RLIMIT_AS, (int(asked.memory * 2**30),) * 2)
    here = {name: start for name, start in tools(asked.peers).items() if not asked.only or name in asked.only}
    work = [(name, job) for name in here for job in jobs_of(name)]
    runs: dict[tuple[str, str], list[Run | str]] = {one: [] for one in work}
    with tempfile.TemporaryDirectory() as place:
        folder, path = Path(place), Path(place) / "cloud.ply"
        degrees = {name: errors(name, start, folder) for name, start in here.items()}
        write_torus(path, asked.points)
        print(f"{asked.points} points, {path.stat().st_size / 2**20:.0f} MB", flush=True)
        for _ in range(asked.rounds):
            for name, job in work:
                runs[name, job].append(run(name, here[name], job, path, folder / "out.png"))
    rows, failed = [], 0
    print(f"{'':51}{'CPU s':>8}{'s':>8}{'GB':>7}{'new view, ms':>14}{'CPU ms':>8}")
    for (name, job), found in runs.items():
        one = middle(found)
        if isinstance(one, str):
            failed = 1
            print(f"{name:14} {JOBS[job]:36} {one}")
            continue
        view = 1e3 * one.said["view"] if "view" in one.said else None
        rows.append({"program": name, "job": job, "wall_s": one.wall, "cpu_s": one.cpu, "memory_gb": one.memory})
        rows[-1] |= {"view_ms": view, "view_cpu_ms": view and 1e3 * one.said["view_cpu"]}
        rows[-1]["version"] = version_of_cloud_compare() if name == "CloudCompare" else one.said["version"]
        shown = f"{view:14.0f}{rows[-1]['view_cpu_ms']:8.0f}" if view else ""
        print(f"{name:14} {JOBS[job]:36}{one.cpu:8.1f}{one.wall:8.1f}{one.memory:7.2f}{shown}")
    for name, found in degrees.items():
        print(f"{name:14} mean error: " + ", ".join(f"{shape} {error:.2f} degrees" for shape, error in found.items()))
    write_results(asked.json, points=asked.points, rounds=asked.rounds, rows=rows, degrees=degrees)
    return failed


if __name__ == "__main__":
    sys.exit(main())
