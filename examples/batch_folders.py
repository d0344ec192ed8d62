"""A batch of folders.

`ps.batch.map` draws by one process a core, and gives the pictures in order; `progress` is told of each, and may stop
it. On the command line, and on clusters: `pointshade batch scans/ -o out --resume`.
"""

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


if __name__ == "__main__":  # the processes import this file
    folders = [Path("scans") / f"{number:02}" for number in range(8)]
    for number, folder in enumerate(folders):
        make(folder, 7 * number - 25)
    view = ps.View([ps.Light(position=(-0.5, -0.7, 0.2))], finish=ps.OutputSettings(samples=4, background="#303030"))
    done = ps.batch.map(folders, view=view, progress=lambda number, all: print(f"{number} of {all}"))
    pictures = list(done)
    ps.save_image("batch_folders.png", np.vstack([np.hstack(pictures[:4]), np.hstack(pictures[4:])]))
