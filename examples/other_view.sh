# The built-in scene from another view.
#
# `demo` is a glTF scene with a frame, meshes and lamps; `--light` takes the place of its own.
# An orbit is told in degrees (`--yaw`, `--pitch`) and in a share of the way to the middle (`--dolly`).

pointshade render demo -o other_view.png --yaw -28 --pitch 12 --dolly 0.15 --picture-size 480x360 \
    --light "position=-.9,1.3,.9 color=#ffc890 radius=.03" --light "direction=1,-.6,-.3 color=#5070ff intensity=.5"
