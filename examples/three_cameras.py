"""Three cameras as one.

Frames with poses become one object. The pictures show it from the side: of one camera alone, of three, and how certain
the normals of three are.
The cameras are made from the built-in scene here; `pointshade render left middle right` does it for folders.
"""

import numpy as np

import pointshade_gl as ps

scene = ps.load_scene("demo")
camera = ps.Camera.from_fov(40, 320, 240)
middle = np.array([0.0, 0.35, 0.0])  # of the scene, whose y points up


def photographed(yaw):
    """The frame of a camera that stands aside."""
    pose = ps.orbit_pose(scene.pose, middle, yaw=yaw)
    color = ps.render(scene, camera=camera, pose=pose, background="black", samples=4)
    return ps.Frame(color[..., :3], ps.render_depth(scene, camera=camera, pose=pose), camera, pose)


frames = [photographed(yaw) for yaw in (0, -35, 35)]
seen = {"camera": ps.Camera.from_fov(40, 240, 210), "pose": ps.orbit_pose(scene.pose, middle, yaw=18, pitch=10)}
pictures = [
    ps.render(frames[0], shading="none", background="white", **seen),
    ps.render(frames, shading="none", background="white", **seen),
    ps.render(frames, show="certainty", background="white", **seen),
]
ps.save_image("three_cameras.png", np.hstack(pictures))
