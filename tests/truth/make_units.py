"""Renders a ball on a floor with Cycles, under one lamp of each kind in Blender's own units, for tests of ours.

Run it by a Python that has Blender's module (`pip install bpy`), from the repository's root:

    python -m tests.truth.make_units

It writes tests/truth/kept/units.npz: depth and normals as the camera sees them, and the light of each lamp.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import bpy
import numpy as np

from . import shapes
from .exr import read_layers
from .make_truth import (
    FLIP,
    add_camera,
    add_part,
    blender_matrix,
    looking_along,
    source_pose,
    stacked,
    start_scene,
)
from .scenes import Part, Setting

OUT = Path(__file__).parent / "kept" / "units.npz"
WIDTH, HEIGHT, FOV = 64, 48, 45
GREY = 231  # 8-bit sRGB
SAMPLES = 4096  # of the area
# As `ps.Light` takes them, in the camera's axes: Blender's strength of a sun is our lux.
LAMPS = {
    "sun": {"lux": 2.0, "direction": (0.5, 0.9, 0.4)},
    "point": {"watts": 60.0, "position": (-0.6, -0.9, 1.6)},
    "spot": {"watts": 90.0, "position": (0.7, -1.0, 1.4), "direction": (-0.6, 1.0, 0.7), "cone": (20.0, 32.0)},
    "area": {"watts": 20.0, "position": (-0.4, -0.7, 1.5), "direction": (0.3, 0.8, 0.5), "size": (0.9, 0.25)},
}


def main() -> None:
    setting = Setting([Part(shapes.disc(3.0), (GREY,) * 3), ball()], (0, 0, 0.2), 2.2, 0, 30, FOV)
    source = source_pose(setting)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "out.exr"
        start_scene(WIDTH, HEIGHT, path)
        for part in setting.parts:
            add_part(part)
        add_camera(FOV).matrix_world = blender_matrix(source @ FLIP)
        found = {}
        for name, lamp in LAMPS.items():
            bpy.context.scene.cycles.samples = SAMPLES if "size" in lamp else 1
            hang(lamp, source)
            bpy.ops.render.render(write_still=True)
            layers = {name.partition(".")[2]: values for name, values in read_layers(path).items()}
            found[name] = stacked(layers, "Combined", "RGB").mean(-1).astype(np.float16)
        hit = layers["Combined.A"] > 0.5
        found["depth"] = np.where(hit, layers["Depth.Z"], 0).astype(np.float32)
        found["normals"] = (stacked(layers, "Normal", "XYZ") @ source[:3, :3]).astype(np.float16)
    focal = WIDTH / 2 / np.tan(np.radians(FOV) / 2)
    camera = focal, focal, (WIDTH - 1) / 2, (HEIGHT - 1) / 2, WIDTH, HEIGHT
    np.savez_compressed(OUT, about=json.dumps({"camera": camera, "grey": GREY, "lamps": LAMPS}), **found)


def ball() -> Part:
    return Part(shapes.ball(0.35, (0, 0, 0.35)), (GREY,) * 3)


def hang(lamp: dict, source: np.ndarray) -> None:
    """The only lamp of the scene."""
    for old in [thing for thing in bpy.data.objects if thing.type == "LIGHT"]:
        bpy.data.objects.remove(old)
    kind = "SUN" if "lux" in lamp else "AREA" if "size" in lamp else "SPOT" if "cone" in lamp else "POINT"
    data = bpy.data.lights.new("lamp", kind)
    data.energy = lamp.get("lux", lamp.get("watts"))
    if kind == "SUN":
        data.angle = 0
    elif kind == "AREA":
        data.shape, (data.size, data.size_y) = "RECTANGLE", lamp["size"]
    else:
        data.shadow_soft_size = 0
    if kind == "SPOT":
        inner, outer = np.cos(np.radians(lamp["cone"]))
        data.spot_size, data.spot_blend = 2 * np.radians(lamp["cone"][1]), (inner - outer) / (1 - outer)
    pose = np.eye(4)
    pose[:3, 3] = lamp.get("position", (0, 0, 0))
    if "direction" in lamp:
        pose[:3, :3] = level(lamp["direction"]) if kind == "AREA" else looking_along(np.array(lamp["direction"]))
    thing = bpy.data.objects.new("lamp", data)
    thing.matrix_world = blender_matrix(source @ pose)
    bpy.context.collection.objects.link(thing)


def level(direction: tuple[float, float, float]) -> np.ndarray:
    """Axes (3, 3) whose -z is the direction and whose x, along the width, is at right angles to y; along y it is x."""
    z = -np.array(direction) / np.linalg.norm(direction)
    x = np.cross((0, 1, 0), z) if abs(z[1]) < 1 else np.array([1.0, 0, 0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)


if __name__ == "__main__":
    main()
