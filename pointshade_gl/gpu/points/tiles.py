"""Draws frames that are too large for the GPU, tile by tile, through one of them at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...estimation.noise_model import BLOCK_PATCHES, PATCH_PITCH, noise_grid
from ...notes.words import option
from ...scene.appearance import LIT_EARLY, SWITCHES, Appearance
from ...scene.camera import Eye
from ...scene.frame import Frame
from ...scene.noise import Choice, Noise
from ..core.frame_textures import DepthTextures, FrameTextures, PointSurface
from ..core.images import Box, confine
from ..core.steps import Steps, Versioned
from ..core.view_images import Drawable, Target
from ..shading.light_set import ShadowTile
from ..surface.frame_store import DrawnPoints, FrameStore
from .point_objects import PointObjects, Points, ShownPoints

LARGEST_WHOLE = 1 << 25  # points of a frame that is still put on the GPU as a whole: about 0.8 GB
TILE_POINTS = 1 << 24  # of a tile
REACH = 32  # pixels: further than any estimator and any rim looks around a pixel
SEAM = 4  # pixels that neighbouring tiles both draw: colours and normals mix across the border
BLOCK = 4  # tiles begin at multiples of it, as the compute rasteriser merges pixels in blocks of 4x4,
GROUP = 128  # and are as wide as a multiple of it, because it draws so many columns at once
SAMPLE = 192  # pixels on each side of the pieces by which the noise of a frame is measured; with a gap round each
GAP = BLOCK_PATCHES * PATCH_PITCH
PIECES = 6  # of them along each side, at most


class Tile(NamedTuple):
    """A part of a frame.

    box    what is uploaded, pixels of the frame
    drawn  what is drawn of it, pixels of the tile; around it lies what estimators look at
    """

    box: Box
    drawn: Box


def needs_tiles(frame: Frame, look: Appearance, largest_side: int) -> bool:
    """Return whether a frame is drawn in tiles: it has too many points, or is larger than textures may be.

    A mesh, colours of another size than the depth, and what looks at the frame as a whole are not cut: raises
    ValueError if the depth is too large for that.
    """
    height, width = frame.depth.shape
    is_too_large = max(height, width) > largest_side
    obstacle, remedy = "", ""
    if look.splat == "mesh":
        obstacle, remedy = "a mesh", f"use {option('splat', 'footprint')}"
    elif frame.color is not None and frame.color.shape[:2] != (height, width):
        obstacle, remedy = "colours of another size", "bring them to the depth's size"
    elif whole := [name for name in SWITCHES if getattr(look, name)]:
        obstacle, remedy = option(whole[0]), "leave it out"
    if obstacle and is_too_large:
        limit = f"for {obstacle} on this GPU ({largest_side})"
        raise ValueError(f"depth of {width}x{height} is too large {limit}: {remedy}")
    return not obstacle and (is_too_large or frame.depth.size > LARGEST_WHOLE)


def tiles_of(width: int, height: int, largest_side: int) -> list[Tile]:
    """Divide a frame into tiles of one size: as wide as the frame, if textures may be so wide."""
    across = min(width, largest_side)
    down = min(height, largest_side, max(TILE_POINTS // across, 4 * REACH))
    columns = _spans(width, across, (across - 2 * REACH) // GROUP * GROUP - 2 * SEAM)
    rows = _spans(height, down, (down - 2 * REACH) // BLOCK * BLOCK)
    return [
        Tile((left, top, across, down), (u, v, wide, high)) for top, v, high in rows for left, u, wide in columns
    ]  # fmt: skip


def _spans(size: int, tile: int, step: int) -> list[tuple[int, int, int]]:
    """Divide one side: (first pixel of a tile, first that is drawn of it, how many are drawn)."""
    if size <= tile:
        return [(0, 0, size)]
    spans = []
    for first in range(0, size, step):
        start = max(min(first - REACH, size - tile), 0)
        low, high = max(first - SEAM, 0), min(first + step + SEAM, size)
        spans.append((start, low - start, high - low))
    return spans


def cut_frame(frame: Frame, box: Box) -> Frame:
    """Return a part of a frame. Its arrays are views of the whole frame's."""
    (left, top, width, height), part = box, object.__new__(Frame)
    cut = np.s_[top : top + height, left : left + width]
    camera = frame.camera
    camera = replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=width, height=height)
    color = None if frame.color is None else frame.color[cut]
    for name, value in (("color", color), ("depth", frame.depth[cut]), ("camera", camera), ("pose", frame.pose)):
        object.__setattr__(part, name, value)
    return part


