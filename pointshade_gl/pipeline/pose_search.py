"""Finds the poses of frames of which nothing is known, and tells what is not sure."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

from ..checks.arguments import Count
from ..estimation.alignment import STEPS
from ..estimation.pose_search import Found, search_poses
from ..scene.appearance import Look
from ..scene.frame import Frame
from .gpu_scene import GpuScene

MOST_SEARCHED = 8  # frames: each is searched for beside each other


def search(gpu_scene: GpuScene, frames: Sequence[Frame], look: Look, count: Count) -> list[Found]:
    """Return the poses of frames of which nothing is known; the first keeps its own. Raises ValueError for too many."""
    if len(frames) > MOST_SEARCHED:
        raise ValueError(f"poses are searched for at most {MOST_SEARCHED} frames at once, got {len(frames)}")
    reduced = []
    for frame in frames:
        reduced.append(gpu_scene.read_reduced(frame, look))
        count.step()
    found = search_poses(reduced, [frame.pose for frame in frames], count.step)
    count.step(count.all - count.done)  # if there was less to do
    return found


def search_steps(frames: int) -> int:
    """Return how many steps a search counts: each frame is read, each pair is compared, then all are aligned."""
    return frames + comb(frames, 2) + STEPS


def notes_on_search(found: Sequence[Found]) -> list[str]:
    """Return a sentence for each frame that was not found, or not surely."""
    notes = []
    for k, one in enumerate(found):
        if one.doubt and k:
            said = "is doubtful" if one.fit.placed else "was not found and stays as given"
            notes.append(f"the pose of frame {k} of {len(found)} {said}: {one.doubt}")
    return notes
