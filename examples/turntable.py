"""A turntable.

The camera swings around an object, of which there are frames from all sides, and the light stays where it is in the
world. The film is a .gif here; `.mp4` needs the extra `video`. Four of its pictures make the strip.
"""

import numpy as np

import pointshade_gl as ps

frames = list(ps.open_source("vase/whole"))
camera = ps.Camera.from_fov(48, 200, 210)
light = ps.Light(position=(-0.5, -0.7, 0.2))
swing = 30 * np.cos(2 * np.pi * np.arange(12) / 12)  # degrees to the right
with ps.Renderer() as renderer, ps.Film("turntable.gif", fps=12) as film:
    pictures = [renderer.render(frames, light, camera=camera, yaw=yaw, background="white", samples=4) for yaw in swing]
    for picture in pictures:
        film.add(picture)
ps.save_image("turntable.png", np.hstack(pictures[6::-2]))
