"""Shadows between objects.

Two frames and a mesh under one low lamp: all cast shadows on the floor, the ball also on the first stool, and the first
vase on the second.
Nodes place objects by a 4x4 transform.
"""

import numpy as np

import pointshade_gl as ps

vase = ps.load_frame("vase")
low = vase.camera.unproject(vase.depth)[vase.depth > 0][:, 1].max()  # where it stands: y points down


def ball(radius, rings=32):
    """A mesh of a ball on the floor."""
    around, down = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * rings), np.linspace(0, np.pi, rings))
    out = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], axis=2).reshape(-1, 3)
    first = np.arange(rings * 2 * rings).reshape(rings, -1)
    a, b, c, d = (x.ravel() for x in (first[:-1, :-1], first[:-1, 1:], first[1:, 1:], first[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return ps.Mesh(radius * out + (0, low - radius, 0), faces, out, color=(0.8, 0.25, 0.1))


def moved(x, z):
    transform = np.eye(4)
    transform[:3, 3] = x, 0, z
    return transform


floor = ps.Mesh([(-4, low, -1), (4, low, -1), (4, low, 4), (-4, low, 4)], [(0, 1, 2), (0, 2, 3)], color=[0.5] * 3)
nodes = (
    ps.Node(ps.PointObject(vase), "vase", moved(-0.1, 0)),
    ps.Node(ps.PointObject(vase), "second vase", moved(0.5, 0.25)),
    ps.Node(ball(0.13), "ball", moved(-0.4, 0.95)),
    ps.Node(floor, "floor"),
)
lamp = ps.Light(position=(-1.6, -0.25, 0.2), shadow=True, radius=0.02)
scene = ps.Scene(nodes, camera=ps.Camera.from_fov(44, 560, 360))
picture = ps.render(scene, lamp, pitch=12, dolly=-0.2, exposure=0.3, samples=16, background="#202020")
ps.save_image("two_objects.png", picture)
