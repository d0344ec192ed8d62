"""Runs in Blender: read_layers.py passes.exr WIDTH HEIGHT arrays.npz.

It saves what the compositor hands on of each pass of a multilayer picture, by the pass's name and kind, such as
"ao VALUE". Single numbers are repeated in all colours. Rows run from the top down.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

source, width, height, saved = sys.argv[-4:]


def composited(tree, output, shown):
    """(h, w, 4) float32 of one output of the picture's node."""
    tree.links.clear()
    tree.links.new(output, tree.nodes["Group Output"].inputs[0])
    bpy.context.scene.render.filepath = str(shown)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(shown), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[::-1]


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(scene.camera)
tree = scene.compositing_node_group = bpy.data.node_groups.new("passes", "CompositorNodeTree")
tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
tree.nodes.new("NodeGroupOutput").name = "Group Output"
node = tree.nodes.new("CompositorNodeImage")
node.image = bpy.data.images.load(source)
outputs = [output for output in node.outputs if output.enabled]
shown = Path(saved).with_name("composited.exr")
np.savez(saved, **{f"{output.name} {output.type}": composited(tree, output, shown) for output in outputs})
