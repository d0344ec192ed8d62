"""Poses of several frames at once: normal equations over pairs of them, and which motions nothing fixes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

NOISE_SHARE = 10.0  # times what noise alone adds to the equations must be there before a motion counts as fixed
LEAST_FIXED = 0.1  # share of an equation's weight along a motion that must be more than noise
Matrix = NDArray[np.float64]
Floats = NDArray[np.floating]


class Equations(NamedTuple):
    """What residuals of one pair of frames say about a motion of the first, (turns * radius, shift), world axes."""

    matrix: Matrix  # (6, 6)
    vector: Matrix  # (6,)
    noise: Matrix  # (6, 6) what noise alone would add to the matrix


def pair_equations(
    points: Matrix, directions: Floats, residuals: Floats, weights: Matrix, noise: Floats, radius: float
) -> Equations:
    """Return the equations of residuals that grow as a point moves along a direction.

    points      (n, 3) relative to the scene's middle
    directions  (n, 3) derivatives of the residuals
    residuals   (n,) and weights (n,): the weighted squares are to be least
    noise       (n,) variance of each direction's components
    radius      of the scene: turns count as the way of a point so far from the middle
    """
    arms = np.hstack([np.cross(points, directions) / radius, directions])
    weighted = arms * weights[:, None]
    return Equations(weighted.T @ arms, weighted.T @ residuals, _noise_matrix(points / radius, weights * noise))


def _noise_matrix(points: Matrix, weights: Matrix) -> Matrix:
    """Return the sum of weights times A A^T, A = [[p]x; 1]: what directions of random noise add to the equations."""
    total, first = weights.sum(), weights @ points
    second = (points * weights[:, None]).T @ points
    cross = np.array([[0, -first[2], first[1]], [first[2], 0, -first[0]], [-first[1], first[0], 0]])
    result = np.empty((6, 6))
    result[:3, :3] = np.trace(second) * np.eye(3) - second
    result[:3, 3:], result[3:, :3] = cross, cross.T
    result[3:, 3:] = total * np.eye(3)
    return result


class Joint:
    """The equations of all frames: of the geometry and of the colours, each with its noise."""

    def __init__(self, count: int):
        self.count = count
        self.matrices = np.zeros((2, 6 * count, 6 * count))
        self.noises = np.zeros((2, 6 * count, 6 * count))
        self.vector = np.zeros(6 * count)

    def add(self, i: int, j: int, kind: int, found: Equations) -> None:
        """Add what residuals of frame i in frame j say. kind: 0 of the geometry, 1 of the colours."""
        at, other = slice(6 * i, 6 * i + 6), slice(6 * j, 6 * j + 6)
        for sums, block in ((self.matrices[kind], found.matrix), (self.noises[kind], found.noise)):
            sums[at, at] += block
            sums[other, other] += block
            sums[at, other] -= block
            sums[other, at] -= block
        self.vector[at] += found.vector
        self.vector[other] -= found.vector

    def solved(self, free: NDArray[np.bool_]) -> tuple[Matrix, Matrix]:
        """Return (count, 6) steps of the frames that are free to move, and (n, count, 6) motions that nothing fixes.

        free  (count,) which frames may move
        """
        some = np.repeat(free, 6)
        matrices, noises = (sums[:, some][:, :, some] for sums in (self.matrices, self.noises))
        steps, loose = solved_motions(matrices, noises, self.vector[some])
        result, motions = np.zeros(6 * self.count), np.zeros((len(loose), 6 * self.count))
        result[some], motions[:, some] = steps, loose
        return result.reshape(-1, 6), motions.reshape(-1, self.count, 6)


def solved_motions(matrices: Matrix, noises: Matrix, vector: Matrix) -> tuple[Matrix, Matrix]:
    """Return the step that solves the equations along all motions that they fix, (n,), and the others, (m, n).

    Noise in normals and slopes fills the equations along motions that it cannot fix, such as sliding along a plane:
    what it adds is known, and what exceeds it must be a tenth of the whole.

    matrices  (2, n, n) of the geometry and the colours; noises the same of noise alone
    vector    (n,)
    """
    whole = matrices.sum(0)
    scale = max(float(np.trace(whole)) / max(len(whole), 1), 1e-300)
    informed = sum(_positive(one - NOISE_SHARE * noise) for one, noise in zip(matrices, noises, strict=True))
    lower = np.linalg.cholesky(whole + 1e-9 * scale * np.eye(len(whole)))
    inverse = np.linalg.inv(lower)
    shares, basis = np.linalg.eigh(inverse @ informed @ inverse.T)
    motions = basis.T @ inverse  # rows, of which each is a unit of the whole
    is_fixed = shares >= LEAST_FIXED
    fixed = motions[is_fixed]
    return -fixed.T @ (fixed @ vector), motions[~is_fixed]


def _positive(matrix: Matrix) -> Matrix:
    """Return the matrix with its negative eigenvalues set to 0."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors * np.maximum(values, 0)) @ vectors.T


def motion_matrix(step: Matrix, radius: float) -> Matrix:
    """Return the (4, 4) motion of a step (6,): a turn about the middle by its first three over the radius, a shift."""
    turn, result = step[:3] / radius, np.eye(4)
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / max(angle, 1e-300)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    result[:3, :3] += np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
    result[:3, 3] = step[3:]
    return result


def motion_of(pose: Matrix, given: Matrix, radius: float) -> Matrix:
    """Return the step (6,) whose motion leads from one pose to another, both (4, 4) and about the middle."""
    turn = pose[:3, :3] @ given[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, (np.trace(turn) - 1) / 2))
    return np.concatenate([axis * (radius * angle / max(sine, 1e-300)), pose[:3, 3] - turn @ given[:3, 3]])
