"""The same frames here, and as points by VTK without PyVista: python tests/benchmarks/vtk_points.py [640x480 ...]"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from speed_jobs import ball_and_wall
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints, vtkUnsignedCharArray, vtkVersion
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkPolyDataMapper, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkEGLRenderWindow

import pointshade_gl as ps
from pointshade_gl.bench.measure import clocked

SIZES = ((640, 480), (1920, 1080), (3840, 2160))
TIMES = 5
PIVOT = (0.0, 0.0, 2.0)
Jobs = dict[str, Callable[[int], Any]]  # a new frame, view and light: the picture of round k


def ours(color: np.ndarray, depth: np.ndarray, camera: ps.Camera) -> Jobs:
    """With the footprint splats of a Renderer."""
    renderer, frame = ps.Renderer(), ps.Frame(color, depth, camera)

    def draw(frame: ps.Frame, yaw: float, x: float) -> np.ndarray:
        pose = ps.orbit_pose(None, PIVOT, yaw)
        return renderer.render(frame, ps.Light(position=(x, -1, 0)), pose=pose, normals="star")

    return {
        "new frame": lambda _: draw(ps.Frame(color, depth, camera), 15, 0),
        "new view": lambda k: draw(frame, 15 + k, 0),
        "new light": lambda k: draw(frame, 15, k),
    }


class PointsOfVtk:
    """Points of two pixels under Phong's light; normals are cross products of steps between neighbours, by NumPy."""

    def __init__(self, color: np.ndarray, depth: np.ndarray, camera: ps.Camera):
        self._color, self._depth, self._camera = color, depth, camera
        self._window, self._renderer = vtkEGLRenderWindow(), vtkRenderer()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(camera.width, camera.height)
        self._window.AddRenderer(self._renderer)
        self._renderer.AutomaticLightCreationOff()
        self._light, self._mapper, actor = vtkLight(), vtkPolyDataMapper(), vtkActor()
        self._light.SetLightTypeToSceneLight()
        self._light.PositionalOn()
        self._renderer.AddLight(self._light)
        self._mapper.SetColorModeToDirectScalars()
        self._mapper.StaticOn()
        actor.SetMapper(self._mapper)
        look = actor.GetProperty()
        look.SetPointSize(2)
        look.SetInterpolationToPhong()
        look.SetAmbient(0.1)
        look.SetDiffuse(0.9)
        look.SetSpecular(0.3)
        look.SetSpecularPower(32)
        self._renderer.AddActor(actor)
        self._kept: tuple[Any, ...] = ()  # VTK reads these arrays where they are

    def jobs(self) -> Jobs:
        self._take()
        return {
            "new frame": lambda _: (self._take(), self._draw(15, 0))[1],
            "new view": lambda k: self._draw(15 + k, 0),
            "new light": lambda k: self._draw(15, k),
        }

    def _take(self) -> None:
        points = self._camera.unproject(self._depth).astype(np.float32)
        down, across = np.gradient(points, axis=(0, 1))
        normals = np.cross(down, across)
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
        known = (self._depth > 0).ravel()
        points, normals, colors = (
            np.ascontiguousarray(one.reshape(-1, 3)[known]) for one in (points, normals, self._color)
        )
        numbers = np.arange(len(points) + 1, dtype=np.int64)
        data, places, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
        places.SetData(numpy_to_vtk(points))
        cells.SetData(numpy_to_vtkIdTypeArray(numbers), numpy_to_vtkIdTypeArray(numbers[:-1]))
        data.SetPoints(places)
        data.SetVerts(cells)
        data.GetPointData().SetScalars(numpy_to_vtk(colors))
        data.GetPointData().SetNormals(numpy_to_vtk(normals))
        self._mapper.SetInputData(data)
        self._kept = points, normals, colors, numbers

    def _draw(self, yaw: float, x: float) -> np.ndarray:
        camera, pose = self._renderer.GetActiveCamera(), ps.orbit_pose(None, PIVOT, yaw)
        camera.SetPosition(*pose[:3, 3])
        camera.SetFocalPoint(*(pose[:3, 3] + pose[:3, 2]))
        camera.SetViewUp(*-pose[:3, 1])
        camera.SetViewAngle(float(np.degrees(2 * np.arctan(self._camera.height / 2 / self._camera.fy))))
        camera.SetClippingRange(0.05, 10)
        self._light.SetPosition(x, -1, 0)
        self._light.SetFocalPoint(*PIVOT)
        self._window.Render()
        picture = vtkUnsignedCharArray()
        self._window.GetPixelData(0, 0, *(side - 1 for side in self._window.GetSize()), 1, picture, 0)
        return vtk_to_numpy(picture).reshape(self._camera.height, self._camera.width, -1)


def measure(jobs: Jobs) -> list[float]:
    """The median milliseconds of each job. Raises SystemExit where it draws nothing, or always the same."""
    found = []
    for name, job in jobs.items():
        laps, pictures = [], []
        for k in range(TIMES + 2):
            picture, ms = clocked(partial(job, k))
            laps.append(ms)
            pictures.append(picture)
        is_other = (pictures[0] != pictures[-1]).any()
        if not pictures[0].any() or is_other == (name == "new frame"):
            raise SystemExit(f"{name}: the picture is empty, or it {'changes' if is_other else 'stays the same'}")
        found.append(median(laps[2:]))
    return found


def main(sizes: list[str]) -> None:
    print(f"{'milliseconds':22}{'new frame':>11}{'new view':>10}{'new light':>11}")
    with ps.Renderer() as renderer:
        most = 1 if renderer.context.is_software else len(SIZES)
    vtk = f"VTK {vtkVersion.GetVTKVersion()}"
    for name, jobs_of in (("here", ours), (vtk, lambda *scene: PointsOfVtk(*scene).jobs())):  # VTK ends EGL for all
        for width, height in [tuple(map(int, size.split("x"))) for size in sizes] or SIZES[:most]:
            frame, view, light = measure(jobs_of(*ball_and_wall(width, height)))
            print(f"{f'{width}x{height}':11}{name:11}{frame:11.2f}{view:10.2f}{light:11.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
