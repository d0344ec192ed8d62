"""Noise, and the choice of estimators.

A sensor's noise of 1.5 mm, lit with four estimators: triangles between neighbours, a plane fit, `auto`, which measures
the noise first, and, last, the normals without noise. It prints how far each is from these.
"""

import numpy as np

import pointshade_gl as ps

vase = ps.load_frame("vase")
known = vase.depth > 0
noise = np.random.default_rng(1).normal(0, 0.0015, known.shape)
noisy = ps.Frame(None, np.where(known, vase.depth + noise, 0), vase.camera)
truth = ps.estimate_normals(vase)

camera = ps.Camera.from_fov(48, 180, 210)
pictures = []
for method in ("triangles-2", "plane-fit-5", "auto", "truth"):
    normals = truth if method == "truth" else ps.estimate_normals(noisy, method)
    cosine = (normals * truth).sum(axis=2)
    print(f"{method}: {np.degrees(np.arccos(np.clip(cosine[known], -1, 1))).mean():.1f} degrees")
    pictures.append(ps.render(noisy, camera=camera, normals=normals, background="black"))
ps.save_image("estimators.png", np.hstack(pictures))
