"""Converts transforms of glTF nodes: a matrix in columns, or translation, rotation and scale; ours are matrices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...scene.camera import is_rotation, quaternion_of, rotation_of
from .cameras_and_lights import Matrix
from .checks import numbers


def local_matrix(node: SimpleNamespace) -> Matrix:
    """(4, 4) node-to-parent. Raises ValueError for numbers that are not a transform."""
    if node.matrix is not None:
        return numbers(node.matrix, (4, 4), "matrix").T  # glTF writes columns
    result = np.eye(4)
    if node.rotation is not None:
        result[:3, :3] = turn_of(node.rotation)
    if node.scale is not None:
        result[:3, :3] *= numbers(node.scale, (3,), "scale")
    if node.translation is not None:
        result[:3, 3] = numbers(node.translation, (3,), "translation")
    return result


def turn_of(rotation: Any) -> Matrix:
    """(3, 3) of a quaternion x, y, z, w of any length but zero. Raises ValueError."""
    quaternion = numbers(rotation, (4,), "rotation")
    length = np.linalg.norm(quaternion)
    if length < 1e-12:
        raise ValueError("rotation must be a quaternion of unit length, got (0, 0, 0, 0)")
    return rotation_of(quaternion / length)


def transform_of(matrix: Matrix) -> dict[str, list[float]] | None:
    """translation, rotation and scale that make the matrix; None of a shear, which glTF has not."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror
        scale[2] *= -1
    turn = matrix[:3, :3] / scale
    if not is_rotation(turn, 1e-12):
        return None
    scale[np.abs(scale - 1) < 1e-12] = 1
    parts = {
        "translation": (matrix[:3, 3], (0, 0, 0)),
        "rotation": (quaternion_of(turn), (0, 0, 0, 1)),
        "scale": (scale, (1, 1, 1)),
    }
    return {name: value.tolist() for name, (value, usual) in parts.items() if not np.array_equal(value, usual)}


def unsheared(matrix: Matrix) -> tuple[Matrix, Matrix]:
    """Return the matrices of a node and of one below it, both without a shear, whose product is the matrix."""
    left, scale, right = np.linalg.svd(matrix[:3, :3])
    for turn, axis in ((left, np.s_[:, 2]), (right, np.s_[2])):
        if np.linalg.det(turn) < 0:
            turn[axis] *= -1
            scale[2] *= -1
    above, below = np.array(matrix), np.eye(4)
    above[:3, :3], below[:3, :3] = left * scale, right
    return above, below
