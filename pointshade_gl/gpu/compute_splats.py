"""Compute rasteriser (OpenGL 4.3): the footprints' 1/z, the nearest of each pixel kept by atomics."""

from __future__ import annotations

import moderngl
import numpy as np

from ..camera import Camera
from .memory import Owner
from .programs import build_compute, set_uniforms, source_and_target
from .textures import Box, PointSurface, SplatImage

GROUP, BLOCK = 32, 4  # as in splats.comp


class ComputeSplatPass(Owner):
    """Notes how far the nearest splat is; which one it was, the resolve pass finds by looking there.

    For footprints of size 1: these leave no gap between neighbours, so looking there finds the splat itself.
    """

    look_up = True

    def __init__(self, context: moderngl.Context, tolerance: float, is_software: bool):
        """tolerance: how far off a plane pixels may lie to be drawn as one larger splat, as a share of 1/z."""
        super().__init__(context)
        self._is_software = is_software
        self._tolerance = tolerance
        with self._all_or_nothing():
            self._program = self._keep(build_compute(context, "splats.comp", WINDOW=int(is_software)))
            self._window = self._allocate(context.buffer, reserve=16)

    def draw(
        self,
        points: PointSurface,
        source: Camera,
        image: SplatImage,
        camera: Camera,
        view: np.ndarray,
        near: float,
        *_: object,
    ) -> None:
        """view (4, 4) takes source axes to target axes; near in source units. Sizes and shape are not asked."""
        left, top, width, height = points.window
        corner = left // BLOCK * BLOCK, top // BLOCK * BLOCK
        set_uniforms(
            self._program,
            surface_map=0,
            corner=corner,
            target_size=image.size,
            near=near,
            tolerance=self._tolerance,
            **source_and_target(source, camera, view),
        )
        points.texture.use(0)
        self._wait_for_readers()
        image.nearest.clear()
        image.nearest.bind_to_storage_buffer(0)
        self._window.clear()
        self._window.bind_to_storage_buffer(1)
        self._program.run(-(-(left + width - corner[0]) // (GROUP * BLOCK)), -(-(top + height - corner[1]) // BLOCK))
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)
        image.window = self._read_window(*image.size) if self._is_software else (0, 0, *image.size)
        image.raise_version()

    def _read_window(self, width: int, height: int) -> Box:
        """The part of the view that has splats: the passes after this one, which take every pixel, leave out the rest.

        A software driver runs compute shaders at once, so that nothing is waited for.
        """
        to_left, up, right, down = np.frombuffer(self._window.read(), np.int32).tolist()
        return width - to_left, height - up, max(right + to_left - width, 0), max(down + up - height, 0)

    def _wait_for_readers(self) -> None:
        """Whoever still reads `nearest` comes before it is cleared: llvmpipe's threads heed no barrier."""
        if self._is_software:
            self._context.finish()
        else:
            self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
