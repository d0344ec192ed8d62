"""Less flicker in films.

`temporal=True` averages depth and normals over up to 16 frames of a stream, where they agree within the noise that is
measured. The 16th frame, each by itself (left) and over time; it prints how much still pixels flicker. The argument is
a folder of your own, to which the noise is added.
"""

import sys

import numpy as np

import pointshade_gl as ps

still = ps.load_frame(*sys.argv[1:2] or ["vase"])
known = still.depth > 0
random = np.random.default_rng(4)
frames = []
for _ in range(16):  # 1.5 mm of noise, written in whole millimetres
    depth = np.round(still.depth + random.normal(0, 0.0015, known.shape), 3)
    frames.append(ps.Frame(None, np.where(known, depth, 0), still.camera, source="my camera"))

light = ps.Light(position=still.pivot + still.pivot[2] * np.array([-0.5, -0.7, -0.8]))
look = {"camera": still.camera.fitted(320, 240), "background": "black"}
last = []
for temporal in (False, True):
    with ps.Renderer() as renderer:
        pictures = [renderer.render(frame, light, temporal=temporal, **look) for frame in frames]
    flicker = np.abs(pictures[-1].astype(float) - pictures[-2])[..., :3].mean()
    print(f"{'over time' if temporal else 'each alone'}: {flicker:.2f} steps of 255 between two frames")
    last.append(pictures[-1])
ps.save_image("temporal_film.png", np.hstack(last))
