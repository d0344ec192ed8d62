"""Point clouds of known surfaces: a sphere, a torus, a box, stairs; noisy, uneven, with stray points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

OUTLIERS = 0.02


class Cloud(NamedTuple):
    """Points with the normals of the surface they were taken from.

    edge     (n,) how far from a sharp edge each is, spacings
    genuine  (n,) False for stray points
    """

    positions: np.ndarray
    normals: np.ndarray
    edge: np.ndarray
    genuine: np.ndarray
    spacing: float


def cloud(shape: str, count: int, seed: int, noise: float = 0.0, uneven: bool = False, stray: bool = False) -> Cloud:
    """noise: standard deviation, spacings. uneven: ten times as many points at one end. stray: in a box around it."""
    rng = np.random.default_rng(seed)
    positions, normals, area = SHAPES[shape](8 * count if uneven else count, rng)
    if uneven:
        x = positions[:, 0]
        share = (x - x.min()) / np.ptp(x)
        kept = np.flatnonzero(rng.random(len(x)) < 0.1 + 0.9 * share)[:count]
        positions, normals = positions[kept], normals[kept]
    spacing = float(np.sqrt(area / count))
    edge = EDGES.get(shape, far_from_edges)(positions) / spacing
    genuine = np.ones(count, bool)
    positions = positions + noise * spacing * rng.normal(size=positions.shape)
    if stray:
        genuine[rng.choice(count, int(OUTLIERS * count), replace=False)] = False
        low, high = positions.min(0), positions.max(0)
        margin = 0.1 * (high - low)
        positions[~genuine] = rng.uniform(low - margin, high + margin, (int((~genuine).sum()), 3))
    return Cloud(positions.astype(np.float32), normals, edge, genuine, spacing)


def angles(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Degrees between normals of either side; 90 where none was found."""
    return np.degrees(np.arccos(np.clip(np.abs((np.nan_to_num(found) * true).sum(-1)), 0, 1)))


def sphere(count, rng):
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return v, v.copy(), 4 * np.pi


def torus(count, rng, large=1.0, small=0.4):
    u, v = rng.uniform(0, 2 * np.pi, (2, 3 * count))
    kept = np.flatnonzero(rng.uniform(0, large + small, len(u)) < large + small * np.cos(v))[:count]
    u, v = u[kept], v[kept]
    normals = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], -1)
    middle = large * np.stack([np.cos(u), np.sin(u), 0 * u], -1)
    return middle + small * normals, normals, 4 * np.pi**2 * large * small


def box(count, rng, side=2.0):
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    positions, normals = rng.uniform(-side / 2, side / 2, (count, 3)), np.zeros((count, 3))
    positions[np.arange(count), axis], normals[np.arange(count), axis] = sign * side / 2, sign
    return positions, normals, 6 * side**2


def box_edges(positions, side=2.0):
    return np.sort(side / 2 - np.abs(positions), axis=1)[:, 1]


def stairs(count, rng, steps=6, width=2.0, depth=0.3, height=0.2):
    """An open sheet: treads face up (z), risers to the front (-y)."""
    step, along = rng.integers(0, steps, count), rng.uniform(0, width, count)
    is_tread, within = rng.random(count) < depth / (depth + height), rng.random(count)
    y = depth * (step + is_tread * within)
    z = height * (step + np.where(is_tread, 1, within))
    normals = np.where(is_tread[:, None], (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    return np.stack([along, y, z], -1), normals, steps * width * (depth + height)


def stairs_edges(positions, steps=6, depth=0.3, height=0.2):
    _, y, z = positions.T
    lines = [(k, k + 1) for k in range(steps)] + [(k, k) for k in range(1, steps)]
    return np.min([np.hypot(y - depth * a, z - height * b) for a, b in lines], axis=0)


def far_from_edges(positions):
    return np.full(len(positions), np.inf)


SHAPES = {"sphere": sphere, "torus": torus, "box": box, "stairs": stairs}
EDGES = {"box": box_edges, "stairs": stairs_edges}
