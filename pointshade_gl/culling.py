"""What of a scene is drawn, and how finely: what is in view, which points are enough, what may be merged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .frame import Frame

Matrix = NDArray[np.float64]
MERGE = 1e-5  # of 1/z: nothing to see (`bench --speed` charts it), and all the speed on planes


def check_merge(merge: float) -> float:
    """The tolerance of merged splats, a share of 1/z. Raises ValueError outside 0 to 0.01."""
    if not 0 <= merge <= 0.01:
        raise ValueError(f"merge must be a share of the inverse depth from 0 to 0.01, got {merge}")
    return float(merge)


def is_in_view(box: NDArray[np.float64], world: Matrix, camera: Camera, pose: Matrix, near: float) -> bool:
    """Whether a box may show in the picture: False only when it lies wholly outside one side of the view."""
    if not len(box):
        return False
    view = np.linalg.inv(pose) @ world
    x, y, z = (box @ view[:3, :3].T + view[:3, 3]).T
    u, v = camera.fx * x + (camera.cx + 0.5) * z, camera.fy * y + (camera.cy + 0.5) * z
    outside = (u < 0, u > camera.width * z, v < 0, v > camera.height * z, z < near)
    return not any(side.all() for side in outside)


def coarser_step(frame: Frame, world: Matrix, camera: Camera, pose: Matrix) -> int:
    """1, 2, 4 .. : every how many-th pixel of a frame is enough for a view in which several fall into one pixel.

    Judged at the nearest corner of the object's box, so that no part of it is drawn too coarsely.
    """
    view = np.linalg.inv(pose) @ world
    depth = (frame.corners @ view[:3, :3].T + view[:3, 3])[:, 2]
    nearest = float(depth.min()) if len(depth) else 0.0
    if nearest <= 0:
        return 1
    scale = float(np.cbrt(abs(np.linalg.det(world[:3, :3]))))
    spread = frame.depth.max() / frame.camera.fx * scale  # between neighbours, world units, at most
    pixels = spread * camera.fx / nearest
    return int(2 ** np.clip(np.floor(np.log2(1 / pixels)), 0, 5))


def coarser(frame: Frame, step: int) -> Frame:
    """Every step-th pixel of a frame; the colours stay as fine as they are."""
    first, c = (step - 1) // 2, frame.camera
    depth = frame.depth[first::step, first::step]
    height, width = depth.shape
    camera = Camera(c.fx / step, c.fy / step, (c.cx - first) / step, (c.cy - first) / step, width, height)
    return Frame(frame.color, depth, camera, frame.pose)
