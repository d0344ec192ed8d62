"""Splats lit where they are made: GL points with their light, drawn straight into the picture in one pass."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from .memory import Owner
from .passes import bind_textures
from .point_splats import Vertices
from .programs import build_program, set_uniforms, source_and_target
from .raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from .state import enabled
from .textures import PointSurface, Target


class LitSplatPass(Owner):
    """Phong's light in the vertex shader, once a splat; nothing is noted for later passes.

    Which splat is seen, and where, is as in `PointSplatPass`.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._program = self._keep(build_program(context, "splats.vert", "splats.frag", LIT=1))
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
        is_round: bool,
        lights: dict[str, Any],
    ) -> None:
        """lights: inputs of shaders/common/lights.glsl, source axes, with color_map, material and eye."""
        if not np.array_equal(sizes, self._vertices.sizes):
            vertices = Vertices(self._context, self._program, sizes)
            self._vertices.release()
            self._vertices = vertices
        inputs = {"surface_map": points.texture, "target_size": target.size, "near": near, "is_round": is_round}
        inputs |= source_and_target(source, camera, view) | lights
        bind_textures(inputs)
        set_uniforms(self._program, **inputs)
        target.shared_picture.use()
        target.shared_picture.clear(depth=1.0)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            self._vertices.array.render(moderngl.POINTS, vertices=source.width * source.height)

    def release(self) -> None:
        self._vertices.release()
        super().release()
