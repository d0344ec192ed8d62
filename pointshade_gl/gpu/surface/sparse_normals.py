"""Estimates normals of sparse depth images, by planes through windows that grow until they hold enough points."""

from __future__ import annotations

import moderngl

from ...scene.camera import Camera
from ...scene.noise import SPARSE_LEVELS, SPARSE_TILTS
from ..context.raw_gl import DEPTH_TEST
from ..context.saved_state import enabled
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image, Images, empty
from ..core.passes import FullscreenPasses

CELLS, NORMALS = "surface/sparse_cells.frag", "surface/normals_sparse.frag"


class SparsePass(FullscreenPasses):
    """Writes the surface of a frame, see shaders/common/normals_sparse.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, CellImages))

    def run(self, frame: DepthTextures, camera: Camera) -> None:
        images = self._images.fit(frame.size)
        first, join = self.fullscreen(CELLS, FROM_DEPTH=1), self.fullscreen(CELLS)
        first.draw(images.levels[0].target, {"finer": frame.depth})
        for finer, coarser in zip(images.levels, images.levels[1:], strict=False):
            join.draw(coarser.target, {"finer": finer.texture})
        answer, rest = self.fullscreen(NORMALS), self.fullscreen(NORMALS, REST=1)
        target, common = frame.surface.staged_target, {"depth_map": frame.depth, "intrinsics": camera.intrinsics}
        empty(target, frame.surface.window)
        with enabled(self._context, DEPTH_TEST):
            for tilt in SPARSE_TILTS:
                for level, cells in enumerate(images.levels, 1):
                    answer.draw(target, {"cells": cells.texture}, level=level, tilt=tilt, **common)
            rest.draw(target, {}, **common)


class CellImages(Images):
    """The cells of one size of frame, from 2x2 pixels on: each level half as many a side as the one before.

    See shaders/common/sparse_cells.glsl.
    """

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        sizes = [(-(-size[0] >> k), -(-size[1] >> k)) for k in range(1, SPARSE_LEVELS + 1)]
        self.levels = [self._keep(Image(context, one)) for one in sizes]
