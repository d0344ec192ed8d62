"""Three lamps in colours.

A warm lamp on the left, a cool one on the right, and a magenta one behind, each with its own shadow.
`ps.render` takes one light, or a list of them; colours are linear, and 1 is white.
"""

import numpy as np

import pointshade_gl as ps

frame = ps.load_frame("vase")
middle, away = frame.pivot, frame.pivot[2]  # all places are told from the middle, in units of its distance

warm = ps.Light(position=middle + away * np.array([-0.7, -0.4, -0.5]), color=(1.0, 0.55, 0.2), shadow=True)
cool = ps.Light(position=middle + away * np.array([0.8, 0.0, -0.5]), color=(0.15, 0.4, 1.0), shadow=True)
above = ps.Light(position=middle + away * np.array([0.1, -0.9, 0.2]), color=(1.0, 0.1, 0.7), shadow=True)

camera = frame.camera.resized(560, 420)
picture = ps.render(frame, [warm, cool, above], camera=camera, ground=True, background="black", samples=16)
ps.save_image("three_lamps.png", picture)
