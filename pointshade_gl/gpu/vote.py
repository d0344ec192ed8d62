"""Vote pass: a small surface -> the same surface at a larger size, its outlines as the colour picture shows them."""

from __future__ import annotations

import math

import moderngl

from ..camera import Camera
from .memory import Owner
from .passes import FullscreenPass, data_texture
from .textures import Box, FrameTextures, PointSurface


class VotePass(Owner):
    """Colour decides which surface a pixel lies on, its place alone decides how far away and how turned it is."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._find_guide = self._keep(FullscreenPass(context, "vote_guide.frag"))
            self._vote = self._keep(FullscreenPass(context, "vote.frag"))
        self._guide: Guide | None = None

    def run(self, frame: FrameTextures, small: PointSurface, camera: Camera, large: PointSurface) -> None:
        """small: the surface as the camera saw it, at the depth's size."""
        inputs = {"surface_map": small.texture, "color_map": frame.color, "source": camera.intrinsics, "least_span": 1.0}
        guide = self._fit(small.size)
        self._find_guide.draw(guide.target, inputs)
        large.confine(_enlarged(small.window, small.size, large.size))
        self._vote.draw(large.target, inputs | {"guide_map": guide.image, "large_size": large.size})
        large.raise_version()

    def _fit(self, size: tuple[int, int]) -> Guide:
        if self._guide is None or self._guide.size != size:
            if self._guide is not None:
                self._guide.release()
            self._guide = None
            self._guide = Guide(self._context, size)
        return self._guide

    def release(self) -> None:
        if self._guide is not None:
            self._guide.release()
        super().release()


class Guide(Owner):
    """What the vote asks of each sample: its mean colour, and whether all around it lies on its plane."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context)
        self.size = size
        with self._all_or_nothing():
            self.image = self._keep(data_texture(context, *size, 4))
            self.target = self._allocate(context.framebuffer, [self.image])


def _enlarged(window: Box, size: tuple[int, int], larger: tuple[int, int]) -> Box:
    """The part of a larger picture where samples in a window of the smaller one may be seen: a sample further."""
    edges = []
    for axis in (0, 1):
        low, high = window[axis] - 1, window[axis] + window[axis + 2] + 1
        scale = larger[axis] / size[axis]
        edges.append((max(math.floor(low * scale), 0), min(math.ceil(high * scale), larger[axis])))
    (left, right), (top, bottom) = edges
    return left, top, right - left, bottom - top
