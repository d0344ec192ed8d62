"""Compute rasteriser (OpenGL 4.3): the footprints' 1/z, the nearest of each pixel kept by atomics."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from .memory import Owner
from .programs import build_compute, set_uniforms, source_and_target
from .textures import Box, PointSurface, SplatImage

GROUP, BLOCK = 32, 4  # as in splats.comp
MOST_GROUPS = 65535  # of threads, which every driver takes
LIST_LENGTH = 1 << 20  # blocks with large splats: more of them, of over 16 million points, are left out
PIXELS_A_GROUP = 1 << 20  # of the view


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
        self._large_program: moderngl.ComputeShader | None = None  # made when there may be a large splat
        with self._all_or_nothing():
            self._program = self._keep(build_compute(context, "splats.comp", WINDOW=int(is_software)))
            self._large = self._allocate(context.buffer, reserve=4 * (9 + LIST_LENGTH))

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
        inputs = {"surface_map": 0, "target_size": image.size, "near": near, "tolerance": self._tolerance}
        inputs |= {"list_length": LIST_LENGTH} | source_and_target(source, camera, view)
        set_uniforms(self._program, **inputs, corner=corner, most_groups=MOST_GROUPS)
        points.texture.use(0)
        self._wait_for_readers()
        image.nearest.clear()
        image.nearest.bind_to_storage_buffer(0)
        groups = 0, 1 + image.size[0] * image.size[1] // PIXELS_A_GROUP, 1, 0
        self._large.write(np.array([*groups, *[0] * 5], np.int32))
        self._large.bind_to_storage_buffer(1)
        self._program.run(-(-(left + width - corner[0]) // (GROUP * BLOCK)), -(-(top + height - corner[1]) // BLOCK))
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)
        image.window, large = self._read_header(*image.size) if self._is_software else ((0, 0, *image.size), None)
        if large != 0:
            self._draw_large(inputs)
            image.window = self._read_header(*image.size)[0] if self._is_software else image.window
        image.raise_version()

    def _draw_large(self, inputs: dict[str, Any]) -> None:
        """The splats that the first step has put on its list."""
        if self._large_program is None:
            made = build_compute(self._context, "large_splats.comp", WINDOW=int(self._is_software))
            self._large_program = self._keep(made)
        set_uniforms(self._large_program, **inputs)
        self._large_program.run_indirect(self._large)
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _read_header(self, width: int, height: int) -> tuple[Box, int]:
        """The part of the view that has splats, to which later passes are confined; how many blocks are on the list.

        A software driver runs compute shaders at once, so there is nothing to wait for.
        """
        large, _, _, _, to_left, up, right, down = np.frombuffer(self._large.read(32), np.int32).tolist()
        return (width - to_left, height - up, max(right + to_left - width, 0), max(down + up - height, 0)), large

    def _wait_for_readers(self) -> None:
        """Whoever still reads `nearest` comes before it is cleared: llvmpipe's threads heed no barrier."""
        if self._is_software:
            self._context.finish()
        else:
            self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
