"""Tries many poses of one frame beside another at once: what agrees in depth and brightness, and what contradicts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import inverted
from .frame_matches import LEAST_COSINE
from .reduced_frame import BLURS, ReducedFrame

NEAR, BESIDE = 0.02, 0.06  # share of the depth, along the normal and along the ray, within which a point agrees
FRONT = 0.04  # share of the depth by which a point lies before what is seen: it should have hidden it
FAINT = 0.003  # contrast of brightness that counts as much as noise
FIRST, AT_ONCE = 300, 500  # points by which all poses are tried; poses that are tried at once
ROUGH, FINE = 1.0, 4.0  # weights of a point before what is seen, beside one that agrees: of rough and of refined poses
Matrix = NDArray[np.float64]
Floats = NDArray[np.floating]
Flags = NDArray[np.bool_]


class Trial(NamedTuple):
    """How poses fare, (n,) each; the mean over both frames."""

    overlap: Floats  # share of the points that the other frame should show, the smaller of both frames
    agreement: Floats  # share of those that lie on the other's surface
    agreed: Floats  # share of all points that do
    front: Floats  # share of all points that would hide what the other frame shows
    like: Floats  # correlation of blurred brightness where points agree, -1 to 1
    detail: Floats  # the same of what blurring takes away; 0 without colours or texture

    def evidence(self, strict: float = FINE) -> Floats:
        """Return how much speaks for each pose. strict: weight of points before what is seen."""
        looks = 0.5 + np.maximum(self.like, 0) / 2 + np.maximum(self.detail, 0)
        return np.maximum(self.agreed - strict * self.front, 0) * looks


def try_poses(first: ReducedFrame, second: ReducedFrame, poses: Matrix, count: int = FIRST) -> Trial:
    """Return how poses fare, by so many points of each frame. poses: (n, 4, 4) the second's, in the first's axes."""
    parts = [poses[k : k + AT_ONCE] for k in range(0, len(poses), AT_ONCE)]
    ways = [
        [np.concatenate(one) for one in zip(*found, strict=True)]
        for found in (
            [_one_way(first, second, part, count) for part in parts],
            [_one_way(second, first, inverted(part), count) for part in parts],
        )
    ]
    seen, agreed, front, like, detail = ((one + other) / 2 for one, other in zip(*ways, strict=True))
    overlap = np.minimum(ways[0][0], ways[1][0])
    return Trial(overlap, agreed / np.maximum(seen, 1e-9), agreed, front, like, detail)


def some_points(frame: ReducedFrame, count: int) -> NDArray[np.intp]:
    """Return the numbers of so many points all over a frame, the same each time."""
    every = frame.samples(2)
    return every[np.random.default_rng(0).permutation(len(every))[:count]]


def _one_way(target: ReducedFrame, frame: ReducedFrame, poses: Matrix, count: int) -> tuple[Floats, ...]:
    """Return shares of the frame's points that the target should show, that agree, that lie before it; likenesses."""
    numbers = some_points(frame, count)
    turns = poses[:, :3, :3].astype(np.float32).swapaxes(1, 2)
    at = frame.points[numbers] @ turns + poses[:, None, :3, 3].astype(np.float32)
    pixels, inside = target.pixels(at)
    there, normals = target.points[pixels], target.normals[pixels]
    depth = there[..., 2]
    is_known = inside & (depth > 0)
    behind = np.where(is_known, at[..., 2] - depth, np.inf) / np.maximum(depth, 1e-9)
    apart = np.abs(np.einsum("npk,npk->np", normals, at - there))
    cosines = np.einsum("npk,npk->np", normals, frame.normals[numbers] @ turns)
    fits = (np.abs(behind) < BESIDE) & (apart < NEAR * depth) & (cosines > LEAST_COSINE)
    like = detail = np.zeros(len(poses))
    if frame.brightness is not None and target.brightness is not None:
        (own, fine), (shown, fine_shown) = (_looks(*one) for one in ((frame, numbers), (target, pixels)))
        like, detail = _correlation(own, shown, fits), _correlation(fine, fine_shown, fits)
    total = max(len(numbers), 1)
    shares = (one.sum(1) / total for one in (behind < FRONT, fits, behind < -FRONT))
    return *shares, like, detail


def _looks(frame: ReducedFrame, pixels: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return blurred brightness at pixels, and what more blur takes away from less."""
    wide = frame.blurred(BLURS - 1).value[pixels]
    return wide, frame.blurred(0).value[pixels] - wide


def _correlation(one: Floats, other: Floats, fits: Flags) -> Floats:
    """Return the correlation (n,) of values (p,) or (n, p) where these belong together (n, p), less if faint."""
    count = np.maximum(fits.sum(1), 1)
    one, other = (
        np.where(fits, part - ((part * fits).sum(1) / count)[:, None], 0) for part in (np.atleast_2d(one), other)
    )
    lengths = ((part**2).sum(1) + count * FAINT**2 for part in (one, other))
    return (one * other).sum(1) / np.sqrt(next(lengths) * next(lengths))
