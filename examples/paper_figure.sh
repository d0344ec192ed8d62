# A figure for a paper.
#
# White paper behind, a soft shadow on a ground that is not seen, and 16 samples for smooth outlines.
# `radius` is the lamp's, in metres: the larger it is, the softer are the shadows.

pointshade render vase -o paper_figure.png --ground --background white --samples 16 \
    --light "position=-.45,-1.3,.2 radius=.06 shadow" --ambient 0.25 --dolly -0.2 --picture-size 480x360
