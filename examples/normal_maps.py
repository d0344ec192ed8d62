"""Normal maps for a training set.

16 bits a channel: as OpenGL has them (left, green is up) and as DirectX does (right, green is down).
`pointshade normals my_sequence -o 'n_%04d.png' --bits 16 --axes directx` does the same for all frames of a folder.
The argument is a folder of your own.
"""

import sys

import numpy as np
from PIL import Image

import pointshade_gl as ps

frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
normals = ps.estimate_normals(frame)  # (h, w, 3) float32, camera axes, NaN where depth is missing
ps.save_normals("opengl.png", normals, bits=16)
ps.save_normals("directx.png", normals, axes="directx", bits=16)

halves = [np.asarray(Image.open(name).convert("RGBA").reduce(2)) for name in ("opengl.png", "directx.png")]
ps.save_image("normal_maps.png", np.hstack(halves))
