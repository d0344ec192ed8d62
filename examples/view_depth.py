"""Depth of a view, in Python.

`ps.render_depth` returns metres as a camera would measure them from the side, here with a line every 5 cm.
`unproject` makes points in the world of them; `show="depth"` is the same in colours, to look at. The argument is a
folder of your own.
"""

import sys

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
camera = frame.camera.fitted(320, 240)
pose = ps.orbit_pose(frame.pose, frame.pivot, yaw=25, pitch=15)
depth = ps.render_depth(frame, camera=camera, pose=pose)  # (h, w) float32, 0 where nothing is seen
lit = ps.render(frame, camera=camera, pose=pose, background="black")

step = np.floor(depth / 0.05)
line = (depth > 0) & ((step != np.roll(step, 1, axis=0)) | (step != np.roll(step, 1, axis=1)))
lit[line] = (255, 255, 255, 255)
colours = ps.render(frame, camera=camera, pose=pose, background="black", show="depth")
ps.save_image("view_depth.png", np.hstack([lit, colours]))

points = camera.unproject(depth, pose=pose)  # (h, w, 3), world
row, column = np.unravel_index(np.where(depth > 0, depth, np.inf).argmin(), depth.shape)
print(f"nearest: {depth[row, column]:.3f} m, at {points[row, column].round(3)} in the world")
