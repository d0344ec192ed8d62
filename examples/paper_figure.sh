# A figure for a paper.
#
# White paper behind, a soft shadow on a ground that is not seen, and 16 samples for smooth outlines.
# `radius` is the lamp's, in metres: the larger it is, the softer are the shadows.

pointshade render vase -o paper_figure.png --ground --background white --samples 16 \
    --light "position=-.25,-1.5,.5 radius=.04 shadow" --ambient 0.25 \
    --yaw 12 --pitch 14 --dolly -0.25 --picture-size 480x360
