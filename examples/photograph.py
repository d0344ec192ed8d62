"""A photograph and the depth of a network.

Networks such as Depth Anything give inverse depth without a unit; `depth_kind="inverse"` lays it between 1 and 10 m.
Left to right: photograph, depth, and a warm lamp on the right. Both are made here: of the frame that is the argument,
or of the built-in scene.
"""

import sys

import numpy as np

import pointshade_gl as ps

if sys.argv[1:]:
    made = ps.load_frame(sys.argv[1])
    camera = made.camera.fitted(280, 210)
    photograph = ps.render(made, camera=camera, shading="none", samples=16)[..., :3]
    depth = ps.render_depth(made, camera=camera)
else:
    scene, camera = ps.load_scene("demo"), ps.Camera.from_fov(36, 280, 210)
    photograph = ps.render(scene, camera=camera, samples=16)[..., :3]
    depth = ps.render_depth(scene, camera=camera)
inverse = np.divide(1, depth, out=np.zeros_like(depth), where=depth > 0)
network = (255 * inverse / inverse.max()).astype(np.uint8)  # near is bright

frame = ps.load_frame(color=photograph, depth=network, depth_kind="inverse", intrinsics=camera)
x, y, z = frame.pivot
lamp = ps.Light(position=(x + 0.8 * z, y - 0.5 * z, 0.4 * z), color=(1.0, 0.6, 0.25), shadow=True)
lit = ps.render(frame, lamp, ps.Material(ambient=0.1, specular=0.0), exposure="auto", samples=16)[..., :3]
ps.save_image("photograph.png", np.hstack([photograph, np.dstack([network] * 3), lit]))
