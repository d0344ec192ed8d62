"""Develop pass: the sum of a picture's samples -> their mean, over a background, as sRGB."""

from __future__ import annotations

import moderngl

from .adding import Adding
from .canvas import Canvas
from .images import empty
from .passes import FullscreenPass
from .target import SampleSums, Target


class DevelopPass(FullscreenPass):
    """Averages in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context, "develop.frag")
        self._adding = Adding(context)

    def canvas(self, sums: SampleSums) -> Canvas:
        """What samples are drawn on, to be added up."""
        return Canvas(sums.target, self._adding)

    def develop(self, target: Target, count: int, background: tuple[float, float, float] | None) -> None:
        """count samples -> the picture. background: linear RGB, None for a transparent one."""
        behind = (0.0,) * 4 if background is None else (*background, 1.0)
        empty(target.picture)
        self.draw(target.picture, {"sums": target.samples.texture}, count=float(count), background=behind)
