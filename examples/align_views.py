"""Views with wrong poses, aligned.

Three cameras whose poses are wrong by some centimetres and a degree or two: merged as they are, and aligned first.
`--align` does it on the command line, and `search=True` finds poses that nobody has measured.
"""

import numpy as np

import pointshade_gl as ps

scene = ps.load_scene("demo")
camera = ps.Camera.from_fov(30, 320, 240)
middle = np.array([0.0, 0.35, 0.0])  # of the scene, whose y points up
frames = []
for yaw, error in ((0, 0), (-14, 0.02), (14, -0.02)):
    pose = ps.orbit_pose(scene.pose, middle, yaw=yaw)
    color = ps.render(scene, camera=camera, pose=pose, background="black", samples=4)[..., :3]
    depth = ps.render_depth(scene, camera=camera, pose=pose)
    wrong = ps.orbit_pose(pose, middle, yaw=100 * error * 0.7)
    wrong[:3, 3] += error, error / 2, 0
    frames.append(ps.Frame(color, depth, camera, wrong))

aligned = ps.align_frames(frames)
look = {"camera": ps.Camera.from_fov(18, 280, 220), "shading": "none", "background": "white"}
ps.save_image("align_views.png", np.hstack([ps.render(frames, **look), ps.render(aligned, **look)]))
for given, found in zip(frames[1:], aligned[1:], strict=True):
    print(f"moved by {100 * np.linalg.norm(found.pose[:3, 3] - given.pose[:3, 3]):.1f} cm")
