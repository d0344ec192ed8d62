"""What each program does with a point cloud: Python texts that clouds_beside_others.py runs, each in a process."""

from __future__ import annotations

from peers import OURS

START = """
import json, os, sys, time
path, out, begun = sys.argv[1], sys.argv[2], float(sys.argv[3])
os.environ.setdefault("EGL_PLATFORM", "surfaceless")
import numpy as np

def eye(k):  # where view k is seen from: round the z axis
    turn = np.radians(15 * k)
    return 3.2 * np.array([np.sin(turn), -np.cos(turn), 0.6]) / np.hypot(1, 0.6)

def pose(k):  # camera to world: x right, y down, z forward
    forward = -eye(k) / np.linalg.norm(eye(k))
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(forward, right), forward, eye(k)], 1)
    return matrix

def keep(normals):
    if out.endswith(".npy"):
        np.save(out, normals)

def pictures(draw, save):
    save(draw(0))
    used, wall = time.process_time(), time.time() - begun
    peak = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM:"))
    laps = []
    for k in range(1, 6):
        start = time.perf_counter(), time.process_time()
        draw(k)
        laps.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    view, cpu = np.median(laps, 0)
    said.update(wall=wall, cpu=used, memory=peak / 2**20, view=view, view_cpu=cpu)
"""
END = """
print(json.dumps(said))
sys.stdout.flush()
os._exit(0)
"""
OUR_PICTURES = """
cloud, renderer, camera = ps.load_cloud(path, up="z"), ps.Renderer(), ps.Camera.from_fov(45, 640, 480)
pictures(lambda k: renderer.render(cloud, camera=camera, pose=pose(k), {look}), lambda one: ps.save_image(out, one))
"""
PROGRAMS = {  # each with the module it needs, and what it does for each job
    OURS: (
        "pointshade_gl",
        "import pointshade_gl as ps\nsaid = {'version': ps.__version__}\n",
        {
            "read": "ps.load_cloud(path)",
            "normals": "keep(ps.estimate_normals(ps.load_cloud(path)))",
            "picture": OUR_PICTURES.format(look="shading='none'"),
            "lit": OUR_PICTURES.format(look="light=ps.Light(shadow=True)"),
        },
    ),
    "Open3D": (
        "open3d",
        "import open3d as o3d\nsaid = {'version': o3d.__version__}\n",
        {
            "read": "o3d.io.read_point_cloud(path)",
            "normals": (
                "cloud = o3d.io.read_point_cloud(path)\n"
                "cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30)); keep(np.asarray(cloud.normals))"
            ),
            "picture": """
from open3d.visualization import rendering
from PIL import Image
cloud = o3d.io.read_point_cloud(path)
renderer, material = rendering.OffscreenRenderer(640, 480), rendering.MaterialRecord()
renderer.scene.set_background([1, 1, 1, 1])
renderer.scene.view.set_post_processing(False)
material.shader, material.point_size = "defaultUnlit", 2.0
renderer.scene.add_geometry("cloud", cloud, material)

def draw(k):
    renderer.setup_camera(45.0, *(np.float32(one) for one in ((0, 0, 0), eye(k), (0, 0, 1))), 0.05, 20.0)
    return np.asarray(renderer.render_to_image())

pictures(draw, lambda one: Image.fromarray(one).save(out))
""",
        },
    ),
    "PyVista": (
        "pyvista",
        "import pyvista as pv, vtk\nsaid = {'version': f'{pv.__version__} (VTK {vtk.vtkVersion.GetVTKVersion()})'}\n"
        "vtk.vtkSMPTools.SetBackend('STDThread')\n",
        {
            "read": "pv.read(path)",
            "normals": (
                "planes = vtk.vtkPCANormalEstimation()\n"
                "planes.SetInputData(pv.read(path)); planes.SetSampleSize(30); planes.SetNormalOrientationToPoint()\n"
                "planes.Update(); keep(np.asarray(pv.wrap(planes.GetOutput()).point_data['PCANormals']))"
            ),
            "picture": """
plotter = pv.Plotter(off_screen=True, window_size=(640, 480))
plotter.add_points(pv.read(path), scalars="RGB", rgb=True, point_size=2.0)
plotter.show(auto_close=False, interactive=False)

def draw(k):
    camera = plotter.camera
    camera.position, camera.focal_point, camera.up, camera.view_angle = tuple(eye(k)), (0, 0, 0), (0, 0, 1), 45.0
    plotter.render()
    return plotter.screenshot(None, return_img=True)

from PIL import Image
pictures(draw, lambda one: Image.fromarray(one).save(out))
""",
        },
    ),
}
