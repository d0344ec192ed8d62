"""Blender and Cycles.

A frame and a lamp, drawn here (left) and, from the .glb that was saved, path-traced by Cycles (right).

Install::

    pip install pointshade-gl bpy==5.0.1

With Python 3.11, `python blender_cycles.py [OUTPUT.png]` puts our picture on the left, that of Cycles on the right.
Inside Blender, without pointshade-gl, `blender -b -P blender_cycles.py -- OUTPUT.png SCENE.glb` renders a scene that
was saved before. `open_scene` is the part to copy: the importer gives positions, colours and lamps as they are meant;
ambient light and the size of lamps do not exist in glTF, and are read from what our files say beside it.
"""

import math
import sys
import tempfile
from pathlib import Path

import bpy

SAMPLES, WIDTH = 64, 320


def open_scene(path):
    """Replace Blender's scene by that of a .glb or .gltf file, with our ambient light and the size of lamps."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path), import_scene_extras=True)
    scene = bpy.context.scene
    for lamp in bpy.data.lights:
        said = lamp.get("pointshade", {})
        lamp.use_shadow = bool(said.get("shadow", True))
        if lamp.type == "SUN":
            lamp.angle = said.get("angle", 0) * math.pi / 180
        else:
            lamp.shadow_soft_size = said.get("radius", 0)
    material = next((m["pointshade"] for m in bpy.data.materials if "pointshade" in m), {})
    ambient, diffuse = material.get("ambient", 0.1), material.get("diffuse", 0.9)
    scene.world = bpy.data.worlds.new("ambient")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*scene.get("pointshade", {}).get("ambient", (1, 1, 1)), 1)
    background.inputs["Strength"].default_value = ambient / diffuse
    scene.view_settings.view_transform = "Standard"  # sRGB, as here
    scene.view_settings.exposure = math.log2(diffuse)  # colours come without the strength of their diffuse light
    scene.render.film_transparent = True
    scene.camera = next((thing for thing in scene.objects if thing.type == "CAMERA"), None)


def render(path, width, height, samples, bounces=4):
    """Render with Cycles on the processor, to a .png or, linear, an .exr."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = samples, False, bounces
    scene.render.resolution_x, scene.render.resolution_y = width, height
    settings = scene.render.image_settings
    settings.file_format = "OPEN_EXR" if Path(path).suffix == ".exr" else "PNG"
    settings.color_mode = "RGBA"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def example_scene():
    """Return the built-in vase and a lamp beside it, without falloff."""
    import pointshade_gl as ps

    vase = ps.load_frame("vase")
    lamp = ps.Light(position=(0.8, -0.6, 0.3), color=(1, 0.9, 0.8), shadow=True, radius=0.03)
    nodes = ps.Node(ps.PointObject(vase), "vase"), ps.Node(lamp, "lamp")
    return ps.Scene(nodes, camera=vase.camera.resized(WIDTH, WIDTH * 3 // 4))


def main(output, saved=None):
    """Write the picture; of a scene that was saved before, only Cycles' half of it."""
    if saved is not None:
        open_scene(saved)
        render(Path(output).resolve(), WIDTH, WIDTH * 3 // 4, SAMPLES)
        return
    import numpy as np
    from PIL import Image

    import pointshade_gl as ps

    scene = example_scene()
    with tempfile.TemporaryDirectory() as folder:
        ps.save_scene(f"{folder}/scene.glb", scene)
        open_scene(f"{folder}/scene.glb")
        render(f"{folder}/cycles.png", WIDTH, WIDTH * 3 // 4, SAMPLES)
        halves = [Image.fromarray(ps.render(scene, samples=16)), Image.open(f"{folder}/cycles.png")]
        grey = [Image.new("RGBA", half.size, (40, 40, 40, 255)) for half in halves]
        pair = [np.asarray(Image.alpha_composite(*two).convert("RGB")) for two in zip(grey, halves, strict=True)]
    ps.save_image(output, np.concatenate(pair, axis=1))


if __name__ == "__main__":
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    main(*given or ["blender_cycles.png"])
