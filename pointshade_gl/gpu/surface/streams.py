"""Keeps the history of each depth stream that is filtered over time."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import moderngl

from ...scene.frame import Frame
from ..core.memory import Owner
from ..core.steps import Steps
from .temporal_filter import History, Stream, TemporalPass


class Streams(Owner):
    """Keeps the streams, each known by its place among the point objects of a scene."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._histories: dict[int, History] = {}

    @cached_property
    def _temporal(self) -> TemporalPass:
        return self._keep(TemporalPass(self._context, self._steps))

    def stream_of(self, frame: Frame, place: int) -> Stream:
        """Return the stream at a place, with its next frame."""
        if place not in self._histories:
            self._histories[place] = History(self._context)
        return Stream(self._temporal, self._histories[place], frame)

    def keep_only(self, places: Iterable[int]) -> None:
        """Free the history of all other streams."""
        for place in self._histories.keys() - set(places):
            self._histories.pop(place).release()

    def release(self) -> None:
        self.keep_only(())
        super().release()
