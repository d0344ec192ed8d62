"""Fill pass: a surface -> the same surface without small gaps, or without those between sparse points."""

from __future__ import annotations

import moderngl

from ..camera import Camera
from .images import Fitted, Images
from .memory import Owner
from .passes import FullscreenPass
from .textures import PointSurface

SMALL, WIDE = 8, 32  # pixels to the known ones that enclose a gap: where depth is dense, and where it is sparse


class FillPass(Owner):
    """See shaders/common/gaps.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, GapImages))
        with self._all_or_nothing():
            self._rows = self._keep(FullscreenPass(context, "gap_rows.frag"))
            self._fill = self._keep(FullscreenPass(context, "fill.frag"))
            self._mark = self._keep(FullscreenPass(context, "surface_given.frag"))

    def run(
        self, surface: PointSurface, colors: moderngl.Texture, camera: Camera, is_sparse: bool, filled: PointSurface
    ) -> None:
        """camera: who took the frame, at the surface's size."""
        images, reach = self._images.fit(surface.size), WIDE if is_sparse else SMALL
        self._rows.draw(images.row_target, {"surface_map": surface.texture}, reach=reach)
        maps = {"surface_map": surface.texture, "row_map": images.rows, "color_map": colors}
        self._fill.draw(images.target, maps, reach=reach, source=camera.intrinsics)
        filled.confine(surface.window)
        maps = {"normal_map": images.normals, "depth_map": images.depth}
        self._mark.draw(filled.target, maps, intrinsics=camera.intrinsics)
        filled.certainty = surface.certainty
        filled.raise_version()


class GapImages(Images):
    """How far the known pixels of a row are (RG8), and the filled normals and depths, for one size of surface."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        with self._all_or_nothing():
            self.rows = self._texture(2)
            self.row_target = self._framebuffer(self.rows)
            self.normals, self.depth = self._texture(4, "f4"), self._texture(1, "f4")
            self.target = self._framebuffer(self.normals, self.depth)
