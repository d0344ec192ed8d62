"""Averages the samples of a picture, puts a background behind them, and converts the result to sRGB."""

from __future__ import annotations

import moderngl

from ..core.additive_blend import AdditiveBlend
from ..core.canvas import Canvas
from ..core.images import empty
from ..core.passes import FullscreenPasses
from ..core.view_images import SampleSums, Target


class ResolveSamplesPass(FullscreenPasses):
    """Averages samples in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)

    def canvas(self, sums: SampleSums) -> Canvas:
        """What samples are drawn on, to be added up."""
        return Canvas(sums.surfaces.target, self._adding)

    def ground_canvas(self, sums: SampleSums) -> Canvas:
        """The same of the ground."""
        return Canvas(sums.ground.target, self._adding)

    def develop(self, target: Target, count: int, background: tuple[float, float, float] | None) -> None:
        """Average `count` samples into the picture. background: linear RGB, None for a transparent one."""
        behind = (0.0,) * 4 if background is None else (*background, 1.0)
        sums = {"sums": target.samples.surfaces.texture}
        if target.samples.has_ground:
            sums["grounds"] = target.samples.ground.texture
        empty(target.picture)
        develop = self.fullscreen("output/resolve_samples.frag", GROUND=int(target.samples.has_ground))
        develop.draw(target.picture, sums, count=float(count), background=behind)
