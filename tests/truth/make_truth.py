"""Renders truth with Cycles: own scenes, Lambert surfaces, direct light of one lamp at a time, hard shadows.

Run it by a Python that has Blender's module (`pip install bpy`), from the repository's root:

    python -m tests.truth.make_truth OUT_DIR --seed 1 [--size 400x300] [--scenes table,stairs]

It writes OUT_DIR/<scene>.npz, which `tests.truth.files` reads. Everything is in the source camera's axes: x right, y
down, z forward. Pixels are sampled at their middles, by one ray.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

from .exr import read_layers
from .lamps import Lamp, lambert, lamps
from .scenes import SCENES, Part, Setting, setting

LIT = "0,10,25,40"  # degrees of the views in which every lamp is rendered
TURNED = (0, 2, 5, 10, 15, 25, 30, 40)  # of all views; the others only tell what is seen
FLIP = np.diag([1.0, -1, -1, 1])  # between our camera axes and Blender's


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", default="400x300")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--lit", default=LIT, help="degrees of the views in which every lamp is rendered")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    lit = set(map(int, given.lit.split(",")))
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.scenes.split(","):
        with tempfile.TemporaryDirectory() as folder:
            scene = Tracer(setting(name, given.seed), width, height, Path(folder) / "out.exr")
            truth = scene.truth(np.random.default_rng([given.seed, 99, list(SCENES).index(name)]), lit)
        np.savez_compressed(given.out / f"{name}.npz", **truth)
        print(f"{name}: {given.out / name}.npz", file=sys.stderr)


class Tracer:
    """One scene in Blender, and the camera that takes its frame."""

    def __init__(self, what: Setting, width: int, height: int, path: Path):
        self.width, self.height, self.path = width, height, path
        self.focal = width / 2 / np.tan(np.radians(what.fov) / 2)
        self.source, self.distance = source_pose(what), what.distance
        start_scene(width, height, path)
        for part in what.parts:
            add_part(part)
        self.camera = add_camera(what.fov)

    def truth(self, rng: np.random.Generator, lit: set[int]) -> dict[str, np.ndarray]:
        up, target = self.source[:3, :3].T @ (0, 0, 1), np.array([0, 0, self.distance])
        given = lamps(rng, up, target, self.distance)
        eye = Lamp("eye", 1.0, (0, 0, 0), None, self.distance)
        first = self.render(np.eye(4), eye)
        pivot = np.median(points_of(first["depth"], self.focal)[first["depth"] > 0], axis=0)
        found, poses = {}, {}
        for yaw in TURNED:
            pose = poses[yaw] = turned(pivot, yaw)
            seen = first if yaw == 0 else self.render(pose, eye)
            found |= {f"{name}_{yaw}": seen[name] for name in ("depth", "normals", "albedo")}
            found[f"visible_{yaw}"] = seen["light"].max(-1) > 0
            for lamp in given if yaw in lit else ():
                found[f"{lamp.name}_{yaw}"] = light = self.render(pose, lamp)["light"]
                check_lambert(f"{lamp.name} {yaw}", lamp, light, seen, pose, self.focal)
        about = {
            "camera": [self.focal, self.focal, (self.width - 1) / 2, (self.height - 1) / 2, self.width, self.height],
            "poses": {yaw: pose.tolist() for yaw, pose in poses.items()},
            "lamps": [vars(lamp) for lamp in given],
            "up": up.tolist(),
        }
        return found | {"about": np.array(json.dumps(about))}

    def render(self, pose: np.ndarray, lamp: Lamp) -> dict[str, np.ndarray]:
        """depth (h, w) float32, 0 = nothing; normals in the source's axes; albedo 8-bit sRGB; light linear, float16."""
        self.camera.matrix_world = blender_matrix(self.source @ pose @ FLIP)
        put_lamp(lamp, self.source)
        bpy.ops.render.render(write_still=True)
        layers = {name.partition(".")[2]: values for name, values in read_layers(self.path).items()}
        hit = layers["Combined.A"] > 0.5
        return {
            "depth": np.where(hit, layers["Depth.Z"], 0),
            "normals": (stacked(layers, "Normal", "XYZ") @ self.source[:3, :3]).astype(np.float16),
            "albedo": np.rint(encoded(stacked(layers, "Diffuse Color", "RGB"))).astype(np.uint8),
            "light": (stacked(layers, "Combined", "RGB") * hit[..., None]).astype(np.float16),
        }


