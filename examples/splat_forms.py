"""Splats close up.

The same pixels as footprints on their tangent planes (the default), as discs, and as a mesh of facets.
So near, a pixel of the frame covers several of the picture.
"""

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame("vase")
look = {"camera": ps.Camera.from_fov(8, 240, 240), "yaw": 20, "pitch": -14, "background": "black"}
pictures = [ps.render(frame, splat=splat, shading="flat", **look) for splat in ("footprint", "round", "mesh")]
ps.save_image("splat_forms.png", np.hstack(pictures))
