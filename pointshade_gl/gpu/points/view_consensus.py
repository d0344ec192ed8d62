"""Compares several frames of one object: depth agreement, exposure, highlights; and notes about their poses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple
from weakref import WeakKeyDictionary

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import Count
from ...estimation.agreement import LONGER_SIDE, Contradictions, ReducedFrame, contradictions
from ...estimation.multi_view import (
    FINEST,
    Comparison,
    band_of,
    best_spreads,
    compared,
    excess_noise,
    gains_of,
    nearest_others,
)
from ...notes.notes import print_note
from ...notes.words import option
from ...scene.camera import Camera, view_matrix
from ...scene.frame import Frame
from ..core.frame_textures import Colors, FrameTextures, PointSurface, frame_of
from ..core.images import (
    R32F,
    RG8,
    RGBA8,
    RGBA16,
    RGBA16F,
    RGBA32F,
    Box,
    Fitted,
    Image,
    Images,
    empty,
    read_texture,
)
from ..core.programs import AdditiveBlend, FullscreenPasses
from ..core.steps import Steps


class PrintedNotes:
    """Remembers which notes on poses were printed: a live stream would repeat them thirty times a second."""

    def __init__(self) -> None:
        self._poses: WeakKeyDictionary[FrameTextures, bytes] = WeakKeyDictionary()  # of the frames that were named

    def tell(
        self, members: Sequence[FrameTextures], frames: Sequence[Frame], found: Contradictions, goes_on: bool
    ) -> None:
        """Print notes on frames whose poses are wrong or missing.

        goes_on  some of the frames are those of the last time: notes on the others then also hold for the new ones
        """
        notes = _notes_on(frames, found)
        for k, member in enumerate(members):
            if k not in notes:
                self._poses.pop(member, None)
                continue
            before, pose = self._poses.get(member), frames[k].pose.tobytes()
            self._poses[member] = pose
            if before is None or not (goes_on or before == pose):
                print_note(notes[k])


def _notes_on(frames: Sequence[Frame], found: Contradictions) -> dict[int, str]:
    """Return the notes by the frame that each is about; a note on all frames is under the first."""
    first, count = frames[0], len(frames)
    if any(frame is not first for frame in frames) and all(np.array_equal(frame.pose, first.pose) for frame in frames):
        ways = "give each Frame its own, or find them with `pointshade align`"
        return {0: f"the {count} frames all have the same pose: if their camera moved, {ways}"}
    wrong = "contradicts the others where they see the same, and only fills gaps: is its pose right?"
    named = {k: f"frame {k} of {count} {wrong}" for k in found.frames}
    if not found.undecided:
        return named
    return {0: f"the {count} frames contradict each other where they see the same: are their poses right?"} | named


Seen = tuple[FrameTextures, PointSurface, Colors]
Voter = tuple[FrameTextures, PointSurface]
STRIDE = 8  # pixels, as in view_difference.frag
EDGE_REACH = 4  # pixels from a point to where its surface ends that matter, as in consensus.glsl


class Consensus(NamedTuple):
    """What several frames of one object agree on."""

    band: float  # share of 1/z within which two frames see the same surface
    fine_band: float  # the same where they are compared pixel by pixel: less for frames without noise
    gains: NDArray[np.float64]  # (n, 3) what each frame's linear colours are multiplied by
    is_exact: bool  # they have no noise, and no depth where nothing is
    wrong: frozenset[int]  # the numbers of frames that contradict the others
    spreads: NDArray[np.float64]  # (n,) of depths beside the frame that agrees best, shares of them


class ConsensusPass(FullscreenPasses):
    """Compares frames in pairs, and lets them vote on each other's points, independent of the view."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps, self._adding = steps, AdditiveBlend(context)
        self._votes = self._keep(Fitted(context, Image, RGBA8, RGBA16F, R32F))  # outputs of view_votes.frag
        self._ends = self._keep(Fitted(context, Image, RG8))  # how far surfaces reach, these two
        self._rows = self._keep(Fitted(context, Image, RG8))
        self._bands: WeakKeyDictionary[FrameTextures, tuple[int, float]] = WeakKeyDictionary()  # of votes, by version
        self._printed = PrintedNotes()

    def find(self, members: Sequence[FrameTextures], colors: Sequence[Colors], count: Count) -> Consensus:
        """Find what frames with estimated normals agree on, and write the trust in each point to their textures.

        A frame that contradicts the others has no vote: its points only close holes. A note names it. count: of frames
        that were judged
        """
        for member in members:
            member.trust = member.trust or Image(self._context, member.size, RG8, RGBA8)
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
        known = (self._bands.get(member, (None, None)) for member in members)
        kept = (band for (version, band), member in zip(known, members, strict=True) if version == member.version)
        before = next(kept, None)  # the depth tolerance of the last votes, if one of these took part in them
        self._printed.tell(members, frames, found, goes_on=before is not None)
        comparisons = {pair: one for pair, one in comparisons.items() if not found.frames.intersection(pair)}
        band = band_of(comparisons, before)
        mute = found.frames.union(k for k, frame in enumerate(frames) if frame.points_known == 0)  # these have no vote
        is_exact = all(_shows_nothing(member) for k, member in enumerate(members) if k not in mute)
        fine_band = min(band, band_of(comparisons, None, FINEST)) if is_exact else band
        for k, member in enumerate(members):
            if k in found.frames:
                self._steps.run("trust", self._distrust, *inputs[k], of=member)
            else:
                voters = tuple(inputs[j] for j in others[k] if j not in mute)
                self._steps.run("trust", self._judge, *inputs[k], voters, fine_band, is_exact, of=member)
            self._bands[member] = member.version, band
            count.step()
        return Consensus(band, fine_band, gains_of(comparisons, len(members)), is_exact, found.frames, spreads)

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

    def _judge(
        self, member: FrameTextures, surface: PointSurface, voters: tuple[Voter, ...], band: float, is_exact: bool
    ) -> None:
        """Write the trust in a frame's points and where its rims end, from the votes of other frames."""
        frame = frame_of(member)
        votes, ends, rows = (images.fit(member.size) for images in (self._votes, self._ends, self._rows))
        maps, rules = {"surface_map": surface.texture}, {"band": band, "is_exact": is_exact}
        assert member.trust is not None
        for image in (votes, ends, rows, member.trust):
            empty(image.target, widened(surface.window, EDGE_REACH, member.size))
        support = self.fullscreen("points/view_votes.frag")
        with self._adding.on():
            for other, other_surface in voters:
                others = {"other_map": other_surface.texture}
                support.draw(votes.target, maps | others, **way_between(frame, frame_of(other)), **rules)
        source = {"source": frame.camera.intrinsics}
        stages = [self.fullscreen("points/point_confidence.frag", STAGE=stage) for stage in range(3)]
        stages[0].draw(ends.target, maps, **source)
        stages[1].draw(rows.target, {"ends_map": ends.texture})
        found = dict(zip(("votes_map", "beside_map", "here_map"), votes.textures, strict=True))
        stages[2].draw(member.trust.target, maps | found | {"rows_map": rows.texture}, **source, **rules)
        member.trust.raise_version()

    def _distrust(self, member: FrameTextures, _: PointSurface) -> None:
        assert member.trust is not None
        empty(member.trust.target)
        member.trust.raise_version()


