"""Albedo of several photographs.

Three photographs of one view, each under its own light, tell together what the surface's own colours are. Left to
right: two of the photographs, the albedo, and the albedo under a new light.
The argument is a folder of your own, of which the photographs are made.
"""

import sys

import numpy as np

import pointshade_gl as ps

given = ps.load_frame(*sys.argv[1:2] or ["vase"])
matt = ps.Material(ambient=0.2, diffuse=0.8, specular=0.0)
lights = [ps.Light(direction=(x, 0.4, 0.8)) for x in (1.0, 0.1, -1.0)]
photographs = [ps.render(given, light, matt, background="black")[..., :3] for light in lights]
frames = [ps.Frame(photograph, given.depth, given.camera) for photograph in photographs]

albedo = ps.estimate_albedo(frames)
plain = ps.Frame(albedo, given.depth, given.camera)
look = {"camera": given.camera.fitted(240, 180), "background": "black", "samples": 4}
pictures = [ps.render(frame, shading="none", **look) for frame in (frames[0], frames[2], plain)]
pictures.append(
    ps.render(
        plain, ps.Light(position=given.pivot + given.pivot[2] * np.array([0.3, -0.8, -0.4])), matt, exposure=0.3, **look
    )
)
ps.save_image("shared_albedo.png", np.hstack(pictures))
