"""Rotations and 4x4 matrices: quaternions both ways, points moved by a matrix, and the checks that all share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array

Matrix = NDArray[np.float64]


def rotation_of(quaternions: Matrix) -> Matrix:
    """Return the rotations, (..., 3, 3), of unit quaternions x, y, z, w, (..., 4)."""
    x, y, z, w = np.moveaxis(quaternions, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


def quaternion_of(rotation: Matrix) -> Matrix:
    """Return the unit quaternion x, y, z, w of a rotation (3, 3), w >= 0.

    It is found from the largest of the four, which loses no digits (Shepperd 1978).
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation
    squares = np.array([1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i])
    rows = np.array([
        (squares[0], b + d, c + g, h - f),
        (b + d, squares[1], f + h, c - g),
        (c + g, f + h, squares[2], d - b),
        (h - f, c - g, d - b, squares[3]),
    ])  # fmt: skip
    row = rows[int(np.argmax(squares))]
    return (row if row[3] >= 0 else -row) / np.linalg.norm(row)


def is_rotation(matrix: Matrix, tolerance: float) -> bool:
    """Return whether a (3, 3) matrix neither stretches, shears nor mirrors."""
    return is_orthogonal(matrix, tolerance) and np.linalg.det(matrix) > 0


def is_orthogonal(matrix: Matrix, tolerance: float) -> bool:
    """Return whether a (3, 3) matrix is a rotation or mirrors one: its columns have length 1 and right angles."""
    return bool(np.abs(matrix.T @ matrix - np.eye(3)).max() <= tolerance)


def check_matrix(value: Any, name: str) -> Matrix:
    """Return the value as a new (4, 4) float64 array.

    Raises TypeError for anything but numbers, ValueError for another shape and for numbers that are not finite.
    """
    matrix = as_array(value, f"{name} must be numbers of shape (4, 4)")
    if matrix.shape != (4, 4):
        raise ValueError(f"{name} must have shape (4, 4), got {matrix.shape}")
    if unknown := np.count_nonzero(~np.isfinite(matrix)):
        raise ValueError(f"{name} must be finite, got {unknown} NaN or infinite entries")
    if np.abs(matrix).max() > LARGEST:
        raise ValueError(f"{name} must be finite, its translation below {LARGEST:g}, got {np.abs(matrix).max():g}")
    return matrix


def moved(points: Matrix, matrix: NDArray[Any]) -> Matrix:
    """Return points (..., 3) after a (4, 4) matrix."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]
