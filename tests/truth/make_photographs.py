"""Takes two photographs of painted things on a table, path-traced by Cycles: one camera, two lights.

Run it by a Python that has Blender's module (`pip install bpy`), from the repository's root:

    python -m tests.truth.make_photographs FOLDER

It writes FOLDER/a with colour, depth and camera, lit from the left, and FOLDER/b.png, the same lit from the right.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from PIL import Image

from . import shapes
from .exr import read_layers
from .lamps import Lamp
from .make_truth import FLIP, add_camera, blender_matrix, decoded, encoded, put_lamp, source_pose, stacked, start_scene
from .scenes import Setting
from .shapes import Shape

WIDTH, HEIGHT, FOV = 440, 480, 24  # degrees, horizontal
EYE = Setting([], (0.0, 0.0, 0.052), 0.92, -6, 25, FOV)
AMBIENT = 0.12  # light of the whole sky, over that of the sun
LIGHTS = {"a": (0.75, 0.6, 0.5), "b": (-0.8, 0.45, 0.35)}  # which way they travel, camera axes
SUN = 2.0  # its diameter in degrees
SAMPLES = 96


class Paint(NamedTuple):
    """A texture of Blender's, how fine it is, and sRGB colours from its lowest to its highest value."""

    texture: str
    scale: float
    colors: tuple[str, ...]
    settings: dict[str, object]
    hard: bool = False


def things() -> list[tuple[Shape, Paint]]:
    bands = Paint(
        "Wave", 9, ("e9dcc0", "b4512f", "e9dcc0", "2f4a63"), {"bands_direction": "Z", "Distortion": 1.5}, True
    )
    spots = Paint("Voronoi", 38, ("20408c", "e8e6de"), {"feature": "F1"}, True)
    marble = Paint("Noise", 14, ("2f6b4f", "c9d49a", "4d8a5b"), {"Detail": 6.0, "Distortion": 1.2})
    rind = Paint("Noise", 45, ("a8400e", "f0b050"), {"Detail": 4.0})
    speckles = Paint("Voronoi", 70, ("5f4636", "d9c7a4", "e4d6b8"), {"feature": "F1"}, True)
    rings = Paint("Wave", 16, ("a8324a", "ecd9cf"), {"bands_direction": "X", "Distortion": 2.0}, True)
    boards = Paint(
        "Wave", 12, ("a98763", "c9aa80", "bd9a70"), {"bands_direction": "X", "Distortion": 4.0, "Detail": 3.0}
    )
    return [
        (cove(), boards),
        (jar().moved((-0.08, 0.085, 0)), bands),
        (pumpkin(0.062).moved((0.085, 0.075, 0)), rind),
        (shapes.ball(0.042, (0.012, -0.045, 0.042)), spots),
        (egg(0.033, 0.095).moved((-0.11, -0.055, 0)), speckles),
        (bowl().moved((0.118, -0.065, 0)), marble),
        (shapes.ring(0.033, 0.011, (-0.045, -0.118, 0.011)), rings),
    ]


def cove() -> Shape:
    """A table that bends up into a wall behind the things."""
    turn = np.radians(np.linspace(0, 90, 33))
    y = np.concatenate([[-1.5], 0.3 + 0.2 * np.sin(turn), [0.5]])
    z = np.concatenate([[0], 0.2 - 0.2 * np.cos(turn), [1.2]])
    x = np.array([-1.5, 1.5])
    return shapes.grid(np.stack(np.broadcast_arrays(x[None], y[:, None], z[:, None]), -1))


def jar() -> Shape:
    z = np.linspace(0, 1, 161)
    body = 0.034 + 0.034 * np.sin(np.pi * np.clip(z, 0, 1) ** 0.8) ** 1.2 - 0.006 * z
    lid = [(0.024 * np.cos(a) + 0.006, 0.15 + 0.02 * np.sin(a)) for a in np.linspace(0, np.pi / 2, 24)]
    knob = [(0.011 * np.cos(a), 0.178 + 0.011 * np.sin(a)) for a in np.linspace(-0.9, np.pi / 2, 32)]
    return shapes.lathe([(0, 0), *zip(body, 0.15 * z, strict=True), *lid, *knob])


def pumpkin(radius: float) -> Shape:
    v, u = np.meshgrid(
        np.linspace(-np.pi / 2, np.pi / 2, 129), np.linspace(0, 2 * np.pi, 320, endpoint=False), indexing="ij"
    )
    out = radius * np.cos(v) ** 0.8 * (1 + 0.07 * np.abs(np.sin(5 * u)))
    return shapes.grid(np.stack([out * np.cos(u), out * np.sin(u), 0.78 * radius * (1 + np.sin(v))], -1), around=True)


