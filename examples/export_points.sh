# Points for other programs.
#
# A .ply of lit points, turned so that z is up, as Blender and CloudCompare have it; `.glb` needs no axes.
# Any point cloud is drawn as well: here the file itself, from above. `sh export_points.sh FOLDER` takes your own frame.

pointshade render "${1:-vase}" -o points.ply --axes blender --light -0.5,-0.7,0.2
pointshade render points.ply -o export_points.png --pitch 20 --yaw 15 --shading none --background white \
    --picture-size 480x360 --samples 4
