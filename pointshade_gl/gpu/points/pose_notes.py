"""Prints a note, once, about wrong or missing poses among several frames of one object."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np

from ...estimation.agreement import Contradictions
from ...notes.notes import print_note
from ...scene.frame import Frame
from ..core.frame_textures import FrameTextures


class Told:
    """Remembers which notes on poses were printed: a live stream would repeat them thirty times a second."""

    def __init__(self) -> None:
        self._poses: WeakKeyDictionary[FrameTextures, bytes] = WeakKeyDictionary()  # of the frames that were named

    def tell(
        self, members: Sequence[FrameTextures], frames: Sequence[Frame], found: Contradictions, goes_on: bool
    ) -> None:
        """Print notes on frames whose poses are wrong or missing.

        goes_on  some of the frames are those of the last time: notes on the others then also hold for the new ones
        """
        notes = _notes_on(frames, found)
        for k, member in enumerate(members):
            if k not in notes:
                self._poses.pop(member, None)
                continue
            before, pose = self._poses.get(member), frames[k].pose.tobytes()
            self._poses[member] = pose
            if before is None or not (goes_on or before == pose):
                print_note(notes[k])


def _notes_on(frames: Sequence[Frame], found: Contradictions) -> dict[int, str]:
    """Return the notes by the frame that each is about; a note on all frames is under the first."""
    first, count = frames[0], len(frames)
    if any(frame is not first for frame in frames) and all(np.array_equal(frame.pose, first.pose) for frame in frames):
        ways = "give each Frame its own, or find them with `pointshade align`"
        return {0: f"the {count} frames all have the same pose: if their camera moved, {ways}"}
    wrong = "contradicts the others where they see the same, and only fills gaps: is its pose right?"
    named = {k: f"frame {k} of {count} {wrong}" for k in found.frames}
    if not found.undecided:
        return named
    return {0: f"the {count} frames contradict each other where they see the same: are their poses right?"} | named
