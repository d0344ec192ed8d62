"""A turntable.

The camera swings around a frame, and the light stays where it is in the world. The film is a .gif here; `.mp4` needs
the extra `video`. Four of its pictures make the strip. `python turntable.py FOLDER` takes your own frame.
"""

import sys

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
camera = frame.camera.fitted(200, 150)
light = ps.Light(position=frame.pivot + frame.pivot[2] * np.array([-0.5, -0.7, -0.8]))
swing = 15 * np.cos(2 * np.pi * np.arange(12) / 12)  # degrees to the right
with ps.Renderer() as renderer, ps.Film("turntable.gif", fps=12) as film:
    pictures = [
        renderer.render(frame, light, camera=camera, yaw=yaw, background="white", samples=4, missing="complete")
        for yaw in swing
    ]
    for picture in pictures:
        film.add(picture)
ps.save_image("turntable.png", np.hstack(pictures[6::-2]))
