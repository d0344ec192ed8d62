"""Runs in Blender: read_picture.py picture.exr arrays.npz.

It saves the picture's pixels as three parts of Blender see them: the picture itself, the compositor, and Cycles, in
which it is a texture that shines before an orthographic camera. Rows run from the top down.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

source, saved = sys.argv[-2:]


def opened(path):
    """A picture whose numbers are no colours."""
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    return image


def pixels(image):
    """(h, w, 4) float32."""
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[::-1]


def rendered(name):
    """The same of what the scene shows, as 32-bit floats."""
    path = Path(saved).with_name(name)
    render = bpy.context.scene.render
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return pixels(opened(path))


def empty_scene(width, height):
    """One sample a pixel, seen by a camera from above that sees a rectangle of width x height."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.cycles.filter_width = 0.01
    scene.render.resolution_x, scene.render.resolution_y = width, height
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", max(width, height)
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.location = (0, 0, 5)
    scene.collection.objects.link(scene.camera)
    return scene


def as_texture(width, height):
    """The picture on a plane that shines."""
    empty_scene(width, height)
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.scale = (width, height, 1)
    material = bpy.data.materials.new("picture")
    bpy.context.object.data.materials.append(material)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    texture, shine = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeEmission")
    texture.image, texture.interpolation = opened(source), "Closest"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(texture.outputs["Color"], shine.inputs["Color"])
    tree.links.new(shine.outputs[0], output.inputs[0])
    return rendered("texture.exr")


def composited(width, height):
    """The picture as the compositor hands it on."""
    scene = empty_scene(width, height)
    tree = scene.compositing_node_group = bpy.data.node_groups.new("picture", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    image = tree.nodes.new("CompositorNodeImage")
    image.image = opened(source)
    tree.links.new(image.outputs["Image"], tree.nodes.new("NodeGroupOutput").inputs[0])
    return rendered("composited.exr")


own = pixels(opened(source)).copy()
height, width = own.shape[:2]
np.savez(saved, own=own, composited=composited(width, height), texture=as_texture(width, height))
