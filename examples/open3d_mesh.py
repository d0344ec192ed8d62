"""Open3D's mesh, our albedo.

Views with poses become one mesh by Open3D's TSDF, in colours out of which the light of the photographs is taken. Left
to right: one photograph, turned aside; the views under a new light; and the mesh from its file under the same light.

Install::

    pip install pointshade-gl open3d

It writes open3d_mesh.glb, y up, and open3d_mesh.png. The picture of an albedo network may take the place of
`estimate_albedo`'s: it is a frame's colours.
"""

import dataclasses

import numpy as np
import open3d as o3d
import open3d.core as o3c

import pointshade_gl as ps

UPRIGHT = np.diag([1.0, -1.0, -1.0, 1.0])  # a .glb has y up, the world of the poses y down


def photographs(view):
    """Two of one view, with a lamp at either side of the camera. They are made of the built-in set here."""
    matt = ps.Material(ambient=0.3, diffuse=0.7, specular=0)
    for aside in (0.7, -0.7):
        lamp = ps.Light(direction=view.pose[:3, :3] @ (aside, 0.5, 0.8), shadow=True)
        yield ps.Frame(ps.render(view, lamp, matt, background="black")[..., :3], view.depth, view.camera, view.pose)


taken = [list(photographs(view)) for view in ps.open_source("vase/whole")]
views = [ps.Frame(ps.estimate_albedo(both), both[0].depth, both[0].camera, both[0].pose) for both in taken]

# all views into one signed distance, 2.5 mm a voxel, known as far as 5 voxels from a surface
parts = {"tsdf": (1,), "weight": (1,), "color": (3,)}
grid = o3d.t.geometry.VoxelBlockGrid(tuple(parts), (o3c.float32,) * 3, tuple(parts.values()), 0.0025, 16, 50_000)
for view in views:
    camera = view.camera
    matrix = o3c.Tensor(np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]))
    seen_from = o3c.Tensor(np.linalg.inv(view.pose))
    depth = o3d.t.geometry.Image(o3c.Tensor(np.array(view.depth)))
    color = o3d.t.geometry.Image(o3c.Tensor(view.color[..., :3] / np.float32(255)))
    blocks = grid.compute_unique_block_coordinates(depth, matrix, seen_from, 1.0, 10.0, 5.0)
    grid.integrate(blocks, depth, color, matrix, seen_from, 1.0, 10.0, 5.0)
mesh = grid.extract_triangle_mesh(weight_threshold=0.5).to_legacy().transform(UPRIGHT)
colors = np.asarray(mesh.vertex_colors)
linear = np.where(colors > 0.04045, ((colors + 0.055) / 1.055) ** 2.4, colors / 12.92)
mesh.vertex_colors = o3d.utility.Vector3dVector(linear)  # as a .glb has them: Open3D writes what is there
o3d.io.write_triangle_mesh("open3d_mesh.glb", mesh)

# both under one lamp, seen from the side
first = views[0]
pose = ps.orbit_pose(first.pose, first.pivot, yaw=-20, pitch=6)
place = first.pivot + first.pivot[2] * np.array([-0.5, -0.7, -0.8])
matt, seen = ps.Material(specular=0), {"camera": ps.Camera.from_fov(46, 240, 280), "samples": 4}
photograph = ps.render(taken[0][0], shading="none", pose=pose, **seen)
framed = ps.render(views, ps.Light(position=place, shadow=True), matt, pose=pose, **seen)
(read,) = [node.content for node in ps.load_scene("open3d_mesh.glb").nodes if isinstance(node.content, ps.Mesh)]
lamp = ps.Light(position=UPRIGHT[:3, :3] @ place, shadow=True)
scene = ps.Scene((ps.Node(dataclasses.replace(read, material=matt), "mesh"), ps.Node(lamp, "lamp")))
meshed = ps.render(scene, pose=UPRIGHT @ pose, **seen)
ps.save_image("open3d_mesh.png", np.hstack([photograph, framed, meshed]), small=True)
both = (framed[..., 3] == 255) & (meshed[..., 3] == 255)
apart = np.median(np.abs(framed[..., :3].astype(int) - meshed[..., :3])[both])
print(f"{len(read.faces)} triangles; where both are, the pictures are {apart:.0f} of 255 apart (median)")
