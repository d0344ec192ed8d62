"""Splat pass: every pixel with a depth becomes a point in the target view; the nearest one is noted."""

from __future__ import annotations

import moderngl
import numpy as np

from ..camera import Camera
from .memory import Owner
from .programs import build_program, set_uniforms, source_and_target
from .raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from .state import enabled
from .textures import PointSurface, SplatImage


class PointSplatPass(Owner):
    """Draws source ids and depth with GL_POINTS; the only vertex data is the size attribute.

    A splat larger than the driver's largest point is drawn at that size round its place in the picture.
    """

    look_up = False

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._program = self._keep(build_program(context, "splats.vert", "splats.frag"))
            self._vertices = Vertices(context, self._program, np.ones(1, np.float32))

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
        if not np.array_equal(sizes, self._vertices.sizes):
            vertices = Vertices(self._context, self._program, sizes)
            self._vertices.release()
            self._vertices = vertices
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
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            self._vertices.array.render(moderngl.POINTS, vertices=source.width * source.height)
        image.raise_version()

    def release(self) -> None:
        self._vertices.release()
        super().release()


class Vertices(Owner):
    """The sizes of the splats: one for the whole draw, or one a point."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program, sizes: np.ndarray):
        super().__init__(context)
        self.sizes = sizes.copy()  # the caller may write into theirs
        with self._all_or_nothing():
            buffer = self._allocate(context.buffer, self.sizes.tobytes())
            content = [(buffer, "1f/r" if sizes.size == 1 else "1f", "size")]
            self.array = self._allocate(context.vertex_array, program, content)
