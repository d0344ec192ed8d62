"""Reads a small copy of a frame back from the GPU, by which its pose is corrected."""

from __future__ import annotations

import moderngl

from ...estimation.agreement import LONGER_SIDE, ReducedFrame
from ...scene.camera import Camera
from ..core.frame_textures import FrameTextures, frame_of
from ..core.images import R32F, RGBA32F, Fitted, Image, read_texture
from ..core.passes import FullscreenPasses


class FrameReductionPass(FullscreenPasses):
    """Reduces frames with estimated normals."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._copy = self._keep(Fitted(context, Image, RGBA32F, R32F))

    def read(self, textures: FrameTextures) -> ReducedFrame:
        """Return the reduced copy of a frame whose normals are known."""
        frame = frame_of(textures)
        camera, cell = reduced_camera(frame.camera)
        image = self._copy.fit((camera.width, camera.height))
        maps = {"surface_map": textures.surface.texture, "color_map": textures.color}
        reduce = self.fullscreen("points/frame_reduction.frag")
        reduce.draw(image.target, maps, source=frame.camera.intrinsics, cell=cell)
        has_slopes = frame.color is not None and min(camera.width, camera.height) > 1
        brightness = read_texture(self._context, image.textures[1])[..., 0] if has_slopes else None
        reduced = ReducedFrame(camera, image.read(), brightness)
        return reduced if reduced.is_textured else reduced.without_brightness()


def reduced_camera(camera: Camera) -> tuple[Camera, int]:
    """Return the camera of a frame's reduced copy, and how many pixels along a side are one of its pixels."""
    cell = max(round(max(camera.width, camera.height) / LONGER_SIDE), 1)
    cell = min(cell, camera.width, camera.height)
    width, height = camera.width // cell, camera.height // cell
    cx, cy = ((place - cell // 2) / cell for place in (camera.cx, camera.cy))
    return Camera(camera.fx / cell, camera.fy / cell, cx, cy, width, height), cell
