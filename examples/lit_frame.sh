# A lit frame.
#
# The built-in vase under one lamp at its upper left. Your own folder, or depth file, takes the place of `vase`.

pointshade render vase -o lit_frame.png --light -0.5,-0.7,0.2 --background "#303030" --picture-size 480x360
