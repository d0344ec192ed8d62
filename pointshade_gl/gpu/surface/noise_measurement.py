"""Measures the noise and rounding of depth, and averages depth and normals of a stream's frames over time."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import moderngl
import numpy as np

from ...estimation.noise_model import BLOCK_PATCHES, COARSE, Decisions, find_noise, given_noise, noise_grid
from ...scene.camera import Camera
from ...scene.frame import Frame
from ...scene.noise import Noise, NoiseWords
from ..core.frame_textures import DepthTextures, PointSurface
from ..core.images import RG32F, RGBA32F, Fitted, Image, Images, empty
from ..core.programs import FullscreenPasses, data_texture
from ..core.steps import Steps


class NoisePass(FullscreenPasses):
    """Measures on a quarter of the pixels; only a small grid of blocks is read back."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, NoiseImages))

    def measure(self, frame: DepthTextures, focal: float) -> Noise:
        """focal = mean focal length, pixels."""
        images = self._images.fit(frame.size)
        levels, counts = self._grid(frame, images, 1)
        coarse, structure = lambda: self._grid(frame, images, COARSE), lambda: self._structure(frame, images)
        return find_noise(levels, counts, focal, coarse, structure)

    def read(self, frame: DepthTextures, words: NoiseWords) -> Noise:
        """The caller's own, for this frame."""
        return given_noise(words, self._images.fit(frame.size).shape)

    def calm_depth(
        self, frame: DepthTextures, noise: Noise, told: np.ndarray | None, snap_focal: float = 0.0
    ) -> moderngl.Texture:
        """Average away most of the depth's noise. Returns RG32F: smoothed depth, and its remaining noise over depth.

        told        (1, 1) or (h, w) float32 metres, the caller's noise: it replaces what was measured, not the rounding
        snap_focal  mean focal length, pixels, to move flying pixels onto surfaces; 0 keeps them
        """
        images = self._images.fit(frame.size)
        grid = np.zeros((*images.shape, 3), np.float32) if noise.grid is None else noise.grid
        if told is not None:
            grid = grid * np.array([0, 1, 1], np.float32)
        images.grid.texture.write(np.ascontiguousarray(grid))
        constants = {"MISPLACED": int(noise.misplaced > 0), "SNAP": int(snap_focal > 0)}
        extra = {"misplaced": noise.misplaced} if noise.misplaced > 0 else {}
        extra |= {"focal": snap_focal} if snap_focal > 0 else {}
        average = self.fullscreen("surface/depth_average.frag", None, **constants)
        known = np.zeros((1, 1), np.float32) if told is None else told
        given_map = data_texture(self._context, known.shape[1], known.shape[0], 1)
        try:
            given_map.write(np.ascontiguousarray(known))
            textures = {"depth_map": frame.depth, "told": given_map, "grid": images.grid.texture}
            average.draw(images.calm.target, textures, powers=noise.powers, first=images.first, **extra)
        finally:
            given_map.release()
        return images.calm.texture

    def find_certainty(self, surface: PointSurface, noise: Noise, camera: Camera) -> moderngl.Texture | None:
        """How certain the normals are that were estimated on the depth of the last `calm_depth`; None if clean."""
        if noise.grid is None:
            return None
        target, images = surface.certainty_target, self._images.fit(surface.size)
        images.grid.texture.write(np.ascontiguousarray(noise.grid))  # without what the caller told `calm_depth`
        textures = {"surface_map": surface.texture, "grid": images.grid.texture}
        inputs = {"first": images.first, "powers": noise.powers, "intrinsics": camera.intrinsics}
        self.fullscreen("surface/normal_certainty.frag").draw(target, textures, cells=target.size, **inputs)
        (texture,) = target.color_attachments
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _grid(self, frame: DepthTextures, images: NoiseImages, stride: int) -> tuple[np.ndarray, np.ndarray]:
        get = self.fullscreen
        measure, blocks = get("surface/noise_patches.frag"), get("surface/noise_blocks.frag")
        if stride > 1:
            measure, blocks = get("surface/noise_patches.frag", COARSE=1), get("surface/noise_blocks.frag", MEASURED=1)
        measure.draw(images.patches.target, {"depth_map": frame.depth}, stride=stride, first=images.first)
        patches, steps = images.patches.textures
        blocks.draw(images.blocks.target, {"patches": patches, "patch_steps": steps})
        levels, counts = images.blocks.read_all()
        return levels, counts

    def _structure(self, frame: DepthTextures, images: NoiseImages) -> np.ndarray:
        """Levels only: (rows, columns, 4)."""
        patches = self.fullscreen("surface/noise_structure.frag")
        patches.draw(images.patches.target, {"depth_map": frame.depth}, first=images.first)
        blocks = self.fullscreen("surface/noise_blocks.frag", MEASURED=2)
        blocks.draw(images.blocks.target, {"patches": images.patches.texture})
        return images.blocks.read()


