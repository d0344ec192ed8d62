"""Says which poses could not be corrected, in whole or in part, and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..estimation.alignment import Fit
from ..notes.words import counted
from ..scene.frame import Frame


def notes_on(frames: Sequence[Frame], fits: Sequence[Fit]) -> list[str]:
    """Return sentences about frames whose poses stay as given, in whole or in part, and about their colours."""
    count = len(fits)
    kept = [k for k, fit in enumerate(fits) if not fit.placed and count > 1]
    lonely = [k for k in kept if not fits[k].overlap]
    unsure = [k for k in kept if fits[k].overlap]
    notes = []
    if not all(fit.by_colors for fit in fits):
        notes.append(
            "the colours of the frames do not lie on their depth, which alone aligns them: are depth and colour "
            "pictures registered?"
        )
    if lonely:
        notes.append(f"{_named(lonely, count, 'shares', 'share')} too little with the others: {_stays(lonely)}")
    if unsure:
        near = "its given pose" if len(unsure) == 1 else "their given poses"
        notes.append(
            f"{_named(unsure, count)} could not be aligned, for near {near} too little agrees with the others: "
            f"{_stays(unsure)}"
        )
    for few in sorted({len(fit.loose) for fit in fits if fit.placed} - {0}):
        loose = [k for k, fit in enumerate(fits) if fit.placed and len(fit.loose) == few]
        motions = _motions(frames[loose[0]], fits[loose[0]])
        whose = "" if len(loose) == 1 else f"of frame {loose[0]}: "
        notes.append(
            f"{_named(loose, count)}: neither depth nor colours fix {counted(few, 'motion')} of 6 ({whose}{motions}): "
            f"there {_stays(loose)}"
        )
    return notes


def _named(numbers: Sequence[int], count: int, one: str = "", several: str = "") -> str:
    """Return `frame 3 of 8 shares` or `frames 3, 5 of 8 share`."""
    names, words = ", ".join(map(str, numbers)), ("frame", one) if len(numbers) == 1 else ("frames", several)
    return f"{words[0]} {names} of {count} {words[1]}".rstrip()


def _stays(numbers: Sequence[int]) -> str:
    return "the given pose stays" if len(numbers) == 1 else "the given poses stay"


def _motions(frame: Frame, fit: Fit) -> str:
    """Return which motions of a frame nothing fixes, in its camera's axes."""
    axes = frame.pose[:3, :3].T
    texts = []
    for motion in fit.loose:
        turn, shift = axes @ motion[:3], axes @ motion[3:]
        kind, axis = ("turns about", turn) if np.linalg.norm(turn) > np.linalg.norm(shift) else ("shifts along", shift)
        axis = axis / np.linalg.norm(axis) * np.sign(axis[np.argmax(np.abs(axis))])
        texts.append(kind + " ({:.1f}, {:.1f}, {:.1f})".format(*(axis + 0.0)))
    return ", ".join(texts)
