"""A batch of folders.

`ps.batch.map` draws by one process a core, and gives the pictures in order; `progress` is told of each, and may stop
it. On the command line, and on clusters: `pointshade batch scans/ -o out --resume`.
The arguments are eight folders, each of another camera if you like; without them, eight are made of the built-in vase.
"""

import sys
from pathlib import Path

import numpy as np

import pointshade_gl as ps


def make(folder, turned):
    """A folder as a scanner might leave it: colours, depth in metres, the camera."""
    vase = ps.load_frame("vase")
    camera = vase.camera.resized(160, 120)
    folder.mkdir(parents=True)
    ps.save_image(folder / "color.png", ps.render(vase, camera=camera, yaw=turned, shading="none")[..., :3])
    np.save(folder / "depth.npy", ps.render_depth(vase, camera=camera, yaw=turned))
    np.savetxt(folder / "intrinsics.txt", [camera.fx, camera.fy, camera.cx, camera.cy])
    return folder


if __name__ == "__main__":  # the processes import this file
    folders = sys.argv[1:] or [make(Path("scans") / f"{number:02}", 7 * number - 25) for number in range(8)]
    finish = ps.OutputSettings(samples=4, background="#303030")
    view = ps.View([ps.Light(position=(-0.5, -0.7, 0.2))], finish=finish, picture_size=(160, 120))
    look = ps.Appearance(missing="complete")
    done = ps.batch.map(folders, look, view, progress=lambda number, all: print(f"{number} of {all}"))
    pictures = list(done)
    ps.save_image("batch_folders.png", np.vstack([np.hstack(pictures[:4]), np.hstack(pictures[4:])]))
