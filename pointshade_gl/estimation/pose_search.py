"""Finds the poses of a few frames of one thing of which nothing is known, and says how sure they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.camera import inverted
from .alignment import Fit, align
from .pose_links import Link, find_link, is_same
from .reduced_frame import ReducedFrame
from .surface_patches import find_patches

RADIUS = 0.045  # of a patch, a share of what the picture is wide at the frames' distance
Matrix = NDArray[np.float64]
Links = Mapping[tuple[int, int], Link]  # by the numbers of two frames, both ways: the second's place beside the first


class Found(NamedTuple):
    """What became of a frame."""

    fit: Fit  # not placed: it was not found
    doubt: str  # why the pose may be wrong, or is not found; nothing if it is sure


def search_poses(
    frames: Sequence[ReducedFrame], poses: Sequence[Matrix], told: Callable[[], object] = lambda: None
) -> list[Found]:
    """Find the poses of frames of one thing; the first keeps its own, and those that are not found theirs.

    Two places that look alike on their tangent planes are a whole pose of one frame beside another. All of these are
    tried: depths and brightness agree or contradict. The best are refined, and one is believed if no other comes near
    it. Frames are joined to the first by what most speaks for (a maximum spanning tree) and aligned all at once.

    told  called after each pair of frames, and after each level of the alignment
    """
    radius = RADIUS * max(frame.middle[2] * frame.camera.width / abs(frame.camera.fx) for frame in frames)
    patches = [find_patches(frame, float(radius)) for frame in frames]
    links: dict[tuple[int, int], Link] = {}
    for i, j in combinations(range(len(frames)), 2):
        links[i, j] = link = find_link(frames[i], frames[j], patches[i], patches[j])
        links[j, i] = link._replace(pose=inverted(link.pose[None])[0])
        told()
    beside, parents = _joined(links)
    group = sorted(beside)
    fits = align([frames[k] for k in group], [poses[0] @ beside[k] for k in group], told)
    placed = {k: fit for k, fit in zip(group, fits, strict=True) if fit.placed or k == 0}
    doubts = _doubts(frames, links, parents, placed)
    lost = fits[0]._replace(placed=False, overlap=0.0, agreed=0.0, agrees=0.0, loose=())
    return [Found(placed.get(k, lost._replace(pose=poses[k])), doubt) for k, doubt in enumerate(doubts)]


def _joined(links: Links) -> tuple[dict[int, Matrix], dict[int, int]]:
    """Return the poses beside the first frame of all that hang together with it, and what each was joined to."""
    beside, parents = {0: np.eye(4)}, {}
    while True:
        ends = [(i, j) for (i, j), link in links.items() if link.is_found and i in beside and j not in beside]
        if not ends:
            return beside, parents
        i, j = max(ends, key=lambda pair: links[pair].evidence)
        beside[j], parents[j] = beside[i] @ links[i, j].pose, i


def _doubts(
    frames: Sequence[ReducedFrame], links: Links, parents: Mapping[int, int], fits: Mapping[int, Fit]
) -> list[str]:
    """Return for each frame why its pose may be wrong or is not found; nothing if sure links lead to the first.

    parents  to which each frame was joined
    fits     of the frames that are placed
    """
    sure = [(i, j) for (i, j), link in links.items() if link.is_sure and i in fits and j in fits]
    known, broken = {0}, set()
    for _ in frames:
        known |= {j for i, j in sure if i in known}
    for i, j in sure:
        if not is_same(links[i, j].pose, np.linalg.inv(fits[i].pose) @ fits[j].pose, frames[j]):
            broken |= {i, j} - {0}

    def doubt(k: int) -> str:
        if k in fits and k in known - broken:
            return ""
        if k in broken:
            return "pairs of frames contradict each other"
        if k in parents and k not in fits:
            return "the frames do not agree when all are aligned at once"
        if k in parents:
            return links[parents[k], k].doubt or f"so is frame {parents[k]}, beside which it was found"
        return max((link for (_, j), link in links.items() if j == k), key=lambda link: link.evidence).doubt

    return [doubt(k) for k in range(len(frames))]
