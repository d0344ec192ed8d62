"""A RealSense folder.

Name the folder, and colour, depth in millimetres, and the camera are found.
Left the photograph, right a warm lamp in it. Without a folder one is made first, of the built-in scene.
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import pointshade_gl as ps


def recorded(folder):
    """What pyrealsense2 scripts usually save: 8-bit colour, 16-bit depth, the intrinsics as they are printed."""
    scene = ps.load_scene("demo")
    camera = ps.Camera(fx=325.0, fy=325.0, cx=159.5, cy=119.5, width=320, height=240)
    folder.mkdir()
    ps.save_image(folder / "color.png", ps.render(scene, camera=camera, background="black", samples=4)[..., :3])
    depth = (ps.render_depth(scene, camera=camera) * 1000).round().astype(np.uint16)
    Image.fromarray(depth).save(folder / "depth.png")
    lens = {"width": 320, "height": 240, "ppx": 159.5, "ppy": 119.5, "fx": 325.0, "fy": 325.0}
    (folder / "intrinsics.json").write_text(json.dumps(lens))
    return folder


frame = ps.load_frame(sys.argv[1] if sys.argv[1:] else recorded(Path("recording")))
x, y, z = frame.pivot
lamp = ps.Light(position=(x - 0.45 * z, y - 0.35 * z, 0.95 * z), color=(1.0, 0.75, 0.5), shadow=True)
look = {"camera": frame.camera.fitted(320, 240), "samples": 4, "missing": "complete"}
pictures = ps.render(frame, shading="none", **look), ps.render(frame, lamp, exposure="auto", **look)
ps.save_image("realsense_folder.png", np.hstack(pictures))
