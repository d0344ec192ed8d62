"""A RealSense folder.

Name the folder, and colour, depth in millimetres, and the camera are found.
The recording is made first, of the built-in scene.
"""

import json
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps

# What pyrealsense2 scripts usually save: 8-bit colour, 16-bit depth, the intrinsics as they are printed.
scene = ps.load_scene("demo")
camera = ps.Camera(fx=325.0, fy=325.0, cx=159.5, cy=99.5, width=320, height=200)
folder = Path("recording")
folder.mkdir()
ps.save_image(folder / "color.png", ps.render(scene, camera=camera, background="black", samples=4)[..., :3])
depth = (ps.render_depth(scene, camera=camera) * 1000).round().astype(np.uint16)
Image.fromarray(depth).save(folder / "depth.png")
lens = {"width": 320, "height": 200, "ppx": 159.5, "ppy": 99.5, "fx": 325.0, "fy": 325.0}
(folder / "intrinsics.json").write_text(json.dumps(lens))

frame = ps.load_frame("recording")
lamp = ps.Light(position=(0.9, -0.4, 0.6), color=(1.0, 0.75, 0.5), shadow=True)
lit = ps.render(frame, lamp, exposure="auto", samples=16, background="black")
ps.save_image("realsense_folder.png", np.hstack([frame.color, lit[..., :3]]))
