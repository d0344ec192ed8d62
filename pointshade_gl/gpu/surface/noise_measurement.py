"""Measures the noise and rounding of a depth texture, and smooths the depth accordingly."""

from __future__ import annotations

from functools import cached_property

import moderngl
import numpy as np

from ...estimation.noise_model import BLOCK_PATCHES, COARSE, find_noise, noise_grid, told_noise
from ...scene.camera import Camera
from ...scene.noise import Noise
from ...scene.noise_text import NoiseWords
from ..core.frame_textures import DepthTextures, PointSurface
from ..core.memory import Owner
from ..core.passes import FullscreenPass, data_texture


class NoisePass(Owner):
    """Measures on a quarter of the pixels; only a small grid of blocks is read back."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._patches = self._keep(FullscreenPass(context, "surface/noise_patches.frag"))
            self._blocks = self._keep(FullscreenPass(context, "surface/noise_blocks.frag"))
        self._later: dict[str, FullscreenPass] = {}  # made when a frame turns out to be noisy
        self._images: Images | None = None

    def measure(self, frame: DepthTextures, focal: float) -> Noise:
        """Measure the noise and the rounding of a frame's depth. focal: mean focal length, pixels."""
        images = self._fit(frame)
        levels, counts = self._grid(frame, images, 1)
        coarse, structure = lambda: self._grid(frame, images, COARSE), lambda: self._structure(frame, images)
        return find_noise(levels, counts, focal, coarse, structure)

    def read(self, frame: DepthTextures, words: NoiseWords) -> Noise:
        """Return the noise that the caller has described in words, for this frame."""
        return told_noise(words, self._fit(frame).shape)

    def calm_depth(
        self, frame: DepthTextures, noise: Noise, told: np.ndarray | None, snap_focal: float = 0.0
    ) -> moderngl.Texture:
        """Average away most of the depth's noise. Returns RG32F: smoothed depth, and its remaining noise over depth.

        told        (1, 1) or (h, w) float32 metres, the caller's noise: it replaces what was measured, not the rounding
        snap_focal  mean focal length, pixels, to move flying pixels onto surfaces; 0 keeps them
        """
        images = self._fit(frame)
        grid = np.zeros((*images.shape, 3), np.float32) if noise.grid is None else noise.grid
        if told is not None:
            grid = grid * np.array([0, 1, 1], np.float32)
        images.grid.write(np.ascontiguousarray(grid))
        constants = {"MISPLACED": int(noise.misplaced > 0), "SNAP": int(snap_focal > 0)}
        extra = {"misplaced": noise.misplaced} if noise.misplaced > 0 else {}
        extra |= {"focal": snap_focal} if snap_focal > 0 else {}
        average, target = self._pass("surface/depth_average.frag", **constants), images.calm_target
        known = np.zeros((1, 1), np.float32) if told is None else told
        told_map = data_texture(self._context, known.shape[1], known.shape[0], 1)
        try:
            told_map.write(np.ascontiguousarray(known))
            textures = {"depth_map": frame.depth, "told": told_map, "grid": images.grid}
            average.draw(target, textures, powers=noise.powers, first=images.first, **extra)
        finally:
            told_map.release()
        return images.calm

    def find_certainty(self, surface: PointSurface, noise: Noise, camera: Camera) -> moderngl.Texture | None:
        """Estimate how certain the normals are that were fitted to the depth of the last `calm_depth`. Returns None if
        neighbours share no noise: then the fits leave too little error to matter."""
        if not noise.is_shared or self._images is None:
            return None
        target, images = surface.certainty_target, self._images
        textures = {"surface_map": surface.texture, "grid": images.grid}
        inputs = {"first": images.first, "powers": noise.powers, "intrinsics": camera.intrinsics}
        self._pass("surface/normal_certainty.frag").draw(target, textures, cells=target.size, **inputs)
        (texture,) = target.color_attachments
        assert isinstance(texture, moderngl.Texture)
        return texture

    def _grid(self, frame: DepthTextures, images: Images, stride: int) -> tuple[np.ndarray, np.ndarray]:
        measure, blocks = self._patches, self._blocks
        if stride > 1:
            measure, blocks = (
                self._pass("surface/noise_patches.frag", COARSE=1),
                self._pass("surface/noise_blocks.frag", MEASURED=1),
            )
        measure.draw(images.patch_target, {"depth_map": frame.depth}, stride=stride, first=images.first)
        patches, steps = images.patches
        blocks.draw(images.block_target, {"patches": patches, "patch_steps": steps})
        return self._read(images)

    @staticmethod
    def _read(images: Images) -> tuple[np.ndarray, np.ndarray]:
        levels, counts = (np.frombuffer(x.read(), np.float32).reshape(*images.shape, 4) for x in images.blocks)
        return levels, counts

    def _structure(self, frame: DepthTextures, images: Images) -> np.ndarray:
        """Measure the levels that distinguish structure from noise, (rows, columns, 4)."""
        patches, blocks = (
            self._pass("surface/noise_structure.frag"),
            self._pass("surface/noise_blocks.frag", MEASURED=2),
        )
        patches.draw(images.patch_target, {"depth_map": frame.depth}, first=images.first)
        blocks.draw(images.block_target, {"patches": images.patches[0]})
        return self._read(images)[0]

    def _pass(self, fragment: str, **constants: int) -> FullscreenPass:
        key = f"{fragment} {constants}"
        if key not in self._later:
            self._later[key] = FullscreenPass(self._context, fragment, **constants)
        return self._later[key]

    def _fit(self, frame: DepthTextures) -> Images:
        if self._images is None or self._images.size != frame.size:
            if self._images is not None:
                self._images.release()
            self._images = None
            self._images = Images(self._context, *frame.size)
        return self._images

    def release(self) -> None:
        for item in (self._images, *self._later.values()):
            if item is not None:
                item.release()
        super().release()


class Images(Owner):
    """The textures between the passes, for one size of depth picture."""

    def __init__(self, context: moderngl.Context, width: int, height: int):
        super().__init__(context)
        self.size = width, height
        (columns, rows), self.first = noise_grid(width, height)
        across, down = columns * BLOCK_PATCHES, rows * BLOCK_PATCHES
        self.shape = rows, columns
        with self._all_or_nothing():
            self.patches = self._texture(across, down, 4), self._texture(across, down, 4)
            self.blocks = self._texture(columns, rows, 4), self._texture(columns, rows, 4)
            self.grid = self._texture(columns, rows, 3)
            self.patch_target = self._allocate(context.framebuffer, self.patches)
            self.block_target = self._allocate(context.framebuffer, self.blocks)

    @cached_property
    def calm(self) -> moderngl.Texture:
        """As large as the frame: made when a frame turns out to be noisy."""
        return self._texture(*self.size, 2)

    @cached_property
    def calm_target(self) -> moderngl.Framebuffer:
        return self._allocate(self._context.framebuffer, [self.calm])

    def _texture(self, width: int, height: int, components: int) -> moderngl.Texture:
        return self._keep(data_texture(self._context, width, height, components))
