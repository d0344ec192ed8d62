"""Converts camera poses: axes of OpenGL, AirSim and ROS, quaternions, rows of a matrix, world-to-camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .rotation import rotation_of

Matrices = NDArray[np.float64]  # (n, 4, 4)

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # y up and z backwards, to ours and back
# What others call right, down and ahead: matrices from OpenCV's axes to theirs.
AXES = {
    "opencv": np.eye(4),
    "opengl": OPENGL,
    "north, east, down": np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),  # AirSim, TartanAir
    "forward, left, up": np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),  # ROS bodies
}


def from_matrices(rows: NDArray[np.float64]) -> Matrices:
    """(n, 4, 4) from rows of 12 or 16 numbers."""
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, : rows.shape[1] // 4] = rows.reshape(len(rows), -1, 4)
    return poses


@np.errstate(invalid="ignore", over="ignore", divide="ignore")  # (0, 0, 0, 0) becomes NaN, which the check refuses
def from_quaternions(places: NDArray[np.float64], turns: NDArray[np.float64]) -> Matrices:
    """(n, 4, 4) from (n, 3) x y z and (n, 4) qx qy qz qw of any length."""
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, :3] = rotation_of(turns / np.linalg.norm(turns, axis=1, keepdims=True))
    poses[:, :3, 3] = places
    return poses


@np.errstate(invalid="ignore", over="ignore")
def inverted(poses: Matrices) -> Matrices:
    """(n, 4, 4) of rigid poses the other way round; those that are not finite become NaN."""
    turns = poses[:, :3, :3].transpose(0, 2, 1)
    result = np.tile(np.eye(4), (len(poses), 1, 1))
    result[:, :3, :3] = turns
    result[:, :3, 3] = -np.einsum("nij,nj->ni", turns, poses[:, :3, 3])
    return result
