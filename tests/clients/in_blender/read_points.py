"""Runs in Blender: read_points.py cloud.ply forward up out.ply arrays.npz.

It imports a cloud with those axes, saves where its points lie, and exports it again to out.ply.
"""

import sys

import bpy
import numpy as np

source, forward, up, exported, saved = sys.argv[-5:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.ply_import(filepath=source, forward_axis=forward, up_axis=up)
mesh, world = bpy.context.object.data, np.array(bpy.context.object.matrix_world)


def vectors(attribute, key="vector", size=3):
    """(n, size) float32 of an attribute of the points."""
    values = np.empty(len(attribute.data) * size, np.float32)
    attribute.data.foreach_get(key, values)
    return values.reshape(-1, size)


np.savez(
    saved,
    positions=vectors(mesh.attributes["position"]) @ world[:3, :3].T + world[:3, 3],
    normals=vectors(mesh.attributes["normal"]) @ world[:3, :3].T,
    colors=vectors(mesh.attributes["Col"], "color_srgb", 4)[:, :3] * 255,
)
bpy.ops.wm.ply_export(filepath=exported, forward_axis=forward, up_axis=up, export_colors="SRGB", export_normals=True)
