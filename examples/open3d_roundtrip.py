"""Open3D and back.

An RGBDImage becomes a frame, its lit points and normals an Open3D point cloud.

Install::

    pip install pointshade-gl open3d

`python open3d_roundtrip.py [FOLDER]` writes open3d_roundtrip.ply and .png, and compares the points of both.
"""

import sys

import numpy as np
import open3d as o3d

import pointshade_gl as ps

# an RGBDImage and its camera, as Open3D reads or records them; here made of a frame
read = ps.load_frame(*sys.argv[1:2] or ["vase"])
camera = read.camera
color = read.color if read.color is not None else np.full((*read.depth.shape, 3), 200, np.uint8)
rgbd = o3d.geometry.RGBDImage.create_from_color_and_depth(
    o3d.geometry.Image(np.ascontiguousarray(color[..., :3])),
    o3d.geometry.Image(read.depth),
    depth_scale=1.0,
    depth_trunc=1e9,
    convert_rgb_to_intensity=False,
)
sides = camera.width, camera.height
pinhole = o3d.camera.PinholeCameraIntrinsic(*sides, camera.fx, camera.fy, camera.cx, camera.cy)

# to pointshade: axes (x right, y down, z forward), metres and pixel centres are the same
k = pinhole.intrinsic_matrix
frame = ps.Frame(rgbd.color, rgbd.depth, ps.Camera(k[0, 0], k[1, 1], k[0, 2], k[1, 2], pinhole.width, pinhole.height))
lit = ps.render_points(frame, ps.Light(position=frame.pivot + frame.pivot[2] * np.array([-0.5, -0.7, -0.8])))

# and back: each point with its normal and its light
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(lit.positions)))
cloud.normals = o3d.utility.Vector3dVector(np.array(lit.normals))
cloud.colors = o3d.utility.Vector3dVector(lit.colors / 255)
o3d.io.write_point_cloud("open3d_roundtrip.ply", cloud)
theirs = o3d.geometry.PointCloud.create_from_rgbd_image(rgbd, pinhole)
apart = np.abs(np.asarray(cloud.points) - np.asarray(theirs.points)).max()
print(f"{len(lit.positions)} points in both, at most {apart:.1g} m apart")

# the cloud as Open3D draws it, from where it was seen
seen = camera.resized(480, round(480 * camera.height / camera.width))
window = o3d.visualization.rendering.OffscreenRenderer(seen.width, seen.height)
window.scene.view.set_post_processing(False)  # which would change colours that are lit already
window.scene.set_background([1, 1, 1, 1])
unlit = o3d.visualization.rendering.MaterialRecord()
unlit.shader, unlit.point_size = "defaultUnlit", 2
window.scene.add_geometry("cloud", cloud, unlit)
matrix = [[seen.fx, 0, seen.cx], [0, seen.fy, seen.cy], [0, 0, 1]]
window.setup_camera(np.array(matrix), np.eye(4), seen.width, seen.height)
ps.save_image("open3d_roundtrip.png", window.render_to_image(), small=True)
