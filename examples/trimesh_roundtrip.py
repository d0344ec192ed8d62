"""trimesh and back.

Lit points of a frame in trimesh's files, and a mesh of trimesh's beside them under one light.

Install::

    pip install pointshade-gl trimesh scipy

`python trimesh_roundtrip.py [FOLDER]` writes trimesh_roundtrip.glb and .png, and compares the points of both.
"""

import sys

import numpy as np
import trimesh

import pointshade_gl as ps

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # frames: x right, y down, z forward; glTF and trimesh's viewer: y up, z back

# pointshade to trimesh: points with their light, turned upright
frame = ps.load_frame(*sys.argv[1:2] or ["vase"]).at(np.eye(4))  # the world begins at its camera
light = ps.Light(position=frame.pivot + frame.pivot[2] * np.array([-0.5, -0.7, -0.8]))
lit = ps.render_points(frame, light)
cloud = trimesh.PointCloud(lit.positions, colors=lit.colors)
cloud.apply_transform(FLIP)
cloud.export("trimesh_roundtrip.glb")

# trimesh to pointshade: what was written, turned back, and a mesh of trimesh's own around it
(read,) = trimesh.load_scene("trimesh_roundtrip.glb").geometry.values()
back = trimesh.transform_points(read.vertices, FLIP)
print(f"{len(back)} points written and read, at most {np.abs(back - lit.positions).max():.1g} m apart")

height = np.ptp(frame.corners[:, 1])
ring = trimesh.creation.torus(0.42 * height, 0.02 * height, major_sections=96)
ring.apply_transform(trimesh.transformations.rotation_matrix(np.radians(75), (1, 0, 0)))
ring.apply_translation(FLIP[:3, :3] @ (frame.pivot + np.array([0, 0.17 * height, 0])))
mesh = ps.Mesh(ring.vertices, ring.faces, ring.vertex_normals, color=(0.8, 0.5, 0.2))
points = ps.PointCloud(back, lit.normals, np.array(read.colors)[:, :3], shading="none")  # they are lit already
seen = frame.camera.resized(480, round(480 * frame.camera.height / frame.camera.width))
scene = ps.Scene((ps.Node(points, "points"), ps.Node(mesh, "ring", FLIP), ps.Node(light, "light")), seen)
ps.save_image("trimesh_roundtrip.png", ps.render(scene, background="white", samples=16), small=True)
