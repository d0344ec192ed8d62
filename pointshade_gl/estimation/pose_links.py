"""Finds where one frame stands beside another of which nothing is known, and why that may be wrong."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .pose_trials import ROUGH, Trial, some_points, try_poses
from .posed_frames import FEWEST, LEVELS, PosedFrames
from .reduced_frame import ReducedFrame
from .surface_patches import Pairs, Patches, pair_alike

REFINED = 8  # different poses that are refined
DIFFERENT, OTHER = 0.15, 0.05  # shares of the distance by which poses differ, before and after they are refined
SPREAD = 60  # points by which poses are told apart
CLOSELY = 4000  # points by which refined poses are judged
LEAST_OVERLAP, SURE_OVERLAP = 0.1, 0.25  # share of the points that both show
LEAST_AGREEMENT, SURE_AGREEMENT = 0.8, 0.9  # share of those that lie on the other's surface
MOST_FRONT, SURE_FRONT = 0.05, 0.01  # share of those that would hide what the other shows
LEAST_LIKE, SURE_LIKE = 0.4, 0.7  # correlation of brightness
RIVAL, SURE_RIVAL = 0.9, 0.7  # of the evidence, for another pose
Matrix = NDArray[np.float64]


class Link(NamedTuple):
    """What is known of where a frame stands beside another."""

    pose: Matrix  # (4, 4) camera to the other's camera
    evidence: float  # for it
    is_found: bool
    doubt: str  # why it may be wrong, or is not found; nothing if it is sure

    @property
    def is_sure(self) -> bool:
        """Return whether nothing speaks against it."""
        return self.is_found and not self.doubt


def find_link(first: ReducedFrame, second: ReducedFrame, one: Patches, other: Patches) -> Link:
    """Return where the second frame stands beside the first, by the patches of both."""
    if min(len(one.points), len(other.points), *(len(frame.samples(2)) for frame in (first, second))) < FEWEST:
        return Link(np.eye(4), 0.0, False, "too few points have depth")
    poses = _poses_of(one, other, pair_alike(one, other))
    rough = try_poses(first, second, poses).evidence(ROUGH)
    refined = [_refined(first, second, poses[k]) for k in _different(poses, rough, second, DIFFERENT)]
    poses = np.array([pose for pose, _ in refined])
    trial = try_poses(first, second, poses, CLOSELY)
    evidence = trial.evidence()
    best, *others = _different(poses, evidence, second, OTHER)
    rival = float(evidence[others[0]] / max(evidence[best], 1e-9)) if others else 0.0
    has_colors = first.brightness is not None and second.brightness is not None
    return Link(poses[best], float(evidence[best]), *_verdict(trial, best, refined[best][1], rival, has_colors))


def is_same(pose: Matrix, other: Matrix, frame: ReducedFrame) -> bool:
    """Return whether two poses (4, 4) of a frame are one, but for the last refinement."""
    return bool(_apart(pose[None], other, frame)[0] < OTHER)


def _poses_of(one: Patches, other: Patches, pairs: Pairs) -> Matrix:
    """Return the poses (n, 4, 4) of the second frame in the first's axes that lay patches of pairs on each other."""
    cosine, sine, zero = np.cos(pairs.turns), np.sin(pairs.turns), np.zeros_like(pairs.turns)
    turns = np.stack([cosine, sine, zero, -sine, cosine, zero, zero, zero, zero + 1], -1).reshape(-1, 3, 3)
    poses = np.tile(np.eye(4), (len(turns), 1, 1))
    poses[:, :3, :3] = one.axes[pairs.first].swapaxes(1, 2) @ turns @ other.axes[pairs.second]
    poses[:, :3, 3] = one.points[pairs.first] - (poses[:, :3, :3] @ other.points[pairs.second][..., None])[..., 0]
    return poses


def _different(poses: Matrix, evidence: NDArray[np.floating], frame: ReducedFrame, least: float) -> list[int]:
    """Return the numbers of poses of a frame that lie so far from all better ones, the best first."""
    left, chosen = np.argsort(-evidence, kind="stable"), []
    while len(left) and len(chosen) < REFINED:
        chosen.append(int(left[0]))
        left = left[_apart(poses[left], poses[left[0]], frame) > least]
    return chosen


def _apart(poses: Matrix, pose: Matrix, frame: ReducedFrame) -> Matrix:
    """Return by how much poses (n, 4, 4) of a frame move its points from another, as a share of their distance."""
    points, change = frame.points[some_points(frame, SPREAD)].astype(np.float64), poses - pose
    moved = points @ change[:, :3, :3].swapaxes(1, 2) + change[:, None, :3, 3]
    return np.sqrt((moved**2).sum(-1).mean(-1)) / max(float(np.linalg.norm(frame.middle)), 1e-9)


def _refined(first: ReducedFrame, second: ReducedFrame, pose: Matrix) -> tuple[Matrix, int]:
    """Return a better pose of the second frame beside the first, and how many motions nothing fixes."""
    start = [np.eye(4), pose]
    (_, refined), loose = PosedFrames([first, second], start).refine(start, {1}, levels=LEVELS[:2])
    return refined, len(loose)


def _verdict(trial: Trial, best: int, loose: int, rival: float, has_colors: bool) -> tuple[bool, str]:
    """Return whether a pose is found, and why it is doubtful.

    trial  of which it is number `best`
    loose  motions that nothing fixes
    rival  evidence for another pose, as a share of that for it
    """
    overlap, agreement, _, front, like, detail = (float(values[best]) for values in trial)
    front, colors = front / max(overlap, 1e-9), (like + detail) / 2 if has_colors else 1.0
    if overlap < LEAST_OVERLAP or agreement < LEAST_AGREEMENT or front > MOST_FRONT or colors < LEAST_LIKE:
        return False, "no pose makes the frames agree"
    if loose:
        return False, f"neither depth nor colours fix {loose} of 6 motions"
    if rival > RIVAL:
        return False, "another pose fits as well"
    if rival > SURE_RIVAL:
        return True, "another pose fits nearly as well"
    if overlap < SURE_OVERLAP:
        return True, f"both show the same in only {100 * overlap:.0f} % of their points"
    if agreement < SURE_AGREEMENT or front > SURE_FRONT:
        return True, f"only {100 * agreement:.0f} % of what both show agrees"
    return True, "" if colors >= SURE_LIKE else "the colours hardly agree"
