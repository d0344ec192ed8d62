"""Rasterises the depth of the triangle mesh between a frame's pixels, by a compute shader where there is one."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Camera, Eye
from ...scene.noise import Step
from ..context.raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from ..context.saved_state import enabled
from ..core.frame_textures import PointSurface
from ..core.images import Box
from ..core.memory import Owner
from ..core.passes import set_inputs
from ..core.programs import build_compute, build_program, set_uniforms, source_and_target
from ..core.view_images import SplatImage
from ..points.compute_raster import MOST_GROUPS, RimList, clear_nearest, no_rims, read_window
from ..points.point_objects import carried

GROUP, ROWS = 32, 16  # as in grid.comp
TOGETHER = 1 << 14  # squares that one call draws
NOTHING_YET = np.array([0, 1, 1, 0, 0, 0, 0, 0], np.int32)  # where the mesh comes to


class Grid(NamedTuple):
    """Where the points of an object are, and which are connected: everything that its shadow depends on."""

    surface: PointSurface
    source: Camera  # that took the frame
    pose: np.ndarray  # (4, 4) from its axes to the world, without the scale
    scale: float
    max_step: Step

    def way(self, eye: Eye) -> dict[str, Any]:
        """Return the uniforms that project the grid into a view."""
        return source_and_target(self.source, eye.camera, carried(self.pose, self.scale, eye))

    def maps(self) -> dict[str, Any]:
        return {"surface_map": self.surface.texture, "triangle_map": self.surface.triangles.texture}

    @property
    def squares_in_blocks(self) -> Box:
        """Return the same in `planes`, which begin before the frame, at an even column and row."""
        left, top, width, height = self.surface.window
        return left // 2 * 2, top // 2 * 2, width + 1 + left % 2, height + 1 + top % 2

    @property
    def squares(self) -> Box:
        """Return first column and row, columns and rows of the squares that have corners among the points."""
        left, top, width, height = self.surface.window
        return left - 1, top - 1, width + 1, height + 1


class ComputedDepths(Owner):
    """Rasterises 1/z of a mesh: squares that lie on planes, then other squares, then the rims at its border."""

    def __init__(self, context: moderngl.Context, is_software: bool):
        super().__init__(context)
        self._is_software = is_software
        self._rims, self._odd = (self._keep(RimList(context)) for _ in range(2))  # odd squares are drawn in pieces
        names = "meshes/grid.comp", "meshes/odd_squares.comp", "points/rims.comp"
        with self._all_or_nothing():
            self._steps = [self._keep(build_compute(context, name, WINDOW=int(is_software))) for name in names]
            self._window = self._allocate(context.buffer, reserve=NOTHING_YET.nbytes)

    def draw(self, image: SplatImage, grid: Grid, eye: Eye) -> None:
        """Fill `nearest` of an image of the view."""
        clear_nearest(self._context, image, self._is_software)
        image.nearest.bind_to_storage_buffer(0)
        squares, odd, rims = self._steps
        most = (grid.surface.size[0] + 1) * (grid.surface.size[1] + 1)  # all squares, or all rims
        odd_list, rim_list = self._odd.emptied(most, place=3), self._rims.emptied(most, place=2)
        self._window.write(NOTHING_YET)
        self._window.bind_to_storage_buffer(1)
        way = grid.way(eye) | {"target_size": image.size}
        listed = {"near": eye.near / grid.scale, "most_groups": MOST_GROUPS}
        left, top, columns, rows = grid.squares_in_blocks
        planes = {"plane_map": grid.surface.planes.texture, "squares": (left, top, columns, rows)}
        set_inputs(squares, way | listed | planes)
        squares.run(-(-columns // (2 * GROUP)), -(-rows // ROWS))
        self._run_list(odd, odd_list, way | listed | grid.maps())
        ends = {"near": listed["near"], "surface_map": grid.surface.texture}
        self._run_list(rims, rim_list, way | ends | no_rims())
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)
        image.window = read_window(self._window, *image.size) if self._is_software else (0, 0, *image.size)
        image.raise_version()

    def _run_list(self, program: moderngl.ComputeShader, listed: moderngl.Buffer, inputs: dict[str, Any]) -> None:
        """Draw what an earlier step has put on a list."""
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.COMMAND_BARRIER_BIT)
        set_inputs(program, inputs)
        program.run_indirect(listed)


class DrawnDepths(Owner):
    """Rasterises the depth of a mesh with OpenGL 3.3: four quads for each square, then a point for each rim.

    Only the order of the vertices lies in memory: shaders compute them.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        order = 4 * np.arange(4 * TOGETHER, dtype=np.uint32)[:, None] + np.array((0, 1, 2, 3, 2, 1), np.uint32)
        with self._all_or_nothing():
            pieces = self._keep(build_program(context, "meshes/grid.vert", "meshes/grid_depth.frag"))
            buffer = self._allocate(context.buffer, order.tobytes())
            self._pieces = self._allocate(context.vertex_array, pieces, [], buffer)
            ends = self._keep(build_program(context, "points/rims.vert", "points/rims.frag"))
            self._ends = self._allocate(context.vertex_array, ends, [])

    def draw(self, image: SplatImage, grid: Grid, eye: Eye) -> None:
        """Fill `depth` of an image of the view; its ids mean nothing."""
        image.window = 0, 0, *image.size
        image.visible.use()
        image.visible.clear(depth=1.0)
        here = grid.way(eye) | {"target_size": image.size, "near": eye.near / grid.scale}
        set_inputs(self._pieces.program, grid.maps() | here | {"window_of_squares": grid.squares})
        _, _, columns, rows = grid.squares
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            for first in range(0, columns * rows, TOGETHER):
                set_uniforms(self._pieces.program, first_square=first)
                self._pieces.render(moderngl.TRIANGLES, vertices=24 * min(TOGETHER, columns * rows - first))
            set_inputs(self._ends.program, here | {"surface_map": grid.surface.texture, "first_id": 1})
            self._ends.render(moderngl.POINTS, vertices=grid.source.width * grid.source.height)
        image.raise_version()
