"""Corrects the poses of a sequence's frames one after the other, each against keyframes, so that they do not drift."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from ..estimation.agreement import ReducedFrame
from ..estimation.alignment import align
from ..notes.notes import print_note
from ..scene.appearance import Look
from ..scene.frame import Frame
from ..scene.node import Matrix
from .gpu_scene import GpuScene

NEAREST = 3  # keyframes that a frame is aligned to
MOST_KEYFRAMES = 16  # that are remembered, of about 6 MB each
NEW_KEYFRAME = 0.7  # overlap with the others below which a frame becomes one
LOST = 5  # frames one after the other that fit none, of which the last becomes one: the camera is elsewhere
ROUND = 1.0  # turn, radians, that counts as much as a shift by the scene's distance


class _Keyframe(NamedTuple):
    reduced: ReducedFrame
    pose: Matrix  # corrected


class PoseTrack:
    """The corrected poses of one sequence: that of its first frame stays."""

    def __init__(self, gpu_scene: GpuScene, look: Look):
        self._gpu_scene, self._look = gpu_scene, look
        self._keyframes: deque[_Keyframe] = deque(maxlen=MOST_KEYFRAMES)
        self._correction = np.eye(4)  # of the last frame: from its given pose to the one that was found
        self._lost = 0  # frames up to now, one after the other, that fit no keyframe

    def follow(self, frame: Frame) -> Frame:
        """Return the next frame at its corrected pose; where it fits no keyframe, it is moved as the one before.

        The given pose is expected to be off by what the last one was: drift grows slowly.
        """
        reduced, start = self._gpu_scene.read_reduced(frame, self._look), self._correction @ frame.pose
        if not self._keyframes:
            if reduced.points_known:
                self._keyframes.append(_Keyframe(reduced, start))
            return frame
        near = sorted(self._keyframes, key=lambda one: _apart(one.pose, start, reduced))[:NEAREST]
        poses = [*(one.pose for one in near), start]
        *_, fit = align([*(one.reduced for one in near), reduced], poses, known=len(near))
        self._lost = 0 if fit.placed else self._lost + 1
        if self._lost == 1:
            print_note(
                "a frame of the sequence fits none before it: until one fits, poses are corrected as the last one"
            )
        if reduced.points_known and (fit.overlap < NEW_KEYFRAME if fit.placed else self._lost % LOST == 0):
            self._keyframes.append(_Keyframe(reduced, fit.pose))
        self._correction = fit.pose @ np.linalg.inv(frame.pose)
        return frame.at(fit.pose)


def _apart(pose: Matrix, other: Matrix, frame: ReducedFrame) -> float:
    """Return how differently two poses show a frame's scene."""
    cosine = np.clip((np.trace(pose[:3, :3].T @ other[:3, :3]) - 1) / 2, -1, 1)
    scale = float(np.linalg.norm(frame.middle)) or 1.0
    return float(np.linalg.norm(pose[:3, 3] - other[:3, 3])) / scale + float(np.arccos(cosine)) / ROUND
