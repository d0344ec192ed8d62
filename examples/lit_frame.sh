# A lit frame.
#
# What a camera saw, under one warm lamp at its upper left, with shadows.
# `sh lit_frame.sh FOLDER` lights your own: a folder, or a depth file; without it the built-in vase is lit.

pointshade render "${1:-vase}" -o lit_frame.png --light "position=-.9,-.6,1.4 color=#ffc080 shadow" \
    --background "#303030" --picture-size 480x360
