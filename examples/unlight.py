"""The light that is already there.

A photograph lit from the left; lit again from the right, it is shaded twice; `unlight` finds its light first and takes
it out. Left to right: the photograph, without, with.
The argument is a folder of your own, of which the photograph is made.
"""

import sys

import numpy as np

import pointshade_gl as ps

given = ps.load_frame(*sys.argv[1:2] or ["vase"])
matt = ps.Material(ambient=0.25, diffuse=0.75, specular=0.0)
photograph = ps.render(given, ps.Light(direction=(1, 0.5, 0.8)), matt)

frame = ps.Frame(photograph, given.depth, given.camera)
look = {"camera": given.camera.fitted(240, 180), "background": "white", "samples": 4}
right = ps.Light(direction=(-1, 0.3, 0.6))
before = ps.render(frame, shading="none", **look)
relit = [ps.render(frame, right, unlight=unlight, **look) for unlight in (False, True)]
ps.save_image("unlight.png", np.hstack([before, *relit]))
