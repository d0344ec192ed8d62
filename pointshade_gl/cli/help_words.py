"""What the help of each command says beside its options: those that come first, and examples."""

from __future__ import annotations

# A command that is not here has so few options that its help lists them all.
FIRST = {
    "render": (
        "-o", "--light", "--yaw", "--pitch", "--zoom", "--shading", "--environment", "--picture-size", "--samples",
        "--background", "--ground", "--turntable", "--fov",
    ),
    "normals": ("-o", "--normals", "--axes", "--bits", "--frame", "--fov", "--depth-scale", "--noise", "--missing"),
    "depth": ("-o", "--yaw", "--pitch", "--zoom", "--picture-size", "--frame", "--fov", "--depth-scale", "--missing"),
    "albedo": ("-o", "--explain", "--fov", "--intrinsics", "--depth-scale"),
    "align": ("-o", "--frame", "--fov", "--intrinsics", "--depth-scale"),
    "view": (
        "--light", "--yaw", "--pitch", "--shading", "--environment", "--views", "--window-size", "--panel", "--fps",
        "--record", "--fov",
    ),
    "info": ("-o", "--json", "--fov", "--intrinsics", "--depth-scale", "--depth-kind"),
    "batch": (
        "-o", "--to", "--workers", "--resume", "--overwrite", "--shard", "--light", "--yaw", "--picture-size",
        "--samples", "--bits", "--axes", "--fov",
    ),
}  # fmt: skip

EXAMPLES = {
    "render": (
        ("A folder with depth and colour, lit from the upper left, seen from the side:",
         "pointshade render my_frame -o lit.png --light -.5,-.7,.2 --yaw 20"),
        ("For a paper: on white, with a soft shadow:",
         "pointshade render my_frame -o figure.png --ground --background white"),
        ("A photograph and its depth, lit from the front:",
         "pointshade render --color photo.jpg --depth photo_depth.png --fov 60"),
        ("A film in which the light goes around; a page in which it follows the mouse:",
         "pointshade render my_frame -o film.gif --turntable light"),
        ("", "pointshade render my_frame -o page.html"),
    ),
    "normals": (
        ("Normals as floats, in camera axes:", "pointshade normals my_frame -o normals.npy"),
        ("A picture of 16 bits for each frame of a sequence, green up as in OpenGL:",
         "pointshade normals my_sequence -o normals_%04d.png --bits 16 --axes opengl"),
        ("A point cloud with normals that point outwards:", "pointshade normals scan.ply -o with_normals.ply"),
    ),
    "depth": (
        ("Metres, seen from another side:", "pointshade depth my_frame -o depth.exr --yaw 15"),
        ("Millimetres of each frame of a sequence:", "pointshade depth my_sequence -o depth_%04d.png"),
        ("At half the size, as a NumPy array:", "pointshade depth my_frame -o depth.npy --picture-size half"),
    ),
    "albedo": (
        ("Photographs from one tripod, each under its own light:", "pointshade albedo my_lights -o albedo.png"),
        ("What was found about the lights:", "pointshade albedo my_lights -o albedo.png --explain"),
        ("Then light it anew:", "pointshade render my_lights --unlight-all -o relit.png"),
    ),
    "align": (
        ("Two folders that show the same thing:", "pointshade align left right -o poses.json"),
        ("Two frames of one sequence:", "pointshade align my_sequence my_sequence --frame 0,1 -o poses.json"),
        ("Then draw both as one object:", "pointshade render left right --poses poses.json -o merged.png"),
    ),
    "view": (
        ("The built-in vase, or your folder:", "pointshade view"),
        ("", "pointshade view my_frame"),
        ("All frames of a sequence as one object:", "pointshade view my_sequence --views all"),
        ("A shadow from a fixed lamp, and the panel with all controls:",
         'pointshade view my_frame --panel --light "position=-.5,-.7,.2 shadow"'),
    ),
    "info": (
        ("What this machine draws with:", "pointshade info"),
        ("What is in a folder, with a contact sheet:", "pointshade info my_frame -o sheet.png"),
        ("The same for a program:", "pointshade info my_frame --json"),
    ),
    "batch": (
        ("A picture of each frame of some folders:", "pointshade batch my_frame my_sequence -o lit"),
        ("Normals for a training set, then go on after an interruption:",
         "pointshade batch my_sequence -o training --to normals.png --bits 16"),
        ("", "pointshade batch my_sequence -o training --to normals.png --bits 16 --resume"),
        ("The second of eight parts, as on a cluster:", "pointshade batch my_sequence -o lit --shard 2/8"),
    ),
    "bench": (
        ("Every estimator against exact truth, in half a minute:", "pointshade bench --quick -o bench"),
        ("How fast each stage is:", "pointshade bench --speed --quick"),
        ("Whether a change cost something:", "pointshade bench --speed --quick --against HEAD~1"),
    ),
    "": (
        ("The built-in vase as a picture, and in a window:", "pointshade render -o vase.png"),
        ("", "pointshade view"),
        ("How your files are read, then your first picture:", "pointshade info my_frame"),
        ("", "pointshade render my_frame"),
    ),
}  # fmt: skip
