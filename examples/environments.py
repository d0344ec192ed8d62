"""Light from all around.

Ambient light alone, with what is near hiding a part of it (ambient occlusion), a sky, and a studio.
An environment may also be a picture of the whole sphere, such as an .hdr file. The argument is a folder of your own.
"""

import sys

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
look = {"camera": frame.camera.fitted(240, 180), "pitch": 10, "ground": True, "background": "#d8d8d8", "samples": 16}
dim = {"light": (), "material": ps.Material(ambient=1.0, diffuse=0.9, specular=0.0)}
pictures = [
    ps.render(frame, ambient_occlusion=False, **dim, **look),
    ps.render(frame, ambient_occlusion=0.2 * frame.pivot[2], **dim, **look),  # metres
    ps.render(frame, environment="sky", **look),
    ps.render(frame, environment="studio", environment_rotation=45, **look),
]
ps.save_image("environments.png", np.hstack(pictures))
