"""A user's script, as pyright and mypy see it: right calls pass, wrong names and wrong words are errors."""

import json
import os
import re
import subprocess
import sys

import pytest

from .support.places import ROOT

pytestmark = pytest.mark.system

RIGHT = """
import numpy as np

import pointshade_gl as ps
from pointshade_gl.viewer import Viewer

frame = ps.load_frame("vase")
camera = ps.Camera(500.0, 500.0, 320.0, 240.0, 640, 480)
points = camera.unproject(np.ones((480, 640), np.float32))
seen = camera.project(points)
light = ps.Light(position=[0, 0, 1], shadow=True)
mesh = ps.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
scene = ps.Scene((ps.Node(ps.PointObject(frame), "vase"), ps.Node(mesh, "floor")), camera)
image = ps.render(frame, light, shading="flat", samples=4, background="white", yaw=10.0)
ps.save_image("out.png", image)
ps.save_depth("out.exr", ps.render_depth(frame))
ps.save_normals("normals.png", ps.estimate_normals(frame, "star"))
ps.save_points("out.ply", ps.render_points(frame))
ps.save_page("out.html", scene)
ps.save_scene("out.glb", scene)
ps.show(frame)
with ps.Renderer(rasterizer="points") as renderer:
    picture = renderer.render(scene, [light])
    print(renderer.explain(), picture.shape)
source = ps.open_source("folder")
for one in ps.prefetched([source] if isinstance(source, ps.Frame) else source, print):
    print(one)
for pictures in ps.batch.map("folder", ps.Look(shading="phong"), ps.View(picture_size=(640, 480))):
    print(pictures)
Viewer(frame, window_size=(640, 480)).run()
lit = ps.render(frame, light, flying="snap", point_size=2, normals="adaptive", ground=True)
placed = ps.PointObject(frame, splat="round", normals=np.zeros((2, 2, 3)))
depth = ps.render_depth(frame, None, np.eye(4), "star", upsample="none")
look = ps.Look(shading="gouraud", noise="kinect", point_size="fill")
view = ps.View([light], picture_size="half", look=look, finish=ps.Finish(16, "white", (0, -1, 0)))
film, turned = ps.Film("film.mp4", 25.0), ps.orbit_pose(frame.pose, frame.pivot, 10.0, 0.0, 0.0)
with ps.RendererPool(2, rasterizer="points") as pool:
    print(pool.render(frame, light, yaw=10.0).shape, pool.submit(scene, samples=2).result().shape)
ps.use_device(0)
ps.release()
moved = ps.sources.open_source("folder"), ps.gltf.load_scene("demo"), ps.live_set([[frame], [frame]])
"""
WRONG = (
    "ps.rendr(frame)",
    'ps.render(frame, shading="toon")',
    'ps.render(frame, flyng="snap")',
    "ps.render_depth(frame, samples=2)",
    'ps.estimate_normals(frame, "magic")',
    'ps.Look(normals="magic")',
    'ps.PointObject(frame, splat="star")',
    'ps.Renderer(rasterizer="pionts")',
    'pool.submit(frame, shading="toon")',
    'ps.View(picture_size="quarter")',
    'ps.Mesh("positions", "faces")',
    "camera.unprojekt(depth)",
)


def lines_with_errors(checker, folder):
    """The numbers of the lines, from 1, in which a checker finds errors; and all that it says."""
    if checker == "mypy":
        line = [sys.executable, "-m", "mypy", "--cache-dir", os.devnull, "--no-error-summary", "script.py"]
        said = subprocess.run(
            line, capture_output=True, text=True, timeout=250, cwd=folder, env={**os.environ, "MYPYPATH": str(ROOT)}
        ).stdout
        return {int(number) for number in re.findall(r"^script\.py:(\d+): error", said, re.M)}, said
    (folder / "pyrightconfig.json").write_text(json.dumps({"extraPaths": [str(ROOT)]}))
    line = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(folder)]
    said = subprocess.run(line, capture_output=True, text=True, timeout=250, cwd=folder).stdout
    return {one["range"]["start"]["line"] + 1 for one in json.loads(said)["generalDiagnostics"]}, said


@pytest.mark.parametrize("checker", ["pyright", "mypy"])
def test_right_calls_pass_and_each_wrong_one_is_an_error(checker, tmp_path):
    (tmp_path / "script.py").write_text(RIGHT + "\n".join(WRONG) + "\n")
    first = len(RIGHT.splitlines()) + 1
    found, said = lines_with_errors(checker, tmp_path)
    assert found == set(range(first, first + len(WRONG))), said
