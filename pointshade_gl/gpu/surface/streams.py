"""Keeps the history of each depth stream that is filtered over time."""

from __future__ import annotations

from collections.abc import Iterable

import moderngl

from ...scene.frame import Frame
from ..core.steps import Steps
from .temporal_filter import History, Stream, TemporalPass


class Streams:
    """Keeps the streams, each known by its place among the point objects of a scene."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        self._context, self._steps = context, steps
        self._temporal: TemporalPass | None = None  # made for the first stream
        self._histories: dict[int, History] = {}

    def stream_of(self, frame: Frame, place: int) -> Stream:
        """Return the stream at a place, with its next frame."""
        self._temporal = self._temporal or TemporalPass(self._context, self._steps)
        if place not in self._histories:
            self._histories[place] = History(self._context)
        return Stream(self._temporal, self._histories[place], frame)

    def keep_only(self, places: Iterable[int]) -> None:
        """Free the history of all other streams."""
        for place in self._histories.keys() - set(places):
            self._histories.pop(place).release()

    def release(self) -> None:
        self.keep_only(())
        if self._temporal is not None:
            self._temporal.release()
