"""Lamps with a size.

A point, a glowing ball of 8 cm radius, and an area light of 50 x 20 cm: the larger the lamp, the softer its shadow.
`samples` averages pictures from other places of the lamp.
"""

import numpy as np

import pointshade_gl as ps

vase = ps.load_frame("vase")
low = vase.corners[:, 1].max()
faces = [(0, 1, 2), (0, 2, 3)]
floor = ps.Mesh([(-3, low, -1), (3, low, -1), (3, low, 3), (-3, low, 3)], faces, color=(0.6, 0.6, 0.6))
nodes = ps.Node(ps.PointObject(vase), "vase"), ps.Node(floor, "floor")
scene = ps.Scene(nodes, camera=ps.Camera.from_fov(44, 240, 240))
place = {"position": (-0.5, -0.75, 0.4), "shadow": True}
lamps = [
    ps.Light(**place),
    ps.Light(**place, radius=0.08),
    ps.Light(**place, direction=vase.pivot - place["position"], size=(0.5, 0.2), intensity=1.3),
]
pictures = [ps.render(scene, lamp, pitch=30, dolly=-0.15, samples=32, background="#404040") for lamp in lamps]
ps.save_image("soft_shadows.png", np.hstack(pictures))