class NoiseImages(Images):
    """The images between the passes, for one size of depth picture.

    first  pixel of the grid of patches
    shape  rows and columns of blocks
    calm   as large as the frame, for noisy ones
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        (columns, rows), self.first = noise_grid(*size)
        self.shape = rows, columns
        patches = columns * BLOCK_PATCHES, rows * BLOCK_PATCHES
        self.patches = self._keep(Image(context, patches, RGBA32F, RGBA32F))
        self.blocks = self._keep(Image(context, (columns, rows), RGBA32F, RGBA32F))
        self.grid = self._keep(Image(context, (columns, rows), (3, "f4")))
        self.calm = self._keep(Image(context, size, RG32F))


class Stream(NamedTuple):
    """The next frame of a stream, the filter, and what earlier frames have left."""

    temporal: TemporalPass
    history: StreamHistory
    frame: Frame


class TemporalPass(FullscreenPasses):
    """Warps the history of a stream into the new frame's camera, compares, and mixes: see common/temporal.glsl.

    It takes 24 bytes a pixel of the largest frame, and each history 32 bytes a pixel.
    """

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._change = self._keep(Fitted(context, Image, RG32F, RGBA32F))  # and the old normals in its axes

    def filter_depth(self, picture: moderngl.Texture, noise: Noise, stream: Stream, camera: Camera) -> moderngl.Texture:
        """Average depth over time. Takes and returns depth with its noise as depth_average.frag writes them.

        The noise stays that of one frame, so that normals are estimated as before: their lower noise shows as less
        flicker, and no decision changes.
        """
        return self._steps.always("temporal", self._filter_depth, picture, noise, stream, camera)

    def filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        """Average the surface's normals with those remembered: at creases they flip even where depth hardly changes."""
        self._steps.always("temporal normals", self._filter_normals, surface, stream, camera)

    def _filter_depth(
        self, picture: moderngl.Texture, noise: Noise, stream: Stream, camera: Camera
    ) -> moderngl.Texture:
        history, change = stream.history.fit(picture.size), self._change.fit(picture.size)
        view = stream.history.view_from(stream.frame, camera)
        rounding = noise.step, noise.powers[1]
        if view is None:
            empty(change.target)
        else:
            maps = {"picture": picture, "history_map": history.depth.texture, "normal_map": history.normals.texture}
            moved = not np.array_equal(view, np.eye(4))
            way = {"intrinsics": camera.intrinsics, "view": view.T.astype("f4").tobytes()} if moved else {}
            compare = self.fullscreen("surface/temporal_change.frag", MOVED=int(moved))
            compare.draw(change.target, maps, rounding=rounding, **way)
        maps = {"picture": picture, "change_map": change.texture}
        mix = self.fullscreen("surface/temporal_depth.frag")
        mix.draw(history.depth.target, maps, intrinsics=camera.intrinsics, rounding=rounding)
        return history.depth.textures[1]

    def _filter_normals(self, surface: PointSurface, stream: Stream, camera: Camera) -> None:
        history, change = stream.history.fit(surface.size), self._change.fit(surface.size)
        maps = {"surface_map": surface.texture, "history_map": history.depth.texture}
        maps |= {"old_normal_map": change.textures[1]}
        mix = self.fullscreen("surface/temporal_normals.frag")
        mix.draw(history.normals.target, maps, intrinsics=camera.intrinsics)
        self._context.copy_framebuffer(surface.target, history.normals.target)
        stream.history.remember(stream.frame, camera)


class StreamHistory:
    """What the frames of one stream have left on the GPU, with the camera and pose of the last one.

    decisions  which noise estimate the stream uses
    """

    def __init__(self, context: moderngl.Context):
        self._context = context
        self.decisions = Decisions()
        self._image: HistoryImage | None = None
        self._last: tuple[weakref.ref[Frame], Camera, np.ndarray] | None = None

    def fit(self, size: tuple[int, int]) -> HistoryImage:
        """Return the images, emptied if the size has changed."""
        if self._image is None or self._image.size != size:
            self.release()
            self._image = HistoryImage(self._context, size)
        return self._image

    def view_from(self, frame: Frame, camera: Camera) -> np.ndarray | None:
        """Return (4, 4) from the axes of a frame's camera to those of the last frame's; the identity if neither has
        moved.

        None if nothing can be used: after another camera, and where the frame has been filtered before.
        """
        if self._last is None or self._last[0]() is frame or self._last[1] != camera:
            return None
        pose = self._last[2]
        return np.eye(4) if np.array_equal(pose, frame.pose) else np.linalg.inv(pose) @ frame.pose

    def remember(self, frame: Frame, camera: Camera) -> None:
        """Note that the images now include this frame."""
        self._last = weakref.ref(frame), camera, frame.pose

    def forget(self) -> None:
        """Start the stream anew."""
        self._last = None
        self.decisions = Decisions()

    def release(self) -> None:
        self.forget()
        if self._image is not None:
            self._image.release()
        self._image = None


class HistoryImage(Images):
    """What is remembered.

    depth    depth, noise of the last frame, noise that is left, share of the last frame; noise over depth;
             and depth and noise of the last frame once more, as estimators read them
    normals  unit normal and depth, as in PointSurface
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.depth = self._keep(Image(context, size, RGBA32F, RG32F))
        self.normals = self._keep(Image(context, size))
