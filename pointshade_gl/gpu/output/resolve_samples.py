"""Averages the samples of a picture, puts a background behind them, and converts the result to sRGB."""

from __future__ import annotations

import moderngl

from ..core.additive_blend import AdditiveBlend
from ..core.canvas import Canvas
from ..core.images import Image, empty
from ..core.passes import FullscreenPasses
from ..core.view_images import Target


class ResolveSamplesPass(FullscreenPasses):
    """Averages samples in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)

    def canvas(self, sums: Image) -> Canvas:
        """What samples are drawn on, to be added up: the surfaces, or the ground, of SampleSums."""
        return Canvas(sums.target, self._adding)

    def develop(self, target: Target, count: int, background: tuple[float, float, float] | None) -> None:
        """Average `count` samples into the picture. background: linear RGB, None for a transparent one."""
        behind = (0.0,) * 4 if background is None else (*background, 1.0)
        sums = {"sums": target.samples.surfaces.texture}
        if target.samples.has_ground:
            sums["grounds"] = target.samples.ground.texture
        empty(target.picture)
        develop = self.fullscreen("output/resolve_samples.frag", GROUND=int(target.samples.has_ground))
        develop.draw(target.picture, sums, count=float(count), background=behind)
