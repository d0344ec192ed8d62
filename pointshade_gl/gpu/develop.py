"""Develop pass: the sums of a picture's samples -> their mean, over a background, as sRGB."""

from __future__ import annotations

import moderngl

from .adding import Adding
from .canvas import Canvas
from .images import empty
from .passes import FullscreenPasses
from .target import SampleSums, Target


class DevelopPass:
    """Averages in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        self._passes = FullscreenPasses(context)
        self._adding = Adding(context)

    def canvas(self, sums: SampleSums) -> Canvas:
        """What samples are drawn on, to be added up."""
        return Canvas(sums.surfaces_target, self._adding)

    def ground_canvas(self, sums: SampleSums) -> Canvas:
        """The same of the ground."""
        return Canvas(sums.ground_target, self._adding)

    def develop(self, target: Target, count: int, background: tuple[float, float, float] | None) -> None:
        """count samples -> the picture. background: linear RGB, None for a transparent one."""
        behind = (0.0,) * 4 if background is None else (*background, 1.0)
        sums = {"sums": target.samples.surfaces}
        if target.samples.has_ground:
            sums["grounds"] = target.samples.ground
        empty(target.picture)
        develop = self._passes.get("develop.frag", GROUND=int(target.samples.has_ground))
        develop.draw(target.picture, sums, count=float(count), background=behind)

    def release(self) -> None:
        self._passes.release()
