"""Renders the vase under the built-in sky on a white ground by Cycles (`pip install bpy`, Blender 5), beside `render`.

    python tests/truth/make_sky_vase.py assets/readme/sky_vase.png

Both show the triangles between the pixels of the frame, lit by the sky alone, without bounces. The ground is a white
plane where `ground=True` finds it.
"""

import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.estimation.ground import ground_under
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.objects import PointObject
from pointshade_gl.scene.values import linear_to_srgb, srgb_to_linear

TURN = {"yaw": 12, "pitch": -14, "dolly": -0.1}
OPTIONS = {"environment": "sky", "ground": True, "background": "white", "samples": 64}
FLIP = np.diag([1.0, -1, -1, 1])  # a camera of Blender looks along -z
TO_BLENDER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # from y up to z up
STEP = 0.02  # share of the depth by which neighbours are of one surface


def shell(frame):
    """The triangles between the pixels: corners (n, 3), faces (m, 3), linear colours (n, 3)."""
    depth, camera = frame.depth, frame.camera
    number = np.where(depth > 0, np.cumsum(depth > 0).reshape(depth.shape) - 1, -1)
    square = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], -1).reshape(-1, 4)
    far = np.stack([depth[:-1, :-1], depth[:-1, 1:], depth[1:, 1:], depth[1:, :-1]], -1).reshape(-1, 4)
    kept = (square >= 0).all(1) & (far.max(1) < (1 + STEP) * np.maximum(far.min(1), 1e-9))
    square = square[kept]
    faces = np.concatenate([square[:, [0, 2, 1]], square[:, [0, 3, 2]]])
    v, u = np.nonzero(depth > 0)
    colors = srgb_to_linear(frame.color[v, u, :3] / 255)
    return camera.unproject(depth[v, u], np.stack([u, v], -1)), faces, colors


def matt(colors=None):
    """A Lambert material, white or with the colours of corners."""
    material = bpy.data.materials.new("matt")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    if colors is not None:
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = "Color"
        scaled = nodes.new("ShaderNodeVectorMath")
        scaled.operation = "SCALE"
        scaled.inputs["Scale"].default_value = ps.Material().diffuse
        links.new(attribute.outputs["Color"], scaled.inputs[0])
        links.new(scaled.outputs[0], diffuse.inputs["Color"])
    links.new(diffuse.outputs[0], output.inputs[0])
    return material


def add(name, corners, faces, colors=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners.tolist(), [], faces.tolist())
    if colors is not None:
        layer = mesh.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
        layer.data.foreach_set("color", np.concatenate([colors, np.ones((len(colors), 1))], 1).astype("f4").ravel())
        mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.materials.append(matt(colors))
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


def under(picture):
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    image = bpy.data.images.new("sky", picture.shape[1], picture.shape[0], float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    texels = np.concatenate([picture, np.ones_like(picture[..., :1])], -1)
    image.pixels.foreach_set(np.ascontiguousarray(texels[::-1], np.float32).ravel())
    texture, background = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeBackground")
    texture.image = image
    links.new(texture.outputs[0], background.inputs[0])
    links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs[0])


def trace(camera, samples=256):
    """(h, w, 4) linear light and alpha."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.max_bounces, cycles.diffuse_bounces = samples, True, 0, 0
    scene.render.resolution_x, scene.render.resolution_y = camera.width, camera.height
    scene.render.film_transparent, scene.view_settings.view_transform = True, "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "a.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(camera.width * camera.height * 4, np.float32)
        image.pixels.foreach_get(pixels)
    return pixels.reshape(camera.height, camera.width, 4)[::-1]


def main(path):
    frame, sky = ps.load_frame("vase"), ps.Environment.of("sky")
    with ps.Renderer() as renderer:
        ours = renderer.render(frame, material=ps.Material(specular=0), **TURN, **OPTIONS)
        to_sky, up = np.array(renderer.surroundings.to_sky), renderer.surroundings.floor
    pose = ps.orbit_pose(frame.pose, frame.pivot, **TURN, upright=frame.upright)
    ground = ground_under(Scene((Node(PointObject(frame)),)), up)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    turn = TO_BLENDER @ to_sky
    corners, faces, colors = shell(frame)
    add("vase", corners @ turn.T, faces, colors)
    across = np.linalg.svd(ground[None, :3])[2][1:]
    square = -ground[:3] * ground[3] + 30 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ across
    add("ground", square @ turn.T, np.array([[0, 1, 2, 3]]))
    under(sky.picture)
    camera, lens = frame.camera, bpy.data.cameras.new("camera")
    lens.sensor_width, lens.lens = 36, 36 * camera.fx / camera.width
    lens.shift_x = ((camera.width - 1) / 2 - camera.cx) / camera.width
    lens.shift_y = (camera.cy - (camera.height - 1) / 2) / camera.width
    eye = bpy.data.objects.new("camera", lens)
    bpy.context.collection.objects.link(eye)
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = turn @ (pose @ FLIP)[:3, :3], turn @ pose[:3, 3]
    eye.matrix_world = placed.T.tolist()
    bpy.context.scene.camera = eye
    light = trace(camera)
    light = light[..., :3] + (1 - light[..., 3:])  # over white
    theirs = np.round(255 * linear_to_srgb(np.clip(light, 0, 1))).astype(np.uint8)
    Image.fromarray(np.concatenate([ours[..., :3], theirs], 1)).save(path)


if __name__ == "__main__":
    main(sys.argv[1])
