"""A point cloud, lit.

60 000 points on a torus knot, without normals, as discs that blend into a surface; a thirtieth of them as
balls; and eye-dome lighting, which shows depth without light or normals.
"""

import numpy as np

import pointshade_gl as ps


def cloud(count, **look):
    """Points at random on a tube along a knot, in colours along it."""
    t, turn = np.random.default_rng(3).uniform(0, 2 * np.pi, (2, count, 1))
    middle = np.hstack([(2 + np.cos(3 * t)) * np.cos(2 * t), (2 + np.cos(3 * t)) * np.sin(2 * t), np.sin(3 * t)])
    outward = np.hstack([np.cos(3 * t) * np.cos(2 * t), np.cos(3 * t) * np.sin(2 * t), np.sin(3 * t)])
    along = np.hstack([-np.sin(2 * t), np.cos(2 * t), 0 * t])
    across = np.cross(along, outward)
    positions = middle + 0.42 * (np.cos(turn) * outward + np.sin(turn) * across)
    colors = 150 + 100 * np.cos(2 * t + (0.0, 2.1, 4.2))
    return ps.PointCloud(positions, colors=colors.astype(np.uint8), up="z", **look)


sun = ps.Light(direction=(1, 0.6, -1.5), shadow=True, angle=4)
view = {"camera": ps.Camera.from_fov(62, 240, 240), "background": "white", "samples": 16, "pitch": 20}
pictures = [
    ps.render(cloud(60_000), sun, ground=True, **view),
    ps.render(cloud(2_000, splat="ball", point_size=0.09), sun, ground=True, **view),
    ps.render(cloud(60_000, shading="edl"), **view),
]
ps.save_image("lit_cloud.png", np.hstack(pictures))
