"""What a viewer can be given to show: checked before a window opens."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..files.frames.sequences import FrameSequence
from ..messages.formatting import option, shown
from ..messages.validation import check_fps, items_of
from ..scene.frame import Frame
from ..scene.graph import Scene


def check_sources(source: Any, others: Any, views: Any) -> list[Any]:
    """The others in a list. Raises TypeError or ValueError for what cannot be shown, or not as it is asked for."""
    if not isinstance(source, Frame | Scene | Iterable) or isinstance(source, str | bytes):
        raise TypeError(f"source must be a Frame, a Scene or an iterable of frames, got {shown(source)}")
    for other in [others] if (found := items_of(others)) is None else found:
        if found is None or not isinstance(other, Frame | Iterable) or isinstance(other, str | bytes):
            raise TypeError(f"others must be Frames or iterables of frames, got {shown(other)}")
    if found and isinstance(source, Scene):
        raise TypeError("a scene has no others: they are more sources of frames of the same thing")
    if views is not None and found:
        raise ValueError(f"{option('views')} merges the frames of one sequence, and others are given: leave it out")
    if views is not None and (isinstance(source, Frame) or not isinstance(source, Sequence)):
        got = "a single frame" if isinstance(source, Frame) else f"a {type(source).__name__}"
        raise ValueError(f"{option('views')} merges the frames of a sequence, and this is {got}: leave it out")
    return list(found or ())


def check_posed(sources: Iterable[Any]) -> None:
    """Raises ValueError for a sequence without poses among several sources."""
    for source in sources:
        if isinstance(source, FrameSequence) and not source.posed:
            raise ValueError(f"{source.folder} has no poses: several INPUTs are merged by their poses")


def check_rates(fps: Any, count: int) -> list[float | None]:
    """Frames per second of each source. Raises ValueError for another number of them, or impossible ones."""
    rates = items_of(fps)
    if rates is None or isinstance(fps, str):
        rates = [fps] * count
    if len(rates) != count:
        name = option("fps")
        raise ValueError(f"{name} must be a number of frames per second, or one for each source, got {shown(fps)}")
    return [None if rate is None else check_fps(rate, option("fps"), "frames") for rate in rates]
