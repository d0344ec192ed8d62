"""Measures the noise and rounding of a depth texture, and smooths the depth accordingly."""

from __future__ import annotations

import moderngl
import numpy as np

from ...estimation.noise_model import BLOCK_PATCHES, COARSE, find_noise, noise_grid, told_noise
from ...scene.camera import Camera
from ...scene.noise import Noise, NoiseWords
from ..core.frame_textures import DepthTextures, PointSurface
from ..core.images import RG32F, RGBA32F, Fitted, Image, Images, read_texture
from ..core.passes import FullscreenPasses, data_texture


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
        return told_noise(words, self._images.fit(frame.size).shape)

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
        told_map = data_texture(self._context, known.shape[1], known.shape[0], 1)
        try:
            told_map.write(np.ascontiguousarray(known))
            textures = {"depth_map": frame.depth, "told": told_map, "grid": images.grid.texture}
            average.draw(images.calm.target, textures, powers=noise.powers, first=images.first, **extra)
        finally:
            told_map.release()
        return images.calm.texture

    def find_certainty(self, surface: PointSurface, noise: Noise, camera: Camera) -> moderngl.Texture | None:
        """How certain the normals are that were estimated on the depth of the last `calm_depth`; None if it is
        clean."""
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
        levels, counts = (read_texture(self._context, one) for one in images.blocks.textures)
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
