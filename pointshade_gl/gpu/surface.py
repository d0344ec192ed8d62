"""Surface pass: depth texture -> surface texture (normal and depth)."""

from __future__ import annotations

import moderngl

from ..camera import Camera
from ..normals import TRIANGLES
from .programs import build_program, set_uniforms
from .textures import FrameTextures


class SurfacePass:
    """Writes unit normals, source axes, towards the camera; (0, 0, 0) where depth is missing."""

    def __init__(self, context: moderngl.Context):
        self._triangles = build_program(context, "fullscreen.vert", "surface_triangles.frag")
        self._array = context.vertex_array(self._triangles, [])

    def run(self, frame: FrameTextures, camera: Camera, method: str, max_step: tuple[float, float]) -> None:
        """max_step = (metres, share of the depth): a neighbour further off than both together is left out."""
        if method == "auto":
            method, max_step = "triangles-8", (0.0, 0.05)
        set_uniforms(
            self._triangles,
            depth_map=0,
            intrinsics=camera.intrinsics,
            triangle_count=TRIANGLES[method],
            max_step=max_step,
        )
        frame.depth.use(0)
        frame.surface_target.use()
        self._array.render(moderngl.TRIANGLES, 3)

    def release(self) -> None:
        self._array.release()
        self._triangles.release()
