"""Finds out which pose convention a file uses: points of one frame, projected into another, must meet its depth.

That shows what no file says: whether poses lead to the world or from it, whose axes they use, whether a picture is
mirrored (a negative fy that is written nowhere), how many units a metre has. Nothing is changed unless the given
reading fails where another one holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.camera import AXES, Camera, inverted
from ...scene.frame import Frame

_SURE = 0.005  # of the depth, in the median: no other reading can be much better
AGREES = 0.03  # poses off by a few centimetres, noise of sensors
FAILS = 0.08
_BETTER = 0.4  # another reading must leave less than this share of the error
_POINTS = 4000  # of a view
_SEEN = 0.15  # of them must lie in the other view
_SCALES = (1 / 5, 1000 / 6553.5, 1 / 4, 1 / 10, 1000 / 256, 10.0)  # of depth taken as millimetres: 5000, 6553.5, ...


@dataclass(frozen=True)
class Reading:
    """How poses and cameras are to be understood: as they are written, or in another convention that programs use.

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
        """Convert a pose as it is written to (4, 4) camera-to-world in OpenCV axes."""
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


def find_reading(frames: Sequence[Frame], may_scale: bool, metric_poses: bool) -> Finding | None:
    """Return how the poses of a few overlapping frames are to be understood; None if they do not show it.

    may_scale     the units of the depth were guessed, so that another scale may be right
    metric_poses  the unit of the poses is the metre; else it is fitted to the depth
    """
    pairs = [(frames[k], frames[k + 1]) for k in range(len(frames) - 1) if _moved(frames[k].pose, frames[k + 1].pose)]
    if not pairs:
        return None
    written = _error(pairs, Reading())
    if written < _SURE:
        return Finding(Reading(), written, written)
    scales = _SCALES if may_scale and metric_poses else ()
    errors = [(_error(pairs, one), one) for one in _readings((1.0, *scales))]
    least = min(error for error, _ in errors)
    # of those that fit alike the one with the fewest changes, which comes first
    error, best = next((error, one) for error, one in errors if error <= 1.1 * least)
    if error > AGREES and not metric_poses:
        error, best = _fit_pose_scale(pairs)
    if error < AGREES and error < _BETTER * written:
        return Finding(best, error, written)
    return Finding(Reading(), written, written) if written < 1 else None


def _readings(scales: Sequence[float]) -> list[Reading]:
    """Return all conventions of poses and cameras, those with the fewest changes first."""
    return [
        Reading(to_world, axes, mirrored, scale)
        for scale in scales
        for mirrored in (False, True)
        for axes in AXES
        for to_world in (True, False)
    ]


def _fit_pose_scale(pairs: Sequence[tuple[Frame, Frame]]) -> tuple[float, Reading]:
    """Return the error of the reading that fits best with a factor on the positions of the poses, and that reading."""
    readings = [Reading(to_world, axes) for axes in AXES for to_world in (True, False)]
    step = 1.25
    for smaller, larger in ((37, 18), (6, 6), (6, 6), (6, 6)):  # 1/3850 (millimetres) to 55 times, then finer and finer
        factors = [step**k for k in range(-smaller, larger + 1)]
        tried = [replace(one, pose_scale=one.pose_scale * factor) for one in readings for factor in factors]
        error, best = min(((_error(pairs, one), one) for one in tried), key=lambda found: found[0])
        readings, step = [best], step ** (1 / 5)
    return error, best


def _moved(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Return whether two poses differ enough to distinguish one reading from another."""
    return bool(np.isfinite(a).all() and np.isfinite(b).all() and abs(a - b).max() > 0.01)


def _error(pairs: Sequence[tuple[Frame, Frame]], reading: Reading) -> float:
    return float(np.mean([_error_of(a, b, reading) for a, b in pairs]))


def _error_of(a: Frame, b: Frame, reading: Reading) -> float:
    """Return the median difference of the depths where both see the same, share of the depth; 1 without overlap."""
    step = max(1, int((a.depth.size / _POINTS) ** 0.5))
    v, u = np.mgrid[0 : a.depth.shape[0] : step, 0 : a.depth.shape[1] : step]
    z = a.depth[::step, ::step] * reading.scale
    u, v, z = (part[z > 0] for part in (u, v, z))
    from_camera, to_camera = reading.camera(a.camera), reading.camera(b.camera)
    x, y = from_camera.ray_at(u, v)
    relative = inverted(reading.pose(b.pose)[None])[0] @ reading.pose(a.pose)
    x, y, far = relative[:3, :3] @ np.array([x * z, y * z, z]) + relative[:3, 3:]
    with np.errstate(all="ignore"):
        column, row = (np.rint(part) for part in to_camera.pixel_at(x, y, far))
        inside = (far > 0) & (column >= 0) & (column < to_camera.width) & (row >= 0) & (row < to_camera.height)
    there = b.depth[row[inside].astype(int), column[inside].astype(int)] * reading.scale
    known = there > 0
    if known.sum() < _SEEN * len(z):
        return 1.0
    return float(min(1.0, np.median(abs(far[inside][known] / there[known] - 1))))
