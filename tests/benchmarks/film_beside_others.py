"""Measures films of noisy frames beside PyVista and Open3D: frames a second, and CPU seconds over all cores.

Run by hand: python tests/benchmarks/film_beside_others.py [--frames N] [--peers PYTHON ...] [--json FILE]. Of the
PYTHONs one has pyvista, one open3d; both need pillow and imageio-ffmpeg. Without them only this package is measured.
All read the same folder, 640x480 colours and millimetres with a Kinect's noise, see each frame from 15 degrees aside
under one light, and write an H.264 film. Each is a process of its own, from its start to the finished film, in
interleaved rounds.

The peers draw points of 2 pixels with normals by central differences: they have nothing against noise.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from peers import OURS, Run, measure, middle, python_with, write_results

import pointshade_gl as ps

CAMERA = ps.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
COMMAND = "import sys; from pointshade_gl.cli.main import main; sys.argv[1:] = [{words}]; main()"

SHARED = """
import json, sys
from pathlib import Path
import imageio_ffmpeg
import numpy as np
from PIL import Image

folder, out = Path(sys.argv[1]), sys.argv[2]
k = json.loads((folder / "intrinsics.json").read_text())
fx, fy, cx, cy, w, h = (k[name] for name in ("fx", "fy", "cx", "cy", "width", "height"))
names = sorted(path.name for path in (folder / "depth").iterdir())
film = imageio_ffmpeg.write_frames(out, (w, h), fps=25, codec="libx264", output_params=["-crf", "18"])
film.send(None)
x, y = ((np.arange(w, dtype=np.float32) - cx) / fx)[None], ((np.arange(h, dtype=np.float32) - cy) / fy)[:, None]
turn = np.radians(15)
middle = np.array([0, 0, 1.8])
eye = middle + 1.8 * np.array([np.sin(turn), 0, -np.cos(turn)])
fov = float(np.degrees(2 * np.arctan(h / 2 / fy)))

def read(name):
    return np.asarray(Image.open(folder / "color" / name)), np.asarray(Image.open(folder / "depth" / name))
"""
PYVISTA = (
    SHARED
    + """
import pyvista as pv

plotter = pv.Plotter(off_screen=True, window_size=(w, h), lighting="none")
plotter.set_background((0.11, 0.11, 0.125))
plotter.add_light(pv.Light(position=(-0.5, -1.0, 0.0), focal_point=tuple(middle), light_type="scene light"))
actor = None
for name in names:
    color, depth = read(name)
    z = depth * np.float32(1e-3)
    points = np.stack([x * z, y * z, z], -1)
    along, down = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normals = np.cross(down, along)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    known = z > 0
    cloud = pv.PolyData(points[known])
    cloud.point_data["rgb"] = color[known]
    cloud.point_data.active_normals = normals[known]
    if actor is None:
        actor = plotter.add_points(cloud, scalars="rgb", rgb=True, point_size=2.0, lighting=True, specular=0.3,
                                   specular_power=32, ambient=0.15, diffuse=0.8)
        actor.prop.interpolation = "Phong"
        camera = plotter.camera
        camera.position, camera.focal_point, camera.up = tuple(eye), tuple(middle), (0, -1, 0)
        camera.view_angle, camera.clipping_range = fov, (0.05, 10)
        plotter.show(auto_close=False, interactive=False)
    else:
        actor.mapper.SetInputData(cloud)
        plotter.render()
    film.send(np.ascontiguousarray(plotter.screenshot(None, return_img=True)[..., :3]))
film.close()
print(json.dumps({"version": f"{pv.__version__} (VTK {'.'.join(map(str, pv.vtk_version_info))})"}))
"""
)
OPEN3D = (
    SHARED
    + """
import os
os.environ.setdefault("EGL_PLATFORM", "surfaceless")
import open3d as o3d
from open3d.visualization import rendering

renderer = rendering.OffscreenRenderer(w, h)
scene = renderer.scene
scene.set_background([0.11, 0.11, 0.125, 1])
scene.view.set_post_processing(False)
scene.view.set_antialiasing(False)
scene.view.set_ambient_occlusion(False)
scene.view.set_shadowing(False, rendering.View.ShadowType.PCF)
material = rendering.MaterialRecord()
material.shader, material.point_size, material.base_roughness = "defaultLit", 2.0, 0.4
scene.scene.set_sun_light([0.4, 0.7, 1.0], [1, 1, 1], 75000)
scene.scene.enable_sun_light(True)
matrix = o3d.core.Tensor(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]))
renderer.setup_camera(fov, middle.astype(np.float32), eye.astype(np.float32), np.float32([0, -1, 0]), 0.05, 10.0)
for name in names:
    color, depth = read(name)
    pictures = [o3d.t.geometry.Image(np.ascontiguousarray(one)) for one in (color, depth[..., None])]
    cloud = o3d.t.geometry.PointCloud.create_from_rgbd_image(
        o3d.t.geometry.RGBDImage(*pictures), matrix, depth_scale=1000.0, depth_max=10.0, with_normals=True
    )
    if scene.has_geometry("frame"):
        scene.remove_geometry("frame")
    scene.add_geometry("frame", cloud, material)
    film.send(np.ascontiguousarray(np.asarray(renderer.render_to_image())[..., :3]))
