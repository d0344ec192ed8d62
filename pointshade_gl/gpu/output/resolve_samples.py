"""Averages the samples of a picture, puts a background behind them, and converts the result to sRGB."""

from __future__ import annotations

import moderngl

from ...scene.settings import Finish
from ..core.additive_blend import AdditiveBlend
from ..core.canvas import Canvas
from ..core.images import Image, empty
from ..core.passes import FullscreenPasses
from ..core.view_images import SampleSums, Target


class ResolveSamplesPass(FullscreenPasses):
    """Averages samples in linear light, weighted by coverage."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)

    def canvas(self, sums: Image) -> Canvas:
        """What samples are drawn on, to be added up: the surfaces, or the ground, of SampleSums."""
        return Canvas(sums.target, self._adding)

    def rest_canvas(self, sums: SampleSums) -> Canvas:
        """The same of surfaces, where pixels are open."""
        return Canvas(sums.open_surfaces, self._adding, is_masked=True)

    def develop(self, target: Target, finish: Finish) -> None:
        """Average the samples into the picture."""
        behind = (0.0,) * 4 if finish.behind is None else (*finish.behind, 1.0)
        sums = {"sums": target.samples.surfaces.texture}
        if target.samples.has_ground:
            sums["grounds"] = target.samples.ground.texture
        empty(target.picture)
        has_ground, rolls_off = int(target.samples.has_ground), int(finish.tone == "neutral")
        develop = self.fullscreen("output/resolve_samples.frag", GROUND=has_ground, TONE=rolls_off)
        develop.draw(target.picture, sums, count=float(finish.samples), background=behind)