def egg(radius: float, height: float) -> Shape:
    a = np.linspace(-np.pi / 2, np.pi / 2, 129)
    wide = radius * np.cos(a) * (1 - 0.16 * np.sin(a))
    return shapes.lathe(np.stack([wide, height / 2 * (1 + np.sin(a))], -1))


def bowl() -> Shape:
    a = np.linspace(0.25, np.pi / 2, 64)
    outside = [(0.055 * np.sin(t), 0.06 - 0.06 * np.cos(t)) for t in a]
    inside = [(0.051 * np.sin(t), 0.06 - 0.055 * np.cos(t)) for t in a[::-1]]
    return shapes.lathe([(0, outside[0][1]), *outside, *inside, (0, inside[-1][1])])


def add(shape: Shape, paint: Paint) -> None:
    mesh = bpy.data.meshes.new("thing")
    mesh.from_pydata(shape.vertices.tolist(), [], [list(dict.fromkeys(map(int, face))) for face in shape.faces])
    mesh.validate()
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=np.radians(40))
    mesh.materials.append(painted(paint))
    bpy.context.collection.objects.link(bpy.data.objects.new("thing", mesh))


def painted(paint: Paint) -> bpy.types.Material:
    """A matt material in these colours."""
    material = bpy.data.materials.new("paint")
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    nodes.clear()
    place, texture = nodes.new("ShaderNodeNewGeometry"), nodes.new(f"ShaderNodeTex{paint.texture}")
    ramp, diffuse = nodes.new("ShaderNodeValToRGB"), nodes.new("ShaderNodeBsdfDiffuse")
    texture.inputs["Scale"].default_value = paint.scale
    for name, value in paint.settings.items():
        if name in texture.inputs:
            texture.inputs[name].default_value = value
        else:
            setattr(texture, name, value)
    stops = ramp.color_ramp
    stops.interpolation = "CONSTANT" if paint.hard else "LINEAR"
    last = len(paint.colors) - (not paint.hard)
    while len(stops.elements) < len(paint.colors):
        stops.elements.new(1)
    for k, (stop, color) in enumerate(zip(stops.elements, paint.colors, strict=True)):
        stop.position, stop.color = k / last, (*decoded(np.array(list(bytes.fromhex(color)))), 1)
    link(place.outputs["Position"], texture.inputs["Vector"])
    value = "Distance" if paint.texture == "Voronoi" else "Fac"
    link(texture.outputs[value], ramp.inputs["Fac"])
    link(ramp.outputs["Color"], diffuse.inputs["Color"])
    link(diffuse.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def layers(path: Path) -> dict[str, np.ndarray]:
    return {name.partition(".")[2]: values for name, values in read_layers(path).items()}


def main() -> None:
    out = Path(sys.argv[1])
    exr = out / "light.exr"
    (out / "a").mkdir(parents=True, exist_ok=True)
    start_scene(WIDTH, HEIGHT, exr)
    scene, pose = bpy.context.scene, source_pose(EYE)
    scene.world = bpy.data.worlds.new("sky")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (AMBIENT, AMBIENT, AMBIENT, 1)
    for thing in things():
        add(*thing)
    add_camera(FOV).matrix_world = blender_matrix(pose @ FLIP)
    bpy.ops.render.render(write_still=True)  # depth by one ray through the middle of each pixel
    np.save(out / "a/depth.npy", layers(exr)["Depth.Z"])
    scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.diffuse_bounces = SAMPLES, 4, 4
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1
    scene.cycles.use_denoising, scene.cycles.denoiser = True, "OPENIMAGEDENOISE"
    for name, direction in LIGHTS.items():
        put_lamp(Lamp(name, 1.0, None, direction), pose)
        bpy.data.lights[-1].angle = np.radians(SUN)
        bpy.ops.render.render(write_still=True)
        light = stacked(layers(exr), "Combined", "RGB")
        picture = np.rint(encoded(light / np.percentile(light, 99.7))).astype(np.uint8)
        Image.fromarray(picture).save(out / ("a/color.png" if name == "a" else "b.png"))
    exr.unlink()
    focal = WIDTH / 2 / np.tan(np.radians(FOV) / 2)
    camera = {"fx": focal, "fy": focal, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "width": WIDTH, "height": HEIGHT}
    (out / "a/intrinsics.json").write_text(json.dumps(camera))


if __name__ == "__main__":
    main()
