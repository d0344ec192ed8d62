"""Your own estimator.

`normals` takes an array: here the cross product of differences, in NumPy (left), beside `auto` (right).
Differences take noise and steps of the depth for shapes, and reach across edges. The argument is a folder of your own.
"""

import sys

import numpy as np

import pointshade_gl as ps


def cross_product(frame):
    """(h, w, 3): unit normals in camera axes, towards the camera, NaN where a neighbour is missing."""
    points = frame.camera.unproject(np.where(frame.depth > 0, frame.depth, np.nan))
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    return normals / np.linalg.norm(normals, axis=2, keepdims=True)


frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
plaster = ps.Frame(None, frame.depth, frame.camera)  # without colours it is light grey
look = {"camera": frame.camera.fitted(320, 240), "missing": "keep", "background": "black"}
halves = [ps.render(plaster, normals=normals, **look) for normals in (cross_product(plaster), "auto")]
ps.save_image("own_normals.png", np.hstack(halves))
