"""Mirror of shaders/common/splat_projection.glsl. Matrices are (n, 3, 3), a column of the shader's a column."""

from __future__ import annotations

import numpy as np

F = np.float32
BLUR, FAR_ASIDE, THIN, TURNED = F(0.3), F(1.3), F(1e-4), F(0.05)
ROOT_TWO = F(1.41421356)


def unpack_rotation(stored: np.ndarray) -> np.ndarray:
    """(n, 4), 0 to 1; (n, 4)"""
    bits = np.floor(F(255) * stored + F(0.5)).astype(np.uint32) @ (np.uint32(1) << np.array([0, 8, 16, 24], np.uint32))
    rest = ((bits[:, None] >> np.array([20, 10, 0], np.uint32) & 1023).astype(F) / F(1023) - F(0.5)) * ROOT_TWO
    own = np.sqrt(np.maximum(F(1) - (rest * rest).sum(1), F(0)))
    return np.stack([np.insert(row, k, one) for row, k, one in zip(rest, bits >> 30, own, strict=True)])


def quaternion_axes(q: np.ndarray) -> np.ndarray:
    """(n, 4); (n, 3, 3)"""
    x, y, z, w = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2).astype(F)


def picture_ways(seen: np.ndarray, intrinsics: np.ndarray, size: np.ndarray) -> np.ndarray:
    """(n, 3); (n, 3, 3)"""
    end, near = FAR_ASIDE * F(0.5) * size / np.abs(intrinsics[:2]), intrinsics[:2] / seen[:, 2:]
    slope = np.clip(seen[:, :2] / seen[:, 2:], -end, end)
    ways = np.zeros((len(seen), 3, 3), F)
    ways[:, 0, 0], ways[:, 1, 1], ways[:, 2, 2] = near[:, 0], near[:, 1], 1
    ways[:, 2, :2] = -near * slope
    return ways


def _squares(spread: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, _ = np.moveaxis(spread, -1, 0)
    return (x * x).sum(-1), (x * y).sum(-1), (y * y).sum(-1)


def seen_ellipse(spread: np.ndarray, opacity: np.ndarray, antialiased: np.ndarray) -> np.ndarray:
    """(n, 3, 3), (n,), (n,); (n, 4)"""
    xx, xy, yy = _squares(spread)
    area, first = (xx + BLUR) * (yy + BLUR) - xy * xy, np.sqrt(xx + BLUR)
    opacity = np.where(antialiased, opacity * np.sqrt(np.maximum(xx * yy - xy * xy, F(0)) / area), opacity)
    return np.stack([first, xy / first, np.sqrt(area) / first, opacity], -1)


def depth_slope(spread: np.ndarray) -> np.ndarray:
    """(n, 3, 3); (n, 2)"""
    xx, xy, yy = _squares(spread)
    deep_x, deep_y = (spread[..., 2:] * spread[..., :2]).sum(1).T
    least = THIN * (xx + yy) + F(1e-9)
    xx, yy = xx + least, yy + least
    found = np.stack([deep_x * yy - deep_y * xy, deep_y * xx - deep_x * xy], -1)
    return found / (xx * yy - xy * xy)[:, None]


def facing_viewer(normal: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(n, 3), (n, 3); (n, 3)"""
    away = (normal * seen).sum(1, keepdims=True) > TURNED * np.linalg.norm(seen, axis=1, keepdims=True)
    return np.where(away, -normal, normal)


def shine_towards(stored: np.ndarray, first: np.ndarray, count: int, range: float, way: np.ndarray) -> np.ndarray:
    """stored (h, w, 4), first (n, 2), way (n, 3); (n, 3)"""
    x, y, z = way.T
    xx, yy, zz = x * x, y * y, z * z
    shown = [
        -0.4886025119 * y, 0.4886025119 * z, -0.4886025119 * x, 1.0925484306 * x * y, -1.0925484306 * y * z,
        0.3153915653 * (2 * zz - xx - yy), -1.0925484306 * x * z, 0.5462742153 * (xx - yy),
        -0.5900435899 * y * (3 * xx - yy), 2.8906114426 * x * y * z, -0.4570457995 * y * (4 * zz - xx - yy),
        0.3731763326 * z * (2 * zz - 3 * xx - 3 * yy), -0.4570457995 * x * (4 * zz - xx - yy),
        1.4453057213 * z * (xx - yy), -0.5900435899 * x * (xx - 3 * yy),
    ]  # fmt: skip
    texels = np.stack([stored[first[:, 1], first[:, 0] + k, :3] for k in np.arange(count)], 1) if count else 0
    values = F(range) * (F(255) * texels - F(128)) / F(127)
    return np.einsum("kn,nkc->nc", np.stack(shown[:count]), values) if count else np.zeros((len(way), 3), F)
