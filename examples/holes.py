"""Holes, kept and completed.

Sensors leave pixels without depth, as behind the edges of near things and on what shines; in other views they gape.
`missing="complete"` continues the surfaces around them; on the command line it is the default. The argument is a folder
of your own; without it, holes are cut into the built-in scene.
"""

import sys

import numpy as np

import pointshade_gl as ps


def cut():
    """The built-in scene as a sensor might see it."""
    scene = ps.load_scene("demo")
    camera = ps.Camera.from_fov(34, 320, 240)
    color = ps.render(scene, camera=camera, background="black", samples=4)[..., :3]
    depth = ps.render_depth(scene, camera=camera)
    near = np.zeros_like(depth)
    for shift in range(1, 14):  # what the second eye of a sensor does not see beside near things
        near[:, shift:] = np.maximum(near[:, shift:], (depth[:, :-shift] < depth[:, shift:] - 0.02 * shift))
    rows, columns = np.indices(depth.shape)
    for x, y, size in np.random.default_rng(2).uniform((0, 0, 3), (320, 240, 12), (40, 3)):
        near[(columns - x) ** 2 + (rows - y) ** 2 < size**2] = 1
    return ps.Frame(color, np.where(near > 0, 0, depth), camera)


frame = ps.load_frame(sys.argv[1]) if sys.argv[1:] else cut()
look = {"camera": frame.camera.fitted(320, 240), "shading": "none", "yaw": -10, "background": "white"}
ps.save_image("holes.png", np.hstack([ps.render(frame, missing=missing, **look) for missing in ("keep", "complete")]))
