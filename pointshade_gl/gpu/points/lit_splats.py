"""Draws splats in one pass, lit in the vertex shader, straight into the picture."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ...scene.camera import Camera
from ..context.raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from ..context.saved_state import enabled
from ..core.frame_textures import PointSurface
from ..core.memory import Owner
from ..core.passes import bind_textures
from ..core.programs import build_program, set_uniforms, source_and_target
from ..core.view_images import Target
from .point_raster import Vertices
from .rims import has_rims


class LitSplatPass(Owner):
    """Lights splats in the vertex shader, once per splat; nothing is kept for later passes.

    Which splat is visible, and where, is as in `PointSplatPass`.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._rim_array: moderngl.VertexArray | None = None  # made when it is first needed
        with self._all_or_nothing():
            self._program = self._keep(build_program(context, "points/splats.vert", "points/splats.frag", LIT=1))
            self._vertices = Vertices(context, self._program, np.ones(1, np.float32))

    def draw(
        self,
        target: Target,
        points: PointSurface,
        source: Camera,
        camera: Camera,
        view: np.ndarray,
        near: float,
        sizes: np.ndarray,
        splat: str,
        lights: dict[str, Any],
    ) -> None:
        """Draw the lit splats. lights: inputs of shaders/common/lights.glsl, source axes, with color_map, material and
        eye."""
        if not np.array_equal(sizes, self._vertices.sizes):
            vertices = Vertices(self._context, self._program, sizes)
            self._vertices.release()
            self._vertices = vertices
        inputs = {"surface_map": points.texture, "target_size": target.size, "near": near}
        inputs |= source_and_target(source, camera, view) | lights
        shape: dict[str, Any] = {"side": self._vertices.side, "is_round": splat == "round"}
        bind_textures(self._program, inputs)
        rims, count = has_rims(sizes, splat), source.width * source.height
        set_uniforms(self._program, has_rims=rims, **shape, **inputs)
        target.shared_picture.use()
        target.shared_picture.clear(depth=1.0)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            self._vertices.array.render(moderngl.POINTS, vertices=count)
            if rims:
                array = self._rims()
                set_uniforms(array.program, **inputs)
                array.render(moderngl.POINTS, vertices=count)

    def _rims(self) -> moderngl.VertexArray:
        if self._rim_array is None:
            program = self._keep(build_program(self._context, "points/rims.vert", "points/rims.frag", LIT=1))
            self._rim_array = self._allocate(self._context.vertex_array, program, [])
        return self._rim_array

    def release(self) -> None:
        self._vertices.release()
        super().release()
