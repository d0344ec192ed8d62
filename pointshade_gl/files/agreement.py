"""Do the views agree? Points of one frame, carried into another by their poses, must meet the depth that is there.

That tells what no file says: whether poses lead to the world or from it, whose axes they use, whether a picture is
mirrored (a negative fy that is written nowhere), how many units a metre has. Nothing is changed unless the given
reading fails where another one holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..frame import Frame
from .pose_files import inverted
from .transforms import OPENGL

# What others call right, down and ahead: matrices from OpenCV's axes to theirs.
AXES = {
    "opencv": np.eye(4),
    "opengl": OPENGL,
    "north, east, down": np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),  # AirSim, TartanAir
    "forward, left, up": np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),  # ROS bodies
}
AGREES = 0.03  # of the depth, in the median: poses off by a few centimetres, sensors, splats
FAILS = 0.08
_BETTER = 0.4  # another reading must leave less than this share of the error
_POINTS = 4000  # of a view
_SEEN = 0.15  # of them must lie in the other view
_SCALES = (1 / 5, 1000 / 6553.5, 1 / 4, 1 / 10, 1000 / 256, 10.0)  # of depth taken as millimetres: 5000, 6553.5, ...


@dataclass(frozen=True)
class Reading:
    """How poses and cameras are to be understood: as they are written, or in one of the other ways that people write.

    to_world    the pose is camera-to-world
    axes        of the camera that the pose means, one of AXES
    mirrored    fy has the other sign
    scale       the depth is to be multiplied by this
    pose_scale  the places of the poses are to be multiplied by this
    """

    to_world: bool = True
    axes: str = "opencv"
    mirrored: bool = False
    scale: float = 1.0
    pose_scale: float = 1.0

    def pose(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4, 4) camera-to-world in OpenCV axes of a pose as it is written."""
        pose = (pose if self.to_world else inverted(pose[None])[0]) @ AXES[self.axes]
        pose[:3, 3] *= self.pose_scale
        return pose

    def camera(self, camera: Camera) -> Camera:
        return replace(camera, fy=-camera.fy) if self.mirrored else camera

    def __str__(self) -> str:
        said = [
            "" if self.to_world else "poses lead from the world to the camera",
            "" if self.axes == "opencv" else f"the poses' cameras have the axes of {self.axes}",
            "fy is negative" if self.mirrored else "",
            "" if self.scale == 1 else f"a metre has {1000 / self.scale:g} depth units",
            "" if self.pose_scale == 1 else f"the poses are {self.pose_scale:.4g} times as large",
        ]
        return ", ".join(part for part in said if part) or "as written"


class Finding(NamedTuple):
    """The reading under which the views agree best, and the median error of both as a share of the depth."""

    reading: Reading
    error: float
    error_as_written: float


def find_reading(frames: Sequence[Frame], may_scale: bool) -> Finding | None:
    """How the poses of a few overlapping frames are to be understood; None if they show nothing.

    may_scale  the units of the depth were guessed, so that another scale may be right
    """
    pairs = [(frames[k], frames[k + 1]) for k in range(len(frames) - 1) if _moved(frames[k].pose, frames[k + 1].pose)]
    if not pairs:
        return None
    written = _error(pairs, Reading())
    if written < AGREES:
        return Finding(Reading(), written, written)
    scales = (1.0, *_SCALES) if may_scale else (1.0,)
    others = [
        Reading(to_world, axes, mirrored, scale)
        for scale in scales
        for mirrored in (False, True)
        for axes in AXES
        for to_world in (True, False)
    ]
    # the fewer changes the better where several fit alike
    errors = [(_error(pairs, one), one) for one in others[1:]]
    least = min(error for error, _ in errors)
    error, best = next((error, one) for error, one in errors if error <= 1.1 * least)
    if error < AGREES and error < _BETTER * written:
        return Finding(best, error, written)
    return Finding(Reading(), written, written) if written < 1 else None


def _moved(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether two poses differ enough to tell one reading from another."""
    return bool(np.isfinite(a).all() and np.isfinite(b).all() and abs(a - b).max() > 0.01)


def _error(pairs: Sequence[tuple[Frame, Frame]], reading: Reading) -> float:
    return float(np.mean([_error_of(a, b, reading) for a, b in pairs]))


def _error_of(a: Frame, b: Frame, reading: Reading) -> float:
    """The median difference of the depths where both see the same, as a share of the depth; 1 without overlap."""
    step = max(1, int((a.depth.size / _POINTS) ** 0.5))
    v, u = np.mgrid[0 : a.depth.shape[0] : step, 0 : a.depth.shape[1] : step]
    z = a.depth[::step, ::step] * reading.scale
    u, v, z = (part[z > 0] for part in (u, v, z))
    from_camera, to_camera = reading.camera(a.camera), reading.camera(b.camera)
    x, y = (u - from_camera.cx) / from_camera.fx * z, (v - from_camera.cy) / from_camera.fy * z
    relative = inverted(reading.pose(b.pose)[None])[0] @ reading.pose(a.pose)
    x, y, far = relative[:3, :3] @ np.array([x, y, z]) + relative[:3, 3:]
    with np.errstate(all="ignore"):
        column = np.rint(to_camera.fx * x / far + to_camera.cx)
        row = np.rint(to_camera.fy * y / far + to_camera.cy)
        inside = (far > 0) & (column >= 0) & (column < to_camera.width) & (row >= 0) & (row < to_camera.height)
    there = b.depth[row[inside].astype(int), column[inside].astype(int)] * reading.scale
    known = there > 0
    if known.sum() < _SEEN * len(z):
        return 1.0
    return float(min(1.0, np.median(abs(far[inside][known] / there[known] - 1))))
