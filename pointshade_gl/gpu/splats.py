"""Splat pass: every pixel with a depth becomes a point in the target view; the nearest one is noted."""

from __future__ import annotations

import moderngl
import numpy as np

from ..camera import Camera
from .programs import build_program, set_uniforms, source_and_target
from .textures import PointSurface, SplatImage


class SplatPass:
    """Draws source ids and depth with GL_POINTS; the only vertex data is the size attribute.

    A splat larger than the driver's largest point is drawn at that size round its place in the picture.
    """

    look_up = False

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._program = build_program(context, "splats.vert", "splats.frag")
        self._sizes = np.ones(1, np.float32)
        self._make_vertices()

    def draw(
        self,
        points: PointSurface,
        source: Camera,
        image: SplatImage,
        camera: Camera,
        view: np.ndarray,
        near: float,
        sizes: np.ndarray,
        splat: str,
    ) -> None:
        """view (4, 4) takes source axes to target axes; near in source units; sizes (1,) or (h*w,) float32."""
        if not np.array_equal(sizes, self._sizes):
            self._release_vertices()
            self._sizes = sizes.copy()  # the caller may write into hers
            self._make_vertices()
        set_uniforms(
            self._program,
            surface_map=0,
            target_size=image.size,
            near=near,
            **source_and_target(source, camera, view),
            is_round=splat == "round",
            first_id=1,
        )
        points.texture.use(0)
        image.window = 0, 0, *image.size
        image.visible.use()
        image.visible.clear(0, depth=1.0)  # id 0 is nothing: the only value that means the same as int and float
        self._context.enable_only(moderngl.DEPTH_TEST | moderngl.PROGRAM_POINT_SIZE)
        self._array.render(moderngl.POINTS, vertices=source.width * source.height)
        self._context.enable_only(moderngl.NOTHING)
        image.raise_version()

    def _make_vertices(self) -> None:
        self._buffer = self._context.buffer(self._sizes.tobytes())
        per = "1f/r" if self._sizes.size == 1 else "1f"  # one size for the whole draw, or one a point
        self._array = self._context.vertex_array(self._program, [(self._buffer, per, "size")])

    def _release_vertices(self) -> None:
        self._array.release()
        self._buffer.release()

    def release(self) -> None:
        self._release_vertices()
        self._program.release()
