"""Mirror of shaders/common/cloud_planes.glsl, for n points at once."""

from __future__ import annotations

import numpy as np

from .cloud_moments import Moments, inner

F = np.float32
LEAST_NEIGHBOURS = F(6)
THICKEST, FARTHEST, ROUNDEST, NARROWEST = F(0.3), F(0.35), F(0.4), F(0.03)
FEW, LINE, THICK = F(0), F(1), F(2)


def principal_variances(squares: np.ndarray, products: np.ndarray) -> np.ndarray:
    mean = squares.sum(-1) / F(3)
    rest = squares - mean[:, None]
    spread = np.sqrt(np.maximum(inner(rest, rest) + F(2) * inner(products, products), F(0)) / F(6))
    some = spread > 1e-12
    safe = np.where(some, spread, F(1))[:, None]
    rest, p = rest / safe, products / safe
    determinant = rest.prod(-1) + F(2) * p.prod(-1) - inner(rest, p * p)
    angle = np.arccos(np.clip(F(0.5) * determinant, F(-1), F(1))) / F(3)
    most = mean + F(2) * spread * np.cos(angle)
    least = mean + F(2) * spread * np.cos(angle + F(2.0943951))
    return np.where(some[:, None], np.stack([least, F(3) * mean - most - least, most], -1), mean[:, None])


def principal_axis(squares: np.ndarray, products: np.ndarray, variance: np.ndarray) -> np.ndarray:
    s, (x, y, z) = squares - variance[:, None], products.T
    rows = [np.stack(row, -1) for row in ((s[:, 0], z, y), (z, s[:, 1], x), (y, x, s[:, 2]))]
    crosses = np.stack([np.cross(rows[a], rows[b]) for a, b in ((0, 1), (1, 2), (2, 0))])
    sizes = (crosses * crosses).sum(-1)
    which, at = sizes.argmax(0), np.arange(len(squares))
    size = sizes[which, at][:, None]
    return np.where(size > 1e-30, crosses[which, at] / np.sqrt(np.maximum(size, F(1e-30))), F(0))


def fit_plane(m: Moments) -> np.ndarray:
    weight = np.maximum(m.weight, F(1e-20))[:, None]
    mean = m.offset / weight
    squares = m.squares / weight - mean * mean
    products = m.products / weight - mean[:, [1, 2, 0]] * mean[:, [2, 0, 1]]
    variances = principal_variances(squares, products)
    n = principal_axis(squares, products, variances[:, 0])
    across = inner(n * n, squares) + F(2) * inner(n[:, [1, 2, 0]] * n[:, [2, 0, 1]], products)
    thickness, offset = np.sqrt(np.maximum(across, F(0))), inner(n, mean)
    is_blob = (thickness > THICKEST) | (variances[:, 0] > ROUNDEST * variances[:, 1])
    reason = np.where(is_blob | (np.abs(offset) > FARTHEST), THICK, F(-1))
    reason = np.where(variances[:, 1] < NARROWEST * variances[:, 2], LINE, reason)
    reason = np.where(m.plain[:, 3] < LEAST_NEIGHBOURS, FEW, reason)
    plane = np.concatenate([n * (F(1) + thickness)[:, None], offset[:, None]], -1)
    none = np.concatenate([np.zeros_like(n), reason[:, None]], -1)
    return np.where(reason[:, None] < 0, plane, none)


def lean_of(m: Moments, plane: np.ndarray) -> np.ndarray:
    mean, n = m.plain[:, :3] / np.maximum(m.plain[:, 3:], F(1)), plane[:, :3]
    aside = mean - n * (inner(n, mean) / np.maximum(inner(n, n), F(1e-20)))[:, None]
    return np.concatenate([aside, m.plain[:, 3:]], -1)
