"""Measures large point clouds beside Open3D and PyVista: CPU seconds and memory, each step in a process of its own.

Run by hand: python tests/benchmarks/clouds_beside_others.py [POINTS] [--peers PYTHON]. PYTHON is an interpreter that
has open3d and pyvista. The cloud is a torus with waves, coloured, written once as binary PLY.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

OURS = {
    "load": "cloud = ps.load_cloud(path)",
    "load, normals": "cloud = ps.load_cloud(path); ps.estimate_normals(cloud)",
    "load, lit picture with a shadow": "ps.save_image(out, ps.render(ps.load_cloud(path), ps.Light(shadow=True)))",
    "the same, three views": (
        "cloud = ps.load_cloud(path); r = ps.Renderer()\n"
        "for k in range(3): ps.save_image(out, r.render(cloud, ps.Light(shadow=True), yaw=15.0 * k))"
    ),
}
OPEN3D = {
    "load": "cloud = o3d.io.read_point_cloud(path)",
    "load, normals": (
        "cloud = o3d.io.read_point_cloud(path); cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))"
    ),
}
PYVISTA = {
    "load": "cloud = pv.read(path)",
    "load, picture of points without light": (
        "p = pv.Plotter(off_screen=True, window_size=(640, 480))\n"
        "p.add_points(pv.read(path), scalars='RGB', rgb=True); p.screenshot(out)"
    ),
}
TOOLS = {
    "pointshade_gl": ("import pointshade_gl as ps", OURS),
    "Open3D": ("import open3d as o3d", OPEN3D),
    "PyVista": ("import pyvista as pv", PYVISTA),
}
AT_ONCE = 2_000_000  # points


def write_torus(path: Path, count: int) -> None:
    """A torus with waves, its points evenly at random, with colours."""
    rng = np.random.default_rng(20)
    row = np.dtype([("at", "<f4", 3), ("color", "u1", 3)])
    names = [f"property float {axis}" for axis in "xyz"] + [f"property uchar {one}" for one in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {count}", *names, "end_header", ""]
    with path.open("wb") as file:
        file.write("\n".join(head).encode())
        while count:
            u, v, keep = rng.uniform(0, 1, (3, 2 * AT_ONCE)) * np.array([[2 * np.pi], [2 * np.pi], [1.4]])
            inside = keep < 1 + 0.4 * np.cos(v)
            u, v = u[inside][: min(count, AT_ONCE)], v[inside][: min(count, AT_ONCE)]
            tube = 0.4 + 0.01 * np.sin(20 * u) * np.sin(9 * v)
            ring, rows = 1 + tube * np.cos(v), np.empty(len(u), row)
            rows["at"] = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], -1)
            rows["color"] = np.stack([128 + 100 * np.sin(5 * u), 128 + 100 * np.cos(7 * v), np.full(len(u), 150)], -1)
            file.write(rows.tobytes())
            count -= len(u)


def run(python: str, setup: str, work: str, path: Path) -> str:
    """CPU seconds and memory of some work in a process of its own; its last words if it fails."""
    text = f"import sys; path, out = sys.argv[1:]\n{setup}\n{work}\n"
    with tempfile.TemporaryDirectory() as folder:
        child = subprocess.Popen(
            [python, "-c", text, str(path), f"{folder}/out.png"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        assert child.stderr is not None
        words = child.stderr.read().decode(errors="replace").strip().splitlines()
        _, status, used = os.wait4(child.pid, 0)
    if status:
        return f"failed: {words[-1] if words else f'status {status}'}"
    return f"{used.ru_utime + used.ru_stime:8.1f} CPU s {used.ru_maxrss / 2**20:6.2f} GB"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("points", nargs="?", type=int, default=10_000_000)
    parser.add_argument("--peers", default=sys.executable, help="a Python with open3d and pyvista")
    parser.add_argument("--only", default="", help="one tool's name")
    parser.add_argument("--memory", type=float, help="GB that a process may take at most")
    asked = parser.parse_args()
    if asked.memory:
        resource.setrlimit(resource.RLIMIT_AS, (int(asked.memory * 2**30),) * 2)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.ply"
        write_torus(path, asked.points)
        for tool, (setup, works) in TOOLS.items():
            if asked.only in ("", tool):
                python = sys.executable if tool == "pointshade_gl" else asked.peers
                for name, work in works.items():
                    print(f"{tool:14} {name:40} {run(python, setup, work, path)}", flush=True)


if __name__ == "__main__":
    main()