def start_scene(width: int, height: int, path: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = None  # black
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
    scene.cycles.max_bounces, scene.cycles.light_sampling_threshold = 0, 0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.use_persistent_data, scene.render.film_transparent = True, True
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.filepath = str(path)
    settings = scene.render.image_settings
    settings.media_type, settings.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
    settings.color_depth, settings.exr_codec, settings.use_exr_interleave = "32", "NONE", True
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_diffuse_color = True


def add_part(part: Part) -> None:
    mesh = bpy.data.meshes.new("part")
    faces = [list(dict.fromkeys(map(int, face))) for face in part.shape.faces]
    mesh.from_pydata(part.shape.vertices.tolist(), [], faces)
    mesh.validate()
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=np.radians(30))
    material = bpy.data.materials.new("matte")
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*decoded(np.array(part.color)), 1)
    material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    mesh.materials.append(material)
    bpy.context.collection.objects.link(bpy.data.objects.new("part", mesh))


def add_camera(fov: float) -> bpy.types.Object:
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle, data.clip_start = "HORIZONTAL", np.radians(fov), 0.001
    camera = bpy.data.objects.new("camera", data)
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    return camera


def put_lamp(lamp: Lamp, source: np.ndarray) -> None:
    """The only lamp of the scene."""
    for old in [thing for thing in bpy.data.objects if thing.type == "LIGHT"]:
        bpy.data.objects.remove(old)
    data = bpy.data.lights.new(lamp.name, lamp.kind)
    data.energy = lamp.energy
    if lamp.kind == "SUN":
        data.angle = 0
    else:
        data.shadow_soft_size = 0
    if lamp.kind == "SPOT":
        data.spot_size, data.spot_blend = 2 * np.radians(lamp.cone[1]), lamp.spot_blend
    thing = bpy.data.objects.new(lamp.name, data)
    matrix = np.eye(4)
    if lamp.direction is not None:
        matrix[:3, :3] = looking_along(source[:3, :3] @ lamp.direction)
    if lamp.position is not None:
        matrix[:3, 3] = (source @ [*lamp.position, 1])[:3]
    thing.matrix_world = blender_matrix(matrix)
    bpy.context.collection.objects.link(thing)


def blender_matrix(matrix: np.ndarray):
    from mathutils import Matrix

    return Matrix(matrix.tolist())


def looking_along(direction: np.ndarray) -> np.ndarray:
    """Axes (3, 3) whose -z is the direction, as Blender's lamps have them."""
    z = -direction / np.linalg.norm(direction)
    x = np.cross((0, 1, 0) if abs(z[2]) > 0.9 else (0, 0, 1), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)


def source_pose(what: Setting) -> np.ndarray:
    """Camera-to-world of the frame: x right, y down, z forward, in a world with z up."""
    a, b = np.radians([what.around, what.above])
    away = np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
    x = np.cross(-away, (0, 0, 1))
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(-away, x), -away], -1)
    pose[:3, 3] = what.target + what.distance * away
    return pose


def turned(pivot: np.ndarray, yaw: float) -> np.ndarray:
    """Camera-to-world of the source camera after it moved to its right, round the pivot."""
    a = np.radians(yaw)
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]]
    pose[:3, 3] = pivot - pose[:3, :3] @ pivot
    return pose


def points_of(depth: np.ndarray, focal: float, pose: np.ndarray | None = None) -> np.ndarray:
    """(h, w, 3) in the source's axes of a view's depth."""
    height, width = depth.shape
    v, u = np.mgrid[:height, :width]
    points = np.stack([(u - (width - 1) / 2) / focal, (v - (height - 1) / 2) / focal, np.ones(depth.shape)], -1)
    points = points * depth[..., None]
    return points if pose is None else points @ pose[:3, :3].T + pose[:3, 3]


def check_lambert(name: str, lamp: Lamp, light: np.ndarray, seen: dict[str, np.ndarray], pose, focal: float) -> None:
    """What is lit at all has the light of the formula, to 1 %: otherwise lamps, units or normals are wrong."""
    points = points_of(seen["depth"], focal, pose)
    formula = lambert(lamp, points, seen["normals"].astype(float))[..., None] * decoded(seen["albedo"])
    lit = (light.max(-1) > 0) & (formula.max(-1) > 0.02)
    error = np.abs(light / np.maximum(formula, 1e-9) - 1).max(-1)[lit]
    wrong = (error > 0.01).mean()
    print(f"  {name}: lit {lit.mean():.3f} of the picture, {100 * wrong:.3f} % of it not Lambert", file=sys.stderr)
    if wrong > 0.002:
        raise ValueError(
            f"{name}: {100 * wrong:.2f} % of the lit pixels differ from Lambert's formula by more than 1 %"
        )


def stacked(layers: dict[str, np.ndarray], name: str, axes: str) -> np.ndarray:
    return np.stack([layers[f"{name}.{axis}"] for axis in axes], -1)


def encoded(linear: np.ndarray) -> np.ndarray:
    """Linear to sRGB, 0..255."""
    linear = np.clip(linear, 0, 1)
    return 255 * np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def decoded(color: np.ndarray) -> np.ndarray:
    """8-bit sRGB to linear."""
    x = color / 255
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


if __name__ == "__main__":
    main()