def cut_look(look: Appearance, box: Box) -> Appearance:
    """Return the look for a part of a frame: options that are arrays are cut, too."""
    left, top, width, height = box
    cut, arrays = np.s_[top : top + height, left : left + width], look.options.items()
    cuts = {name: array[cut] for name, array in arrays if isinstance(array, np.ndarray)}
    return replace(look, **cuts) if cuts else look


def sample_depth(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return pieces of a large depth image, missing depth between them: enough to measure its noise."""
    rows, columns = (_starts(size) for size in depth.shape)
    sample = np.zeros((len(rows) * (SAMPLE + GAP), len(columns) * (SAMPLE + GAP)), np.float32)
    for j, v in enumerate(rows):
        for k, u in enumerate(columns):
            piece = depth[v : v + SAMPLE, u : u + SAMPLE]
            y, x = j * (SAMPLE + GAP), k * (SAMPLE + GAP)
            sample[y : y + piece.shape[0], x : x + piece.shape[1]] = piece
    return sample


def _starts(size: int) -> NDArray[np.int64]:
    """Return the first pixels of the pieces along one side."""
    count = int(np.clip(size // SAMPLE, 1, PIECES))
    return np.linspace(0, max(size - SAMPLE, 0), count).astype(np.int64)


def noise_in(box: Box, noise: Noise, shape: tuple[int, ...]) -> Noise:
    """Return the noise in a tile, from that of its frame's `sample_depth`: its grid between the pieces."""
    if noise.grid is None:
        return noise
    inside, blocks = SAMPLE // GAP, SAMPLE // GAP + 1
    pieces = noise.grid.reshape(noise.grid.shape[0] // blocks, blocks, noise.grid.shape[1] // blocks, blocks, 3)
    levels = np.median(pieces[:, :inside, :, :inside], axis=(1, 3))
    counts, first = noise_grid(*box[2:])
    across, down = (
        _between(box[axis] + first[axis] + GAP * (np.arange(counts[axis]) + 0.5), shape[1 - axis]) for axis in (0, 1)
    )
    return replace(noise, grid=np.einsum("rj,jkc,sk->rsc", down, levels, across).astype(np.float32))


def _between(places: NDArray[Any], size: int) -> NDArray[np.float64]:
    """Return (n, pieces) interpolation weights of the pieces along one side, at each place."""
    middles = _starts(size) + SAMPLE / 2
    return np.stack([np.interp(places, middles, one) for one in np.eye(len(middles))], -1)


class TiledPoints(Versioned, Drawable):
    """The points of a large frame. To draw them, iterate over its tiles, each of which is on the GPU for its turn.

    choice  which method estimated the normals, and why
    """

    def __init__(self, store: TileStore, frame: Frame, look: Appearance, pose: np.ndarray, scale: float):
        self.frame, self.look, self.pose, self.scale = frame, look, pose, scale
        self.choice = Choice("")  # nothing yet
        self._store = store
        self._light: Callable[[ShownPoints], None] | None = None
        self._noise: Noise | None = None

    @property
    def shading(self) -> str:
        return self.look.shading

    @property
    def choices(self) -> tuple[Choice, ...]:
        return (self.choice,)

    @property
    def weights(self) -> dict[Any, float]:
        return {self.frame: 1.0}

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        for part in self.each(lit=False):
            passes.points.add_shadow(tile, part.points, eye)

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        for part in self.each():
            passes.points.add_surface(target, part, eye, number)

    @property
    def has_doubts(self) -> bool:
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

    def points_of(self, frame: Frame, look: Appearance, pose: np.ndarray, scale: float) -> TiledPoints:
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

    def put(self, frame: Frame, look: Appearance, noise: Noise | None) -> tuple[FrameTextures, DrawnPoints]:
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
