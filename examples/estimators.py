"""Noise, and the choice of estimators.

A sensor's noise of 1.5 mm in a metre, lit with four estimators: triangles between neighbours, a plane fit, `auto`,
which measures the noise first, and, last, the normals without noise. It prints how far each is from these. The argument
is a folder of your own, to which the noise is added.
"""

import sys

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
known = frame.depth > 0
noise = np.random.default_rng(1).normal(0, 0.0015, known.shape) * frame.depth
noisy = ps.Frame(None, np.where(known, frame.depth + noise, 0), frame.camera)
truth = ps.estimate_normals(frame)

camera = frame.camera.fitted(240, 180)
pictures = []
for method in ("triangles-2", "plane-fit-5", "auto", "truth"):
    normals = truth if method == "truth" else ps.estimate_normals(noisy, method)
    cosine = (normals * truth).sum(axis=2)
    print(f"{method}: {np.degrees(np.arccos(np.clip(cosine[known], -1, 1))).mean():.1f} degrees")
    pictures.append(ps.render(noisy, camera=camera, normals=normals, background="black"))
ps.save_image("estimators.png", np.hstack(pictures))