def widened(window: Box, by: int, size: tuple[int, int]) -> Box:
    """Return a window with so many more pixels on each side, inside of a picture."""
    left, top = (max(at - by, 0) for at in window[:2])
    right, bottom = (min(at + side + by, most) for at, side, most in zip(window[:2], window[2:], size, strict=True))
    return left, top, right - left, bottom - top


def _shows_nothing(member: FrameTextures) -> bool:
    """Return whether a frame without noise has pixels without depth: then there is nothing."""
    noise, frame = member.choice.noise, frame_of(member)
    return noise is not None and noise.is_clean and frame.points_known < frame.depth.size


def way_between(frame: Frame, other: Frame) -> dict[str, object]:
    """Return the uniforms that project one frame into another."""
    view = view_matrix(frame.pose, other.pose).T.astype("f4").tobytes()
    return {"source": frame.camera.intrinsics, "other": other.camera.intrinsics, "view": view}


class FrameReductionPass(FullscreenPasses):
    """Reduces frames with estimated normals."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._copy = self._keep(Fitted(context, Image, RGBA32F, R32F))

    def read(self, textures: FrameTextures) -> ReducedFrame:
        """Return the reduced copy of a frame whose normals are known."""
        frame = frame_of(textures)
        camera, cell = reduced_camera(frame.camera)
        image = self._copy.fit((camera.width, camera.height))
        maps = {"surface_map": textures.surface.texture, "color_map": textures.color}
        reduce = self.fullscreen("points/frame_reduction.frag")
        reduce.draw(image.target, maps, source=frame.camera.intrinsics, cell=cell)
        has_slopes = frame.color is not None and min(camera.width, camera.height) > 1
        brightness = read_texture(self._context, image.textures[1])[..., 0] if has_slopes else None
        reduced = ReducedFrame(camera, image.read(), brightness)
        if not reduced.is_textured:
            reduced.brightness = None
        return reduced


def reduced_camera(camera: Camera) -> tuple[Camera, int]:
    """Return the camera of a frame's reduced copy, and how many pixels along a side are one of its pixels."""
    cell = max(round(max(camera.width, camera.height) / LONGER_SIDE), 1)
    cell = min(cell, camera.width, camera.height)
    width, height = camera.width // cell, camera.height // cell
    cx, cy = ((place - cell // 2) / cell for place in (camera.cx, camera.cy))
    return Camera(camera.fx / cell, camera.fy / cell, cx, cy, width, height), cell


LEAST_VIEWS = 3  # of two, one may show a highlight or the other a shadow
HIGHLIGHT_STRIDE = 4  # pixels between those in which noise is measured


def describe_missing_views() -> str:
    """Say what highlights are removed from, for frames that are too few."""
    needed = f"{option('remove_highlights')} needs {LEAST_VIEWS} or more views of one object, with colours"
    return f"{needed}: highlights are what moves from view to view. The colours stay"


class _SeenNotes(NamedTuple):
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
        images = (self._keep(Fitted(context, Image, RGBA32F)) for _ in range(4))
        self._excess, self._rows, self._samples, self._found = images

    def find(
        self, members: Sequence[FrameTextures], colors: Sequence[Colors], consensus: Consensus
    ) -> tuple[Colors, ...]:
        """Return each frame's colours without highlights; a frame that contradicts the others keeps its own."""
        frames = [frame_of(member) for member in members]
        gains = [tuple(gain) for gain in consensus.gains.tolist()]
        surfaces = [member.surface for member in members]
        seen = list(map(_SeenNotes, members, surfaces, colors, gains))
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

    def _remove(self, one: _SeenNotes, voters: tuple[_SeenNotes, ...], band: float, matte: Image) -> None:
        """Write a frame's picture without the highlights that others do not show."""
        size, color_map, gain = one.textures.size, {"color_map": one.colors.texture}, {"gain": one.gain}
        sums, excess, rows, found = (images.fit(size) for images in (self._sums, self._excess, self._rows, self._found))
        self._add_up(sums, one, voters, band)
        stages = [self.fullscreen("points/highlights.frag", STAGE=stage) for stage in range(4)]
        sum_map, rows_map = {"sum_map": sums.textures[0]}, {"rows_map": rows.texture}
        stages[0].draw(excess.target, color_map | sum_map | {"vote_map": sums.textures[1]}, **gain)
        stages[1].draw(rows.target, {"excess_map": excess.texture})
        samples = self._samples.fit((-(-size[0] // HIGHLIGHT_STRIDE), -(-size[1] // HIGHLIGHT_STRIDE)))
        stages[2].draw(samples.target, rows_map, stride=HIGHLIGHT_STRIDE)
        noise = excess_noise(samples.read().reshape(-1, 4))
        stages[3].draw(found.target, sum_map | rows_map, noise=noise, **gain)
        removal = self.fullscreen("points/highlight_removal.frag")
        removal.draw(matte.target, color_map | {"found_map": found.texture})
        matte.raise_version()

    def _add_up(self, sums: Image, one: _SeenNotes, voters: tuple[_SeenNotes, ...], band: float) -> None:
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
