"""Draws splats in one pass, lit in the vertex shader, straight into the picture."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import moderngl
import numpy as np

from ..context.raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from ..context.saved_state import enabled
from ..core.memory import Owner
from ..core.passes import set_inputs
from ..core.programs import build_program, set_uniforms
from ..core.view_images import Target
from .point_raster import Vertices
from .set_splats import Splats


class LitSplatPass(Owner):
    """Lights splats in the vertex shader, once per splat; nothing is kept for later passes.

    Which splat is visible, and where, is as in `PointSplatPass`.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            program = self._keep(build_program(context, "points/splats.vert", "points/splats.frag", LIT=1))
            self._vertices = Vertices(context, program, np.ones(1, np.float32))

    def draw(self, target: Target, splats: Splats, lights: dict[str, Any]) -> None:
        """lights: inputs of shaders/common/lights.glsl, source axes, with color_map, material and eye."""
        self._vertices = self._vertices.fitted(splats.sizes)
        array, count = self._vertices.array, splats.source.width * splats.source.height
        inputs = {"surface_map": splats.surface.texture, "target_size": target.size, "near": splats.near}
        inputs |= splats.way | lights
        set_inputs(array.program, inputs)
        set_uniforms(array.program, **self._vertices.shape(splats))
        target.shared_picture.use()
        target.shared_picture.clear(depth=1.0)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            array.render(moderngl.POINTS, vertices=count)
            if splats.has_rims:
                array = self._rims
                set_uniforms(array.program, **inputs)
                array.render(moderngl.POINTS, vertices=count)

    @cached_property
    def _rims(self) -> moderngl.VertexArray:
        program = self._keep(build_program(self._context, "points/rims.vert", "points/rims.frag", LIT=1))
        return self._allocate(self._context.vertex_array, program, [])

    def release(self) -> None:
        self._vertices.release()
        super().release()
