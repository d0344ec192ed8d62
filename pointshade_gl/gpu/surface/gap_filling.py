"""Fills small gaps in a surface, or the gaps between the points of a sparse depth image."""

from __future__ import annotations

import moderngl

from ...scene.camera import Camera
from ..core.frame_textures import PointSurface
from ..core.images import R32F, RG8, RGBA32F, Fitted, Image, Images
from ..core.passes import FullscreenPasses

SMALL, WIDE = 8, 32  # pixels to the known ones that enclose a gap: where depth is dense, and where it is sparse
BENDS = 6  # straight parts of a way through a gap, up to SMALL pixels each


class GapFillingPass(FullscreenPasses):
    """Fills gaps between known pixels of one surface, see shaders/common/gap_filling.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, GapImages))

    def run(
        self, surface: PointSurface, colors: moderngl.Texture, camera: Camera, is_sparse: bool, filled: PointSurface
    ) -> None:
        """Write the surface without gaps to `filled`. camera: took the frame, at the surface's size."""
        images = self._images.fit(surface.size)
        filled.confine(surface.window)
        result = self._fill_once(surface, colors, camera, images, WIDE if is_sparse else SMALL)
        if not is_sparse:
            self._write(result, camera, filled)
            self._fill_once(filled, colors, camera, images, SMALL)
            result = self._keep_whole(surface, images)
        self._write(result, camera, filled)
        filled.certainty = surface.certainty
        filled.raise_version()

    def _fill_once(
        self, surface: PointSurface, colors: moderngl.Texture, camera: Camera, images: GapImages, reach: int
    ) -> Image:
        rows, fill = self.fullscreen("surface/gap_rows.frag"), self.fullscreen("surface/gap_filling.frag")
        rows.draw(images.rows.target, {"surface_map": surface.texture}, reach=reach)
        maps = {"surface_map": surface.texture, "row_map": images.rows.texture, "color_map": colors}
        fill.draw(images.filled.target, maps, reach=reach, source=camera.intrinsics)
        return images.filled

    def _keep_whole(self, surface: PointSurface, images: GapImages) -> Image:
        """Several times, because the ways through a gap have bends."""
        result, other = images.filled, images.whole
        for _ in range(BENDS):
            normals, depth = result.textures
            maps = {"surface_map": surface.texture, "filled_map": normals, "filled_depth": depth}
            self.fullscreen("surface/whole_gaps.frag").draw(other.target, maps, reach=SMALL)
            result, other = other, result
        return result

    def _write(self, result: Image, camera: Camera, filled: PointSurface) -> None:
        normals, depth = result.textures
        mark = self.fullscreen("surface/normals_given.frag")
        mark.draw(filled.target, {"normal_map": normals, "depth_map": depth}, intrinsics=camera.intrinsics)


class GapImages(Images):
    """How far the known pixels of a row are, and what is filled: normals and depths, for one size of surface."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        self.rows = self._keep(Image(context, size, RG8))
        self.filled, self.whole = (self._keep(Image(context, size, RGBA32F, R32F)) for _ in range(2))
