"""Runs in Blender: opens scenes as the example does, says what Blender made of them, and renders them.

Arguments: a file of jobs (JSON), each with "scene", with "picture", "size" and "samples" where it is to be rendered,
and with "exported" where Blender is to write it again; and a file for the answers. Pictures are (h, w, 4) linear
float32, .npy.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
import numpy as np

EXAMPLE = runpy.run_path(str(Path(__file__).parents[3] / "examples" / "blender_cycles.py"), run_name="example")


def lamp(thing):
    data = thing.data
    said = {"type": data.type, "energy": data.energy, "color": list(data.color)}
    said |= {"at": list(thing.matrix_world.translation), "ahead": list(-thing.matrix_world.col[2].to_3d())}
    return said | ({"size": data.spot_size, "blend": data.spot_blend} if data.type == "SPOT" else {})


def mesh(thing):
    data = thing.data
    positions = np.empty((len(data.vertices), 3), np.float32)
    data.vertices.foreach_get("co", positions.ravel())
    world = np.array(thing.matrix_world)
    positions = positions @ world[:3, :3].T + world[:3, 3]
    said = {"positions": positions.tolist(), "triangles": len(data.polygons)}
    for attribute in data.color_attributes:
        colors = np.empty((len(attribute.data), 4), np.float32)
        attribute.data.foreach_get("color", colors.ravel())
        said["colors"] = colors.tolist()
    return said


def picture_of(job, folder):
    file = folder / "picture.exr"
    EXAMPLE["render"](file, *job["size"], job["samples"], bounces=0)
    image = bpy.data.images.load(str(file))
    pixels = np.empty((job["size"][1], job["size"][0], 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels[::-1]


def answer(job, folder):
    EXAMPLE["open_scene"](job["scene"])
    things = bpy.context.scene.objects
    said = {"lamps": {thing.name: lamp(thing) for thing in things if thing.type == "LIGHT"}}
    said["meshes"] = {thing.name: mesh(thing) for thing in things if thing.type == "MESH"}
    if "picture" in job:
        np.save(job["picture"], picture_of(job, folder))
    if "exported" in job:
        bpy.ops.export_scene.gltf(
            filepath=job["exported"],
            export_format="GLTF_SEPARATE",
            export_extras=True,
            export_lights=True,
            export_cameras=True,
        )
    return said


jobs, answers = map(Path, sys.argv[1:])
found = [answer(job, answers.parent) for job in json.loads(jobs.read_text())]
answers.write_text(json.dumps(found))
