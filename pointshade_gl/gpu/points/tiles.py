"""Draws frames that are too large for the GPU tile by tile, through one set of textures."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import moderngl
import numpy as np

from ...scene.appearance import LIT_EARLY, Look
from ...scene.frame import Frame
from ...scene.noise import Choice, Noise
from ..core.frame_textures import DepthTextures, FrameTextures, PointSurface
from ..core.images import Box, confine
from ..core.steps import Steps, Versioned
from ..surface.frame_store import DrawnPoints, FrameStore
from .point_objects import PointObjects, Points, ShownPoints
from .tiling import Tile, cut_frame, cut_look, noise_in, sample_depth, tiles_of


class TiledPoints(Versioned):
    """The points of a large frame. To draw them, iterate over its tiles, each of which is on the GPU for its turn.

    choice  which method estimated the normals, and why
    """

    def __init__(self, store: TileStore, frame: Frame, look: Look, pose: np.ndarray, scale: float):
        self.frame, self.look, self.pose, self.scale = frame, look, pose, scale
        self.choice = Choice("")  # nothing yet
        self._store = store
        self._light: Callable[[ShownPoints], None] | None = None
        self._noise: Noise | None = None

    @property
    def points(self) -> TiledPoints:
        """All that its shadow depends on."""
        return self

    @property
    def shading(self) -> str:
        return self.look.shading

    @property
    def has_doubts(self) -> bool:
        """Return whether some of the normals are uncertain and are used."""
        noise = self._measured() if self.shading == "phong" else None
        if noise is None or self.look.noise is not None:
            return noise is not None
        return noise.grid is not None and not (self.look.normals == "auto" and noise.is_clean)

    def light_with(self, light: Callable[[ShownPoints], None]) -> None:
        """Set the function that lights the points of each tile, for shading models that interpolate light."""
        self._light = light
        self.raise_version()

    def each(self, lit: bool = True) -> Iterator[ShownPoints]:
        """Yield each tile while it is on the GPU: only until the next one is asked for."""
        for tile in self._tiles():
            shown = self._show(tile)
            if lit and self._light and shown.light:
                self._light(shown)
            self._store.confine(shown.points, tile.drawn)
            yield shown

    def gather(self, read: Callable[[ShownPoints], np.ndarray]) -> np.ndarray:
        """Read every tile, (h, w, n), and return one array of the frame's size."""
        whole: np.ndarray | None = None
        for tile, shown in zip(self._tiles(), self.each(), strict=True):
            part, (u, v, wide, high) = read(shown), tile.drawn
            if whole is None:
                whole = np.empty((*self.frame.depth.shape, part.shape[2]), part.dtype)
            left, top = tile.box[0] + u, tile.box[1] + v
            whole[top : top + high, left : left + wide] = part[v : v + high, u : u + wide]
        assert whole is not None
        return whole

    def _tiles(self) -> list[Tile]:
        height, width = self.frame.depth.shape
        return tiles_of(width, height, self._store.largest_side)

    def _show(self, tile: Tile) -> ShownPoints:
        frame, look = cut_frame(self.frame, tile.box), cut_look(self.look, tile.box)
        noise = self._measured()
        noise = noise and noise_in(tile.box, noise, self.frame.depth.shape)
        textures, drawn = self._store.put(frame, look, noise)
        self.choice = textures.choice
        sizes = look.sizes_for(frame.depth)
        points = Points(drawn.surface, drawn.camera, self.pose, self.scale, sizes, look.splat)
        light = drawn.lit if look.shading in LIT_EARLY else None
        return ShownPoints(points, textures, drawn.colors, light, look.shading)

    def _measured(self) -> Noise | None:
        """Return the noise of the whole frame, for estimators that depend on it; None for others."""
        if not isinstance(self.look.normals, str) or self.look.normals not in ("auto", "adaptive"):
            return None
        self._noise = self._noise or self._store.measure_noise(self.frame)
        return self._noise


class TileStore:
    """Keeps the textures that all large frames share, and the large frames in use."""

    def __init__(self, context: moderngl.Context, steps: Steps, frames: FrameStore, points: PointObjects):
        self._context, self._steps, self._frames, self._points = context, steps, frames, points
        self._textures: FrameTextures | None = None
        self._estimated: Box = 0, 0, 0, 0  # the part of them that has surfaces
        self._known: list[TiledPoints] = []
        self.largest_side: int = context.info["GL_MAX_TEXTURE_SIZE"]

    def points_of(self, frame: Frame, look: Look, pose: np.ndarray, scale: float) -> TiledPoints:
        """Return a frame's points: the same object again if nothing has changed, so that steps recognise it."""
        for known in self._known:
            is_same = known.frame is frame and known.look is look and known.scale == scale
            if is_same and np.array_equal(known.pose, pose):
                return known
        self._known.append(TiledPoints(self, frame, look, pose, scale))
        return self._known[-1]

    def keep_only(self, used: list[TiledPoints]) -> None:
        """Forget all other large frames. Without any, the textures are freed."""
        self._known = [known for known in self._known if known in used]
        if not used:
            self.release()

    def measure_noise(self, frame: Frame) -> Noise:
        """Measure the noise of a frame on pieces of it."""
        sample = sample_depth(frame.depth)
        depth = DepthTextures(self._context, sample.shape[::-1])
        try:
            depth.depth.write(sample)
            return self._frames.measure_noise(depth, frame.camera)
        finally:
            depth.release()

    def put(self, frame: Frame, look: Look, noise: Noise | None) -> tuple[FrameTextures, DrawnPoints]:
        """Upload a tile in place of the last one."""
        if self._textures is None or not self._textures.fits(frame):
            self.release()
            self._textures = FrameTextures(self._context, frame)
        textures = self._textures
        textures.surface.window = self._estimated
        self._steps.run("upload", textures.upload, frame, of=textures)
        textures.noise = noise
        drawn = self._frames.find_points(textures, frame, look, frame.camera)
        self._estimated = drawn.surface.window
        return textures, drawn

    def confine(self, points: Points, box: Box) -> None:
        """Restrict what is drawn of a tile to this box."""
        surface = points.surface
        surface.window = box
        if self._points.can_light(points):  # GL points draw all that they find
            clear_around(surface, box)
            confine(surface.target, self._estimated)
            self._context.finish()  # the vertex shaders of llvmpipe do not wait for what is still being drawn

    def release(self) -> None:
        if self._textures is not None:
            self._steps.forget(of=self._textures.images)
            self._textures.release()
        self._textures, self._estimated = None, (0, 0, 0, 0)


def clear_around(surface: PointSurface, box: Box) -> None:
    """Remove the points of a surface outside a box."""
    (width, height), (left, top, wide, high) = surface.size, box
    right, bottom = left + wide, top + high
    confine(surface.target, None)
    surface.target.use()
    for strip in (
        (0, 0, width, top), (0, bottom, width, height - bottom), (0, top, left, high), (right, top, width - right, high)
    ):  # fmt: skip
        if strip[2] and strip[3]:
            surface.target.clear(viewport=strip)
