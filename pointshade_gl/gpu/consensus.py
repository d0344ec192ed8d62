"""What several frames of one thing say about each other: agreement of depths, exposures, and votes on points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..camera import view_matrix
from ..consensus import Comparison, band_of, compared, contradicting, gains_of, nearest_others
from ..frame import Frame
from ..notes import print_note
from .adding import Adding
from .memory import Owner
from .passes import FullscreenPass
from .steps import Steps
from .textures import FrameTextures, Images, PointSurface, TrustImage, empty

STRIDE = 8  # pixels, as in compare.frag


class Member(NamedTuple):
    """One frame of a set on the GPU, its normals estimated."""

    textures: FrameTextures
    frame: Frame


class Consensus(NamedTuple):
    """What a set of frames agrees on."""

    band: float  # share of 1/z within which two frames see the same surface
    gains: NDArray[np.float64]  # (n, 3) what each frame's linear colours are multiplied by


class ConsensusPass(Owner):
    """Compares frames in pairs, and lets them vote. A new view or light asks for nothing new."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps, self._adding = steps, Adding(context)
        self._images: JudgeImages | None = None
        with self._all_or_nothing():
            self._compare = self._keep(FullscreenPass(context, "compare.frag", STRIDE=STRIDE))
            self._support = self._keep(FullscreenPass(context, "support.frag"))
            self._stages = [self._keep(FullscreenPass(context, "trust.frag", STAGE=stage)) for stage in range(3)]

    def find(self, members: Sequence[Member]) -> Consensus:
        """The consensus; each frame's textures get their trust."""
        others = nearest_others([member.frame for member in members])
        comparisons: dict[tuple[int, int], Comparison] = {}
        for i, j in chain.from_iterable(((i, j) for j in known) for i, known in enumerate(others)):
            one, other = members[i], members[j]
            inputs = one.textures, one.textures.surface, one.frame, other.textures, other.textures.surface, other.frame
            of = one.textures, other.textures
            comparisons[i, j] = self._steps.run("agreement", self._compare_two, *inputs, of=of)
        band = band_of(comparisons)
        for member, known in zip(members, others, strict=True):
            textures = member.textures
            textures.trust = textures.trust or TrustImage(self._context, textures.size)
            voters = tuple((members[j].textures.surface, members[j].frame) for j in known)
            self._steps.run("trust", self._judge, textures, textures.surface, member.frame, voters, band, of=textures)
        found = tuple(comparisons), tuple(comparisons.values())
        return Consensus(band, self._steps.run("gains", self._settle, *found, len(members), of=members[0].textures))

    def _settle(
        self, pairs: tuple[tuple[int, int], ...], found: tuple[Comparison, ...], count: int
    ) -> NDArray[np.float64]:
        """The gains. Tells which frames contradict all others."""
        comparisons = dict(zip(pairs, found, strict=True))
        for k in contradicting(comparisons, count):
            print_note(f"frame {k} of {count} contradicts all others that see the same: is its pose right?")
        return gains_of(comparisons, count)

    def _compare_two(
        self,
        one: FrameTextures,
        surface: Images,
        frame: Frame,
        other: FrameTextures,
        other_surface: Images,
        seen: Frame,
    ) -> Comparison:
        size = max(one.size[0] // STRIDE, 1), max(one.size[1] // STRIDE, 1)
        maps = {"surface_map": one.surface.texture, "color_map": one.color}
        maps |= {"other_map": other.surface.texture, "other_color_map": other.color}
        image = Samples(self._context, size)
        try:
            empty(image.target)
            self._compare.draw(image.target, maps, **_way(frame, seen))
            return compared(np.frombuffer(image.samples.read(), np.float32).reshape(-1, 4))
        finally:
            image.release()

    def _judge(
        self,
        textures: FrameTextures,
        surface: Images,
        frame: Frame,
        voters: tuple[tuple[PointSurface, Frame], ...],
        band: float,
    ) -> None:
        """The trust in a frame's points, from the votes of others."""
        images = self._fit(textures.size)
        maps = {"surface_map": textures.surface.texture}
        empty(images.votes_target)
        with self._adding.on():
            for other, seen in voters:
                others = {"other_map": other.texture}
                self._support.draw(images.votes_target, maps | others, **_way(frame, seen), band=band)
        source = {"source": frame.camera.intrinsics}
        assert textures.trust is not None
        for target in (images.ends_target, images.rows_target, textures.trust.target):
            empty(target)
        self._stages[0].draw(images.ends_target, maps, **source)
        self._stages[1].draw(images.rows_target, {"ends_map": images.ends})
        last = maps | {"rows_map": images.rows, "votes_map": images.votes}
        self._stages[2].draw(textures.trust.target, last, **source)
        textures.trust.raise_version()

    def _fit(self, size: tuple[int, int]) -> JudgeImages:
        if self._images is None or self._images.size != size:
            if self._images is not None:
                self._images.release()
            self._images = None
            self._images = JudgeImages(self._context, size)
        return self._images

    def release(self) -> None:
        if self._images is not None:
            self._images.release()
        super().release()


class Samples(Images):
    """What compare.frag writes (RGBA32F)."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        with self._all_or_nothing():
            self.samples = self._texture(4, "f4")
            self.target = self._framebuffer(self.samples)


class JudgeImages(Images):
    """Votes, in steps of 1/255, and how far surfaces reach (all RG8), for one size of frame."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        with self._all_or_nothing():
            self.votes, self.ends, self.rows = (self._texture(2) for _ in range(3))
            self.votes_target, self.ends_target, self.rows_target = (
                self._framebuffer(image) for image in (self.votes, self.ends, self.rows)
            )


def _way(frame: Frame, other: Frame) -> dict[str, object]:
    """The uniforms of the way from one frame into another."""
    view = view_matrix(frame.pose, other.pose).T.astype("f4").tobytes()
    return {"source": frame.camera.intrinsics, "other": other.camera.intrinsics, "view": view}
