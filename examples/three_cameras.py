"""Three cameras as one.

Frames with poses become one object. The pictures show it from the side: of one camera alone, of three, and how certain
the normals of three are.
The argument is a folder of frames with poses; `pointshade render left middle right` does it for folders of one camera
each. Without it, three cameras see the built-in scene.
"""

import sys

import numpy as np

import pointshade_gl as ps


def photographed():
    """Frames of three cameras around the built-in scene."""
    scene, camera = ps.load_scene("demo"), ps.Camera.from_fov(40, 320, 240)
    for yaw in (0, -35, 35):
        pose = ps.orbit_pose(scene.pose, (0.0, 0.35, 0.0), yaw=yaw)
        color = ps.render(scene, camera=camera, pose=pose, background="black", samples=4)
        yield ps.Frame(color[..., :3], ps.render_depth(scene, camera=camera, pose=pose), camera, pose)


frames = list(ps.open_source(sys.argv[1]))[::8] if sys.argv[1:] else list(photographed())
first = frames[0]
pose = ps.orbit_pose(first.pose, first.pivot, yaw=18, pitch=10)
seen = {"camera": first.camera.fitted(240, 180), "pose": pose, "background": "white"}
pictures = [
    ps.render(first, shading="none", **seen),
    ps.render(frames, shading="none", **seen),
    ps.render(frames, show="certainty", **seen),
]
ps.save_image("three_cameras.png", np.hstack(pictures))
