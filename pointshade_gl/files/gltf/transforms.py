"""Converts transforms of glTF nodes: a matrix in columns, or translation, rotation and scale; ours are matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .checks import numbers
from .views import Matrix

if TYPE_CHECKING:
    from pygltflib import Node as GltfNode


def local_matrix(node: GltfNode) -> Matrix:
    """(4, 4) node-to-parent. Raises ValueError for numbers that are not a transform."""
    if node.matrix is not None:
        return numbers(node.matrix, (4, 4), "matrix").T  # glTF writes columns
    result = np.eye(4)
    if node.rotation is not None:
        result[:3, :3] = _rotation(numbers(node.rotation, (4,), "rotation"))
    if node.scale is not None:
        result[:3, :3] *= numbers(node.scale, (3,), "scale")
    if node.translation is not None:
        result[:3, 3] = numbers(node.translation, (3,), "translation")
    return result


def _rotation(quaternion: Matrix) -> Matrix:
    """(3, 3) of (x, y, z, w) of any length but zero."""
    length = np.linalg.norm(quaternion)
    if length < 1e-12:
        raise ValueError("rotation must be a quaternion of unit length, got (0, 0, 0, 0)")
    x, y, z, w = quaternion / length
    return np.array([
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    ])  # fmt: skip


def transform_of(matrix: Matrix) -> dict[str, list[float]]:
    """translation, rotation and scale if they are the same as the matrix, else the matrix."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    turn = matrix[:3, :3] / scale
    if np.abs(turn.T @ turn - np.eye(3)).max() > 1e-12 or np.linalg.det(turn) < 0:
        return {"matrix": matrix.T.ravel().tolist()}
    scale[np.abs(scale - 1) < 1e-12] = 1
    parts = {
        "translation": (matrix[:3, 3], (0, 0, 0)),
        "rotation": (_quaternion(turn), (0, 0, 0, 1)),
        "scale": (scale, (1, 1, 1)),
    }
    return {name: value.tolist() for name, (value, usual) in parts.items() if not np.array_equal(value, usual)}


def _quaternion(turn: Matrix) -> Matrix:
    """(x, y, z, w) of a rotation, by the largest of the four (Shepperd 1978)."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    squares = np.array([1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i])
    rows = np.array([
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    ])  # fmt: skip
    row = rows[int(np.argmax(squares))]
    return row / np.linalg.norm(row)
