"""Decides what of a scene is drawn: what is in view, where the near plane lies, how many points are enough."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, Eye
from .checks import check_float
from .frame import Frame
from .light import Light, at_upper_left
from .scene import Placed, PointObject, Scene

Matrix = NDArray[np.float64]
MOST_COARSE, FEWEST = 32, 4  # of how many pixels one is drawn, at most; how many are drawn on each side, at least
MERGE = 1e-5  # of 1/z: invisible (`bench --speed` charts it), and gives planes their full speed


class Shot(NamedTuple):
    """What one picture of a scene shows."""

    eye: Eye
    lights: list[Light]  # each with a position or a direction, world axes
    scene: Scene
    shown: Sequence[Placed]  # in view
    casting: Sequence[Placed]  # may cast shadows; empty if no light casts any


def compose(scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix) -> Shot:
    """What a camera at a pose (4, 4) sees of a scene under these lights."""
    things = scene.things
    eye = Eye.at_distance(camera, pose, looking_distance(scene, pose))
    shown = things if is_alone(things) else [p for p in things if is_in_view(p.corners, eye)]
    casting = [p for p in things if p.node.shadow] if any(light.shadow for light in lights) else []
    lights = [at_upper_left(light, pose) for light in lights]
    return Shot(eye, lights, scene, shown, casting)


def is_alone(things: Sequence[Placed]) -> bool:
    """Whether this is a single frame: that is always drawn, from all of its points, at any size of the picture."""
    return len(things) == 1 and isinstance(things[0].content, PointObject)


def looking_distance(scene: Scene, pose: Matrix) -> float:
    """How far the things are that a viewer at this pose looks at, world units: it decides about the near plane.

    Of a frame alone, the median distance from which it was taken, wherever the viewer is. Of several things, the
    distance to their middle, or their radius where that is more.
    """
    if is_alone(scene.things):
        alone = scene.things[0]
        return alone.content.frame.scale * alone.rigid_axes[1]
    centre, radius = scene.bounds
    return max(float(np.linalg.norm(centre - pose[:3, 3])), radius)


def check_merge(merge: float) -> float:
    """The tolerance of merged splats, a share of 1/z. Raises ValueError outside 0 to 0.01."""
    return check_float(merge, "merge must be a share of the inverse depth from 0 to 0.01", 0, 0.01)


def is_in_view(corners: NDArray[np.float64], eye: Eye) -> bool:
    """Whether a box (8, 3), world, may be visible: False only if it lies completely outside one side of the picture."""
    if not len(corners):
        return False
    view, camera = np.linalg.inv(eye.pose), eye.camera
    x, y, z = (corners @ view[:3, :3].T + view[:3, 3]).T
    u, v = camera.fx * x + (camera.cx + 0.5) * z, camera.fy * y + (camera.cy + 0.5) * z
    outside = (u < 0, u > camera.width * z, v < 0, v > camera.height * z, z < eye.near)
    return not any(side.all() for side in outside)


def coarser_step(placed: Placed, eye: Eye) -> int:
    """1, 2, 4, ...: it is enough to draw every step-th pixel of a frame, as several fall into one pixel of the view.

    Measured at the nearest corner of the object's box, so that no part of it is drawn too coarsely. At least FEWEST
    pixels are left on each side of the frame.
    """
    view, corners, frame = np.linalg.inv(eye.pose), placed.main_corners, placed.content.frame
    depth = (corners @ view[:3, :3].T + view[:3, 3])[:, 2]
    nearest = float(depth.min()) if len(depth) else 0.0
    if nearest <= 0:
        return 1
    farthest = float(frame.main_corners[:, 2].max()) * placed.rigid_axes[1]
    spread = farthest / min(frame.camera.fx, abs(frame.camera.fy))  # between neighbours, world units, at most
    pixels = spread * max(eye.camera.fx, abs(eye.camera.fy)) / nearest
    most = min(MOST_COARSE, max(min(frame.depth.shape) // FEWEST, 1))
    return int(2 ** np.floor(np.log2(np.clip(1 / pixels, 1, most))))


def coarser_size(size: float, step: int) -> float:
    """A splat's size in pixels of a coarser frame: those on the rim reach as far as before."""
    return 1 + (size - 1) / step if size > 1 else size


def coarser(frame: Frame, step: int) -> Frame:
    """A frame of every step-th pixel, with all of its colours."""
    first, c = (step - 1) // 2, frame.camera
    depth = frame.depth[first::step, first::step]
    height, width = depth.shape
    camera = Camera(c.fx / step, c.fy / step, (c.cx - first) / step, (c.cy - first) / step, width, height)
    return Frame(frame.color, depth, camera, frame.pose)
