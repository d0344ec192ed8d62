"""Corrects the poses of several frames of one thing, so that their depths and colours agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .posed_frames import LEVELS, PosedFrames
from .reduced_frame import ReducedFrame

WELL_REGISTERED = 0.7  # correlation of textures from which on colours surely lie on the depth
REGISTERED = 0.33  # and which they have at least where depth alone says that poses are right
ROUNDS = 4  # of placing frames again and solving all
STEPS = len(LEVELS) + ROUNDS
WORSE = 0.005  # by so much less agreement than with the given pose a frame gets that back
OWN_SHARE = 0.1  # of a motion that nothing fixes, from which on a frame takes part in it
Matrix = NDArray[np.float64]


class Fit(NamedTuple):
    """What became of one frame's pose."""

    pose: Matrix  # (4, 4) camera-to-world
    placed: bool  # whether it is known; otherwise it is the given one
    leads: bool  # whether it kept its pose, which others follow
    moved: float  # how far its points were moved, root of the mean square, m
    overlap: float  # share of its points that other frames should show, too
    before: float  # spread of the depths' differences with the given poses, a share of the depth; NaN without overlap
    after: float  # the same with the new ones
    agreed: float  # share of what it has in common with others that lay within the band, with the given poses
    agrees: float  # the same with the new ones
    by_colors: bool  # whether brightness led, too
    loose: tuple[Matrix, ...]  # motions (6,) that nothing fixes, turn and shift in world axes, of length 1


def align(
    frames: Sequence[ReducedFrame],
    poses: Sequence[Matrix],
    told: Callable[[], object] = lambda: None,
    known: int = 1,
) -> list[Fit]:
    """Correct the poses of frames of one thing; the first keeps its own.

    Frames are compared in pairs that show the same: by how far the points of one lie off the planes of the other
    (Chen, Medioni 1991; by projection: Blais, Levine 1995), and by how much brighter they are (Park, Zhou, Koltun
    2017). One Gauss-Newton step moves all frames at once. A motion that neither depth nor colours fix is left as given,
    and so is a frame that afterwards agrees too little with the others, or less than before.

    told   called after each level, and before each round of checks: at most STEPS times
    known  how many of the first frames have right poses
    """
    work = PosedFrames(frames, poses, known)
    free = set(range(len(frames))) - work.anchors
    found, loose = work.refine(poses, free, told=told)
    if not _are_registered(work, found, free):
        work.by_colors = False
        found, loose = work.refine(poses, free)
    kept: set[int] = set()
    for _ in range(ROUNDS):
        told()
        again, kept = _guarded(work, found, kept)
        if all(one is other for one, other in zip(again, found, strict=True)):
            break
        found, loose = work.refine(again, free - kept, kept, LEVELS[1:])
    if len(loose):
        found, loose = work.refine(work.held(found, loose), free - kept, kept, LEVELS[-1:])
    after = work.judged(found)
    before = work.judged(poses, spread=after.spread)
    return [
        Fit(
            found[k],
            k not in kept and after.overlap[k] > 0,
            k in work.anchors,
            work.moved(found, k),
            after.overlap[k],
            before.each[k],
            after.each[k],
            before.agreement[k],
            after.agreement[k],
            work.by_colors,
            _own_motions(loose, k),
        )
        for k in range(len(frames))
    ]


def _are_registered(work: PosedFrames, poses: list[Matrix], free: Set[int]) -> bool:
    """Return whether colours lie on the depth: where it alone says that poses are right, textures must agree, too."""
    if not work.judged(poses).correlation < WELL_REGISTERED:
        return True
    work.by_colors = False
    alone, _ = work.refine(poses, free, levels=LEVELS[-1:])
    work.by_colors = True
    return not work.judged(alone).correlation < REGISTERED


def _guarded(work: PosedFrames, poses: list[Matrix], kept: set[int]) -> tuple[list[Matrix], set[int]]:
    """Place doubtful frames again, each alone among the others; return the poses, and the frames that get theirs back.

    The given pose may lead elsewhere when the others already lie where they belong. kept: frames that have got theirs.
    """
    poses = list(poses)
    judged = work.judged(poses)
    doubtful = {k for k in np.flatnonzero(judged.is_doubtful()).tolist() if k not in work.anchors | kept}
    for k in sorted(doubtful, key=lambda k: judged.agreement[k]):
        again = poses.copy()
        again[k] = work.given[k]
        others = doubtful - {k}
        again, _ = work.refine(again, {k}, others | kept)
        now = [work.judged(one, others | kept, judged.spread) for one in (poses, again)]
        if now[1].agreement[k] > now[0].agreement[k]:
            poses = again
        if not now[1].is_doubtful()[k]:
            doubtful = others
    kept = kept | _outcasts(work, poses, kept)
    return [work.given[k] if k in kept else pose for k, pose in enumerate(poses)], kept


def _outcasts(work: PosedFrames, poses: list[Matrix], without: Set[int]) -> set[int]:
    """Return which frames do not fit the others, or fit them less than at the given poses.

    The worst half of those is taken out before the others are asked again: a wrong frame spoils its neighbours' share.
    """
    found: set[int] = set()
    while True:
        after = work.judged(poses, without | found)
        before = work.judged(work.given, without | found, after.spread)
        bad = after.is_wrong() | (after.agreement < before.agreement - WORSE)
        bad[list(work.anchors)] = False
        if not bad.any():
            return found
        found |= set(np.flatnonzero(bad & (after.agreement <= np.median(after.agreement[bad]))).tolist())


def _own_motions(loose: Matrix, k: int) -> tuple[Matrix, ...]:
    """Return those motions (6,) of one frame, of length 1, that are not fixed."""
    if not len(loose):
        return ()
    _, sizes, own = np.linalg.svd(loose[:, k] / np.linalg.norm(loose.reshape(len(loose), -1), axis=1)[:, None])
    return tuple(own[: len(sizes)][sizes > OWN_SHARE])
