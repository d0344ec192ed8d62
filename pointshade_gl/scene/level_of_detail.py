"""Level of detail: draws so many points of a frame that splats are about as fine as the view's pixels."""

from __future__ import annotations

import numpy as np

from ..checks.arguments import check_float
from .appearance import Look
from .camera import Camera, Eye
from .frame import Frame
from .placed import Placed
from .rotation import moved

MOST_COARSE, FEWEST = 32, 4  # of how many pixels one is drawn, at most; how many are drawn on each side, at least
PLACES = 160  # in a row of the surface that a frame hides, about
STRIDES = 4, 6  # pixels of the frame for each of these, at least and at most
MERGE = 1e-5  # of 1/z: invisible (`bench --speed` charts it), and gives planes their full speed


def check_merge(merge: float) -> float:
    """Return the tolerance of merged splats, a share of 1/z. Raises ValueError outside 0 to 0.01."""
    return check_float(merge, "merge must be a share of the inverse depth from 0 to 0.01", 0, 0.01)


def coarser_step(placed: Placed, eye: Eye) -> int:
    """Return 1, 2, 4, ...: every step-th pixel of a frame is enough, as several fall into one pixel of the view.

    Measured at the nearest corner of the object's box, so that no part of it is drawn too coarsely. At least FEWEST
    pixels are left on each side of the frame.
    """
    view, corners, frame = np.linalg.inv(eye.pose), placed.main_corners, placed.content.frame
    depth = moved(corners, view)[:, 2]
    nearest = float(depth.min()) if len(depth) else 0.0
    if nearest <= 0:
        return 1
    farthest = float(frame.main_corners[:, 2].max()) * placed.rigid_axes[1]
    spread = farthest / min(frame.camera.fx, abs(frame.camera.fy))  # between neighbours, world units, at most
    pixels = spread * max(eye.camera.fx, abs(eye.camera.fy)) / nearest
    most = min(MOST_COARSE, max(min(frame.depth.shape) // FEWEST, 1))
    return int(2 ** np.floor(np.log2(np.clip(1 / pixels, 1, most))))


def coarser_size(size: float, step: int) -> float:
    """Return a splat's size in pixels of a coarser frame, so that those at its border reach as far as before."""
    return 1 + (size - 1) / step if size > 1 else size


def coarser(frame: Frame, step: int) -> Frame:
    """Return a frame of every step-th pixel, with all of its colours."""
    first, c = (step - 1) // 2, frame.camera
    depth = frame.depth[first::step, first::step]
    height, width = depth.shape
    camera = Camera(c.fx / step, c.fy / step, (c.cx - first) / step, (c.cy - first) / step, width, height)
    return Frame(frame.color, depth, camera, frame.pose, source=frame.source)


def finer_camera(frame: Frame, look: Look, camera: Camera) -> Camera:
    """Return the frame's camera, at the size at which its points are drawn for a view by another camera.

    That is as fine as the pixels of the view, but no finer than the colours; the depth's own size where these are not
    larger, and where the look asks for the depth's own points. It does not depend on the pose: moving costs nothing.
    """
    small, large = frame.camera, frame.picture_camera
    if look.upsample == "none" or look.has_own_sizes or large == small:
        return small
    width = int(np.clip(round(small.width * camera.fx / small.fx), small.width, large.width))
    height = int(np.clip(round(small.height * abs(camera.fy / small.fy)), small.height, large.height))
    return small if (width, height) == (small.width, small.height) else small.resized(width, height)


def bridged_stride(camera: Camera) -> int:
    """Return how many pixels of a frame correspond to one of the smaller surface of what it hides."""
    least, most = STRIDES
    return min(max(-(-camera.width // PLACES), least), most)


def bridged_camera(camera: Camera) -> Camera:
    """Return the camera of that smaller surface: it has one pixel in the middle of each stride."""
    stride = bridged_stride(camera)
    cx, cy = (camera.cx - stride // 2) / stride, (camera.cy - stride // 2) / stride
    width, height = -(-camera.width // stride), -(-camera.height // stride)
    return Camera(camera.fx / stride, camera.fy / stride, cx, cy, width, height)
