"""Removes highlights from the pictures of several frames of one object: the others show what lies under them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import moderngl

from ...estimation.multi_view import excess_noise, nearest_others
from ...notes.words import option
from ..core.additive_blend import AdditiveBlend
from ..core.frame_textures import Colors, FrameTextures, PointSurface, frame_of
from ..core.images import RGBA16, RGBA32F, Fitted, Image, empty
from ..core.passes import FullscreenPass, FullscreenPasses
from ..core.steps import Steps
from .view_consensus import Consensus, way_between

LEAST_VIEWS = 3  # of two, one may show a highlight or the other a shadow
STRIDE = 4  # pixels between those in which noise is measured


def describe_missing_views() -> str:
    """Say what highlights are removed from, for frames that are too few."""
    return (
        f"{option('remove_highlights')} needs {LEAST_VIEWS} or more views of one object, with colours: "
        "highlights are what moves from view to view. The colours stay"
    )


class _Seen(NamedTuple):
    """A frame, and what makes it comparable with others."""

    textures: FrameTextures
    surface: PointSurface
    colors: Colors
    gain: tuple[float, ...]


class HighlightRemovalPass(FullscreenPasses):
    """Finds where one frame is brighter than others that see the same points, and gives it their colours there."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps, self._adding = steps, AdditiveBlend(context)
        self._sums = self._keep(Fitted(context, Image, RGBA32F, RGBA32F))
        self._excess, self._rows, self._samples, self._found = (
            self._keep(Fitted(context, Image, RGBA32F)) for _ in range(4)
        )

    def find(
        self, members: Sequence[FrameTextures], colors: Sequence[Colors], consensus: Consensus
    ) -> tuple[Colors, ...]:
        """Return each frame's colours without highlights; a frame that contradicts the others keeps its own."""
        frames = [frame_of(member) for member in members]
        gains = [tuple(gain) for gain in consensus.gains.tolist()]
        surfaces = [member.surface for member in members]
        seen = list(map(_Seen, members, surfaces, colors, gains))
        tells = [frame.color is not None and k not in consensus.wrong for k, frame in enumerate(frames)]
        if sum(tells) < LEAST_VIEWS:
            members[0].note_once("highlights", "too few", frames[0].camera, describe_missing_views())
            return tuple(colors)
        found = list(colors)
        for k, others in enumerate(nearest_others(frames)):
            if tells[k]:
                voters = tuple(seen[j] for j in others if tells[j])
                member, own = members[k], colors[k]
                image = member.matte = member.matte or Image(self._context, own.texture.size, RGBA16)
                self._steps.run("matte", self._remove, seen[k], voters, consensus.band, image, of=member)
                found[k] = Colors(image.texture, image)
        return tuple(found)

    def _remove(self, one: _Seen, voters: tuple[_Seen, ...], band: float, matte: Image) -> None:
        """Write a frame's picture without the highlights that others do not show."""
        size, color_map, gain = one.textures.size, {"color_map": one.colors.texture}, {"gain": one.gain}
        sums, excess, rows, found = (images.fit(size) for images in (self._sums, self._excess, self._rows, self._found))
        self._add_up(sums, one, voters, band)
        stages = [self.fullscreen("points/highlights.frag", STAGE=stage) for stage in range(4)]
        sum_map, rows_map = {"sum_map": sums.textures[0]}, {"rows_map": rows.texture}
        stages[0].draw(excess.target, color_map | sum_map | {"vote_map": sums.textures[1]}, **gain)
        stages[1].draw(rows.target, {"excess_map": excess.texture})
        noise = self._noise(stages[2], rows)
        stages[3].draw(found.target, sum_map | rows_map, noise=noise, **gain)
        removal = self.fullscreen("points/highlight_removal.frag")
        removal.draw(matte.target, color_map | {"found_map": found.texture})
        matte.raise_version()

    def _add_up(self, sums: Image, one: _Seen, voters: tuple[_Seen, ...], band: float) -> None:
        """The sums of what others say about a frame's points."""
        maps = {"surface_map": one.surface.texture, "color_map": one.colors.texture}
        values = {"band": band, "gain": one.gain}
        empty(sums.target)
        darker = self.fullscreen("points/darker_views.frag")
        with self._adding.on():
            for other in voters:
                theirs = {"other_map": other.surface.texture, "other_color_map": other.colors.texture}
                way = way_between(frame_of(one.textures), frame_of(other.textures))
                darker.draw(sums.target, maps | theirs, **way, **values, other_gain=other.gain)

    def _noise(self, stage: FullscreenPass, rows: Image) -> float:
        width, height = (-(-side // STRIDE) for side in rows.size)
        samples = self._samples.fit((width, height))
        stage.draw(samples.target, {"rows_map": rows.texture}, stride=STRIDE)
        return excess_noise(samples.read().reshape(-1, 4))
