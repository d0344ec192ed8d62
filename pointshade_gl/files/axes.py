"""Poses in other conventions: OpenGL's camera axes, and quaternions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # y up and z backwards, to ours and back


@np.errstate(invalid="ignore", over="ignore")  # (0, 0, 0, 0) becomes NaN, which the check of poses refuses
def pose_from_quaternion(place: Sequence[float], quaternion: Sequence[float]) -> NDArray[np.float64]:
    """(4, 4) from a place x, y, z and a rotation qx, qy, qz, qw of any length."""
    x, y, z, w = np.asarray(quaternion, np.float64) / np.linalg.norm(quaternion)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = place
    return pose
