"""Views with wrong poses, aligned.

Three cameras whose poses are wrong by some centimetres and a degree or two: merged as they are, and aligned first.
`--align` does it on the command line, and `search=True` finds poses that nobody has measured.
The argument is a folder of frames with poses, to which the errors are added; without it, the built-in scene is seen.
"""

import sys

import numpy as np

import pointshade_gl as ps


def photographed():
    """Frames of three cameras before the built-in scene."""
    scene, camera = ps.load_scene("demo"), ps.Camera.from_fov(30, 320, 240)
    for yaw in (0, -14, 14):
        pose = ps.orbit_pose(scene.pose, (0.0, 0.35, 0.0), yaw=yaw)
        color = ps.render(scene, camera=camera, pose=pose, background="black", samples=4)[..., :3]
        yield ps.Frame(color, ps.render_depth(scene, camera=camera, pose=pose), camera, pose)


right = list(ps.open_source(sys.argv[1]))[:9:4] if sys.argv[1:] else list(photographed())
frames = []
for frame, error in zip(right, (0, 0.02, -0.02), strict=True):
    wrong = ps.orbit_pose(frame.pose, frame.pivot, yaw=100 * error * 0.7)
    wrong[:3, 3] += error, error / 2, 0
    frames.append(ps.Frame(frame.color, frame.depth, frame.camera, wrong))

aligned = ps.align_frames(frames)
look = {"camera": ps.Camera.from_fov(26, 320, 240), "shading": "none", "background": "white"}
ps.save_image("align_views.png", np.hstack([ps.render(frames, **look), ps.render(aligned, **look)]))
for given, found in zip(frames[1:], aligned[1:], strict=True):
    print(f"moved by {100 * np.linalg.norm(found.pose[:3, 3] - given.pose[:3, 3]):.1f} cm")
