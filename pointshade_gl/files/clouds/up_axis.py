"""Guesses which axis of a cloud points up, where its file does not say so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.cloud import Up
from .placing import main_box

_FLAT = 0.4  # of both other sides is the height of a terrain or a street, at most
_SAMPLE = 60_000  # points whose planes are looked at
_CELLS = 24  # of the longest side
_FEWEST = 6  # points of a cell that show its plane
_PLANES = 30  # that must be there to decide
_THIN = 0.15  # of its width is the thickness of such a plane
_UPRIGHT = np.cos(np.radians(10))
_CLEAR = 0.3  # of the planes face along one axis
_AHEAD = 1.5  # times as many as along the next
_WIDEST = 1.2  # slope of a camera's rays, which see up to 100 degrees
_DEEP = 0.1  # of the farthest point's distance lies between the nearest and it: a terrain from above has less
_RANDOM = 7  # seed


def guess_up(positions: NDArray[np.floating], is_far: bool) -> tuple[Up, str]:
    """Which axis points up, and why. is_far: the positions are those of a map, where z is the height."""
    if is_far:
        return "z", "its coordinates are those of a map"
    if len(positions) < _FEWEST:
        return "y", "nothing shows it"
    low, high = main_box(positions)
    sides = high - low
    least, middle = np.argsort(sides)[:2]
    if least != 0 and sides[least] < _FLAT * sides[middle]:
        return _directed("xyz"[least], positions, least), "it is least high there"
    normals = _planes(positions, low, sides.max())
    votes = (np.abs(normals) > _UPRIGHT).mean(0) if len(normals) >= _PLANES else np.zeros(3)
    first = int(np.argmax(votes[1:])) + 1
    if votes[first] > _CLEAR and votes[first] > _AHEAD * np.delete(votes, first).max():
        return _directed("xyz"[first], positions, first), "most of its planes lie level so"
    return "y", "nothing shows it"


def is_before_camera(positions: NDArray[np.floating]) -> bool:
    """Whether all points lie in the view of a camera at the origin that looks along z, as those of depth cameras do."""
    some = positions[:: -(-len(positions) // _SAMPLE)] if len(positions) else positions
    some = some[np.isfinite(some).all(1)].astype(np.float64)
    if len(some) < _FEWEST or some[:, 2].min() <= 0:
        return False
    slopes = np.abs(some[:, :2] / some[:, 2:])
    return bool(slopes.max() < _WIDEST and np.ptp(some[:, 2]) > _DEEP * some[:, 2].max())


def _directed(axis: str, positions: NDArray[np.floating], k: int) -> Up:
    """The axis with its sign. y points down where most points lie in its upper half, as ground does; z never does."""
    if axis == "z":
        return "z"
    some = positions[:: -(-len(positions) // _SAMPLE), k].astype(np.float64)
    low, middle, high = np.quantile(some, (0.02, 0.5, 0.98))
    return "-y" if high - middle < 0.5 * (middle - low) else "y"


def _planes(positions: NDArray[np.floating], low: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """(m, 3) unit normals of the cells of a coarse grid in which the points lie in a plane."""
    chosen = np.random.default_rng(_RANDOM).integers(0, len(positions), min(_SAMPLE, len(positions)))
    some = (positions[chosen] - low) / (size or 1.0) * _CELLS
    some = some[(np.abs(some) < 2 * _CELLS).all(1)]
    cells = np.floor(some).astype(np.int64)
    _, cell, counts = np.unique(cells @ np.array([1, 10**3, 10**6]), return_inverse=True, return_counts=True)
    middle = np.stack([np.bincount(cell, some[:, k], len(counts)) for k in range(3)], -1) / counts[:, None]
    away = some - middle[cell]
    products = [
        np.bincount(cell, away[:, i] * away[:, j], len(counts))
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    ]
    enough = counts >= _FEWEST
    xx, xy, xz, yy, yz, zz = (one[enough] for one in products)
    values, vectors = np.linalg.eigh(np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(-1, 3, 3))
    is_flat = (values[:, 0] < _THIN**2 * values[:, 1]) & (values[:, 1] > 0)
    return vectors[is_flat, :, 0]