film.close()
print(json.dumps({"version": o3d.__version__}))
sys.stdout.flush()
os._exit(0)
"""
)


def ours(*words: str) -> str:
    """The program of a command of this package."""
    line = ["render", "FOLDER", "-o", "OUT", "--yaw", "15", "--light", "-0.5,-1,0", *words]
    text = ", ".join({"FOLDER": "sys.argv[1]", "OUT": "sys.argv[2]"}.get(word, repr(word)) for word in line)
    return COMMAND.format(words=text)


def write_sequence(folder: Path, count: int) -> None:
    """A ball that goes round before a wall, seen by a camera with a Kinect's noise (Nguyen, Izadi, Lovell 2012)."""
    rng = np.random.default_rng(37)
    x = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    y = ((np.arange(CAMERA.height) - CAMERA.cy) / CAMERA.fy)[:, None]
    rays = np.stack(np.broadcast_arrays(x, y, 1.0), -1)
    for name in ("color", "depth"):
        (folder / name).mkdir(parents=True)
    for k in range(count):
        turn = 2 * np.pi * k / count
        middle, radius = np.array([0.35 * np.cos(turn), 0.15 * np.sin(2 * turn), 1.6 + 0.2 * np.sin(turn)]), 0.4
        along, square = rays @ middle, (rays**2).sum(-1)
        inside = along**2 - square * (middle @ middle - radius**2)
        ball = (along - np.sqrt(np.maximum(inside, 0))) / square
        depth = np.where(inside > 0, ball, 2.4 + 0.2 * x)
        depth = depth + rng.normal(size=depth.shape) * (0.0012 + 0.0019 * (depth - 0.4) ** 2)
        stripes = 128 + 90 * np.sin(20 * rays[..., :2] + turn * (inside > 0)[..., None])
        color = np.concatenate([stripes, np.full((*depth.shape, 1), 150)], -1) + rng.normal(0, 3, (*depth.shape, 3))
        ps.save_image(folder / "color" / f"{k:04d}.png", np.clip(color, 0, 255).astype(np.uint8))
        ps.save_image(folder / "depth" / f"{k:04d}.png", np.rint(1000 * depth).astype(np.uint16))
    matrix = {name: getattr(CAMERA, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
    (folder / "intrinsics.json").write_text(str(matrix | {"depth_scale": 1000}).replace("'", '"'))


def film(python: str, program: str, folder: Path) -> Run | str:
    """Make a film in a process of its own, or say why it failed."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "film.mp4"
        done = measure([python, "-c", program, str(folder), str(out)])
        return done if isinstance(done, str) or out.is_file() else "failed: no film"


def main() -> int:
    """Print a table. Returns 1 if one of them failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--peers", nargs="+", default=[], help="Pythons with pyvista or open3d")
    parser.add_argument("--json", type=Path, help="a file for the results")
    asked = parser.parse_args()
    programs: dict[str, tuple[str, str]] = {
        OURS: (sys.executable, ours()),
        f"{OURS}, 1 sample": (sys.executable, ours("--samples", "1")),
    }
    for name, text in {"PyVista": PYVISTA, "Open3D": OPEN3D}.items():
        if (python := python_with(name.lower(), asked.peers)) is not None:
            programs[name] = (python, text)
        elif asked.peers:
            print(f"{name:26} is in none of {', '.join(asked.peers)}")
    runs: dict[str, list[Run | str]] = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "noisy"
        write_sequence(folder, asked.frames)
        for _ in range(asked.rounds):
            for name, program in programs.items():
                runs[name].append(film(*program, folder))
    rows, failed = [], 0
    print(f"{'':26}{'frames a second':>16}{'ms a frame':>12}{'CPU ms':>9}{'cores':>7}{'GB':>7}")
    for name, found in runs.items():
        one = middle(found)
        if isinstance(one, str):
            failed = 1
            print(f"{name:26} {one}")
            continue
        rate, wall, cpu = asked.frames / one.wall, 1e3 * one.wall / asked.frames, 1e3 * one.cpu / asked.frames
        print(f"{name:26}{rate:16.1f}{wall:12.1f}{cpu:9.1f}{cpu / wall:7.2f}{one.memory:7.2f}")
        rows.append({"program": name, "frames_a_second": rate, "ms": wall, "cpu_ms": cpu, "memory_gb": one.memory})
        rows[-1]["version"] = one.said.get("version", ps.__version__)
    write_results(asked.json, frames=asked.frames, rounds=asked.rounds, rows=rows)
    return failed


if __name__ == "__main__":
    sys.exit(main())
