"""How close a picture comes to the ray-traced truth: PSNR away from edges, holes, spill, outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.camera import Camera, moved
from .tracing import NEIGHBOURS, Hits

SAME_DEPTH = 0.01  # two depths that differ by less than this share belong to one surface
TOGETHER = 1 << 22  # pairs of pixels that are compared at once


@dataclass(frozen=True)
class PictureScore:
    """Scores of one picture.

    psnr   dB, of the drawn pixels that the source saw, more than 2 pixels away from any edge of a surface
    holes  share of the co-visible pixels where nothing was drawn
    spill  share of the drawn pixels that show one surface where another one or nothing belongs
    """

    psnr: float
    holes: float
    spill: float


def decibels(error: np.ndarray) -> float:
    """PSNR of a picture that is off by so many of 255 steps."""
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-12)))


def near_edge(hits: Hits, reach: int = 2) -> np.ndarray:
    """Pixels within `reach` of another surface or of the empty background."""
    edge = np.zeros(hits.surface.shape, bool)
    for a, b in NEIGHBOURS:
        step = hits.surface[a] != hits.surface[b]
        edge[a] |= step
        edge[b] |= step
    for _ in range(reach - 1):
        grown = np.pad(edge, 1)
        edge = grown[1:-1, 1:-1] | grown[:-2, 1:-1] | grown[2:, 1:-1] | grown[1:-1, :-2] | grown[1:-1, 2:]
    return edge


def co_visible(hits: Hits, source: Hits, camera: Camera, pose: np.ndarray) -> np.ndarray:
    """Pixels of `hits` that the source saw too: all four source pixels round the point show its surface there."""
    points = moved(hits.points, np.linalg.inv(pose))
    seen = (hits.surface >= 0) & (points[..., 2] > 0)
    z = np.where(seen, points[..., 2], 1)
    u, v = (np.floor(part).astype(int) for part in camera.pixel_at(points[..., 0], points[..., 1], z))
    for du, dv in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column, row = np.clip(u + du, 0, camera.width - 1), np.clip(v + dv, 0, camera.height - 1)
        seen &= (column == u + du) & (row == v + dv) & (source.surface[row, column] == hits.surface)
        seen &= abs(source.depth[row, column] - z) < SAME_DEPTH * z
    return seen


def score_picture(
    image: np.ndarray, surface: np.ndarray, truth: np.ndarray, hits: Hits, seen: np.ndarray
) -> PictureScore:
    """Compares a picture with the truth.

    image    (h, w, 4) uint8
    surface  (h, w) number of the surface that each pixel shows, -1 for none
    truth    (h, w, 3) sRGB, 0..255, of `hits`
    seen     (h, w) from `co_visible`
    """
    drawn = image[..., 3] > 0
    judged = drawn & seen & ~near_edge(hits)
    error = image[judged][:, :3].astype(float) - np.round(truth[judged])
    spill = (surface[drawn] != hits.surface[drawn]).mean()
    return PictureScore(decibels(error), float((seen & ~drawn).sum() / seen.sum()), float(spill))


def outline(mask: np.ndarray) -> np.ndarray:
    """(n, 2) pixels of a mask at its border, without those at the picture's."""
    inside = mask[1:-1, :-2] & mask[1:-1, 2:] & mask[:-2, 1:-1] & mask[2:, 1:-1]
    return np.argwhere(mask[1:-1, 1:-1] & ~inside) + 1


def outline_distance(drawn: np.ndarray, true: np.ndarray) -> float:
    """Pixels from the outline of one mask to the nearest of the other, mean; the picture's diagonal without any."""
    ours, theirs = outline(drawn).astype(np.float32), outline(true).astype(np.float32)
    if not len(ours) or not len(theirs):
        return float(np.hypot(*drawn.shape))
    parts = np.array_split(ours, -(-len(ours) * len(theirs) // TOGETHER))
    nearest = [np.sqrt(((part[:, None] - theirs) ** 2).sum(-1).min(1)) for part in parts]
    return float(np.concatenate(nearest).mean())
