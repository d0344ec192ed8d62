"""A point cloud, lit.

Points without normals as discs that blend into a surface, under a sun; a part of them as balls; and eye-dome lighting,
which shows depth without light or normals.
The argument is a cloud of your own, such as a .laz or .ply; without it, 60 000 points lie on a torus knot.
"""

import sys

import numpy as np

import pointshade_gl as ps


def knot(count):
    """Points at random on a tube along a knot, in colours along it."""
    t, turn = np.random.default_rng(3).uniform(0, 2 * np.pi, (2, count, 1))
    middle = np.hstack([(2 + np.cos(3 * t)) * np.cos(2 * t), (2 + np.cos(3 * t)) * np.sin(2 * t), np.sin(3 * t)])
    outward = np.hstack([np.cos(3 * t) * np.cos(2 * t), np.cos(3 * t) * np.sin(2 * t), np.sin(3 * t)])
    along = np.hstack([-np.sin(2 * t), np.cos(2 * t), 0 * t])
    across = np.cross(along, outward)
    positions = middle + 0.42 * (np.cos(turn) * outward + np.sin(turn) * across)
    colors = 150 + 100 * np.cos(2 * t + (0.0, 2.1, 4.2))
    return ps.PointCloud(positions, colors=colors.astype(np.uint8), up="z")


cloud = ps.load_cloud(sys.argv[1]) if sys.argv[1:] else knot(60_000)
some = slice(None, None, 30)
far = np.ptp(cloud.positions, axis=0).max()
balls = ps.PointCloud(cloud.positions[some], colors=cloud.colors[some], up=cloud.up, splat="ball", point_size=far / 90)

sun = ps.Light(direction=(1, 0.6, -1.5), shadow=True, angle=4)
view = {
    "camera": ps.Camera.from_fov(50, 320, 220),
    "background": "white",
    "samples": 16,
    "pitch": 25,
    "yaw": -25,
    "dolly": 0.2,
}
pictures = [
    ps.render(cloud, sun, exposure="auto", ground=True, **view),
    ps.render(balls, sun, exposure="auto", ground=True, **view),
    ps.render(cloud, shading="edl", **view),
]
ps.save_image("lit_cloud.png", np.hstack(pictures))
