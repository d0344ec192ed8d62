"""Small point clouds with known normals, and their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pointshade_gl as ps


def ball(count: int = 3000, radius: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> ps.PointCloud:
    """Points all over a ball, evenly, in its red half red and in the other blue; z is up."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z**2)
    unit = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)
    colors = np.where(unit[:, :1] < 0, [[200, 30, 30]], [[30, 30, 200]]).astype(np.uint8)
    return ps.PointCloud((radius * unit + at).astype(np.float32), colors=colors, up="z")


def write_ball(path: Path, **given: object) -> Path:
    """The points of a ball, without normals, as a .ply."""
    ps.save_points(path, ball(**given))  # type: ignore[arg-type]
    return path
