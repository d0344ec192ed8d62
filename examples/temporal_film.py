"""Less flicker in films.

`temporal=True` averages depth and normals over up to 16 frames of a stream, where they agree within the noise that is
measured. The 16th frame, each by itself (left) and over time; it prints how much still pixels flicker.
"""

import numpy as np

import pointshade_gl as ps

vase = ps.load_frame("vase")
known = vase.depth > 0
random = np.random.default_rng(4)
frames = []
for _ in range(16):  # 1.5 mm of noise, written in whole millimetres
    depth = np.round(vase.depth + random.normal(0, 0.0015, known.shape), 3)
    frames.append(ps.Frame(None, np.where(known, depth, 0), vase.camera, source="my camera"))

light = ps.Light(position=(-0.5, -0.7, 0.2))
last = []
for temporal in (False, True):
    with ps.Renderer() as renderer:
        pictures = [renderer.render(frame, light, temporal=temporal, background="black") for frame in frames]
    flicker = np.abs(pictures[-1][known].astype(float) - pictures[-2][known]).mean()
    print(f"{'over time' if temporal else 'each alone'}: {flicker:.2f} steps of 255 between two frames")
    last.append(pictures[-1][10:270, 100:420])
ps.save_image("temporal_film.png", np.hstack(last))
