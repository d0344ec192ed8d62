"""Compares several frames of one object: depth agreement, exposure, and votes on which points to trust."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import Count
from ...estimation.agreement import contradictions
from ...estimation.multi_view import Comparison, band_of, best_spreads, compared, gains_of, nearest_others
from ...scene.camera import view_matrix
from ...scene.frame import Frame
from ..core.additive_blend import AdditiveBlend
from ..core.frame_textures import Colors, FrameTextures, PointSurface, frame_of
from ..core.images import RG8, Fitted, Image, Images, empty
from ..core.passes import FullscreenPasses
from ..core.steps import Steps
from .pose_notes import Told

Seen = tuple[FrameTextures, PointSurface, Colors]
Voter = tuple[FrameTextures, PointSurface]
STRIDE = 8  # pixels, as in view_difference.frag


class Consensus(NamedTuple):
    """What several frames of one object agree on."""

    band: float  # share of 1/z within which two frames see the same surface
    gains: NDArray[np.float64]  # (n, 3) what each frame's linear colours are multiplied by
    wrong: frozenset[int]  # the numbers of frames that contradict the others
    spreads: NDArray[np.float64]  # (n,) of depths beside the frame that agrees best, shares of them


class ConsensusPass(FullscreenPasses):
    """Compares frames in pairs, and lets them vote on each other's points, independent of the view."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps, self._adding = steps, AdditiveBlend(context)
        self._votes = self._keep(Fitted(context, Image, RG8))  # in steps of 1/255
        self._ends = self._keep(Fitted(context, Image, RG8))  # how far surfaces reach, these two
        self._rows = self._keep(Fitted(context, Image, RG8))
        self._bands: WeakKeyDictionary[FrameTextures, tuple[int, float]] = WeakKeyDictionary()  # of votes, by version
        self._told = Told()

    def find(self, members: Sequence[FrameTextures], colors: Sequence[Colors], count: Count) -> Consensus:
        """Find what frames with estimated normals agree on, and write the trust in each point to their textures.

        A frame that contradicts the others has no vote: its points only close holes. A note names it. count: of frames
        that were judged
        """
        for member in members:
            member.trust = member.trust or Image(self._context, member.size, RG8)
        made = [image for member in members for image in (member.surface, member.trust)]
        find = partial(self._find, count=count)  # of which no step sees that it is another
        return self._steps.run("consensus", find, tuple(members), tuple(colors), made, of=members[0])

    def _find(
        self, members: Sequence[FrameTextures], colors: Sequence[Colors], _: list[Images], count: Count
    ) -> Consensus:
        inputs, frames = [(member, member.surface) for member in members], list(map(frame_of, members))
        seen = [(*one, color) for one, color in zip(inputs, colors, strict=True)]
        others = nearest_others(frames)
        comparisons = {
            (i, j): self._steps.run("agreement", self._compare_two, seen[i], seen[j], of=(members[i], members[j]))
            for i, known in enumerate(others)
            for j in known
        }
        found, spreads = contradictions(comparisons, len(members)), best_spreads(comparisons, len(members))
        before = self._band_before(members)
        self._told.tell(members, frames, found, goes_on=before is not None)
        comparisons = {pair: one for pair, one in comparisons.items() if not found.frames.intersection(pair)}
        band = band_of(comparisons, before)
        for k, member in enumerate(members):
            if k in found.frames:
                self._steps.run("trust", self._distrust, *inputs[k], of=member)
            else:
                voters = tuple(inputs[j] for j in others[k] if j not in found.frames)
                self._steps.run("trust", self._judge, *inputs[k], voters, band, of=member)
            self._bands[member] = member.version, band
            count.step()
        return Consensus(band, gains_of(comparisons, len(members)), found.frames, spreads)

    def _band_before(self, members: Sequence[FrameTextures]) -> float | None:
        """Return the depth tolerance of the last votes, if one of these frames took part in them."""
        for member in members:
            version, band = self._bands.get(member, (None, None))
            if version == member.version:
                return band
        return None

    def _compare_two(self, one: Seen, other: Seen) -> Comparison:
        (textures, surface, colors), (_, other_surface, other_colors) = one, other
        maps = {"surface_map": surface.texture, "color_map": colors.texture}
        maps |= {"other_map": other_surface.texture, "other_color_map": other_colors.texture}
        frame, other_frame = frame_of(one[0]), frame_of(other[0])
        width, height = (max(side // STRIDE, 1) for side in textures.size)
        image = Image(self._context, (width, height))
        try:
            empty(image.target)
            compare = self.fullscreen("points/view_difference.frag", STRIDE=STRIDE)
            compare.draw(image.target, maps, **way_between(frame, other_frame))
            colored = frame.color is not None and other_frame.color is not None
            return compared(image.read().reshape(-1, 4), colored)
        finally:
            image.release()

    def _judge(self, member: FrameTextures, surface: PointSurface, voters: tuple[Voter, ...], band: float) -> None:
        """Write the trust in a frame's points, from the votes of other frames."""
        frame = frame_of(member)
        votes, ends, rows = (images.fit(member.size) for images in (self._votes, self._ends, self._rows))
        maps = {"surface_map": surface.texture}
        empty(votes.target)
        support = self.fullscreen("points/view_votes.frag")
        with self._adding.on():
            for other, other_surface in voters:
                others = {"other_map": other_surface.texture}
                support.draw(votes.target, maps | others, **way_between(frame, frame_of(other)), band=band)
        source = {"source": frame.camera.intrinsics}
        stages = [self.fullscreen("points/point_confidence.frag", STAGE=stage) for stage in range(3)]
        assert member.trust is not None
        for image in (ends, rows, member.trust):
            empty(image.target)
        stages[0].draw(ends.target, maps, **source)
        stages[1].draw(rows.target, {"ends_map": ends.texture})
        last = maps | {"rows_map": rows.texture, "votes_map": votes.texture}
        stages[2].draw(member.trust.target, last, **source)
        member.trust.raise_version()

    def _distrust(self, member: FrameTextures, _: PointSurface) -> None:
        assert member.trust is not None
        empty(member.trust.target)
        member.trust.raise_version()


def way_between(frame: Frame, other: Frame) -> dict[str, object]:
    """Return the uniforms that project one frame into another."""
    view = view_matrix(frame.pose, other.pose).T.astype("f4").tobytes()
    return {"source": frame.camera.intrinsics, "other": other.camera.intrinsics, "view": view}
