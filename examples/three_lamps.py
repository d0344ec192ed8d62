"""Three lamps in colours.

A red, a green and a blue lamp make white where all three shine, and coloured shadows where one of them is hidden.
`ps.render` takes one light, or a list of them; colours are linear, and 1 is white.
"""

import numpy as np

import pointshade_gl as ps

vase = ps.load_frame("vase")
plaster = ps.Frame(None, vase.depth, vase.camera)  # without colours it is light grey
low, far = plaster.corners[:, 1].max(), vase.pivot[2]
faces, grey = [(0, 1, 2), (0, 2, 3)], (0.6, 0.6, 0.6)
floor = ps.Mesh([(-4, low, -1), (4, low, -1), (4, low, 1.5), (-4, low, 1.5)], faces, color=grey)
wall = ps.Mesh([(-4, low, 1.5), (4, low, 1.5), (4, -3, 1.5), (-4, -3, 1.5)], faces, color=grey)
lamps = [
    ps.Light(position=(x, -0.35, far - 0.9), color=color, shadow=True, radius=0.01)
    for x, color in zip((-0.4, 0.0, 0.4), np.eye(3), strict=True)
]
nodes = ps.Node(ps.PointObject(plaster), "vase"), ps.Node(floor, "floor"), ps.Node(wall, "wall")
scene = ps.Scene(nodes, camera=ps.Camera.from_fov(52, 480, 360))
ps.save_image("three_lamps.png", ps.render(scene, lamps, samples=16))
