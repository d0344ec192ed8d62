"""Point objects as meshes: the triangles between neighbouring pixels, instead of splats."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..camera import Camera, Eye
from ..estimators import Step, parse_max_depth_step
from ..look import SHADINGS, Look
from .images import Box, Fitted, empty
from .memory import Owner
from .passes import FullscreenPass, FullscreenPasses, bind_textures
from .point_objects import carried
from .programs import build_compute, build_program, set_uniforms, source_and_target
from .raw_gl import DEPTH_TEST
from .shadows import Tile
from .state import enabled
from .target import SplatImage, SurfaceImage
from .textures import Colors, FrameTextures, PointLight, PointSurface

TOGETHER = 1 << 14  # squares that one call draws
GROUP = 32  # threads, as in grid.comp
BY_PLANES: Step = (0.0, 0.0)  # surfaces end where neighbours leave each other's tangent planes, see common/grid.glsl


class Grid(NamedTuple):
    """Where the points of an object are, and which belong together: all that its shadow depends on."""

    surface: PointSurface
    source: Camera  # that took the frame
    pose: np.ndarray  # (4, 4) from its axes to the world, without the scale
    scale: float
    max_step: Step


class ShownGrid(NamedTuple):
    """Triangles with what colours them."""

    points: Grid
    textures: FrameTextures
    colors: Colors
    shading: str
    light: PointLight | None  # of the points, for gouraud shading
    material: tuple[float, float, float, float] | None  # for flat shading, which is lit as it is drawn

    @property
    def has_doubts(self) -> bool:
        """Some of its normals are uncertain, and matter."""
        return self.shading == "phong" and self.points.surface.certainty is not None


class GridObjects(Owner):
    """Draws the meshes between the pixels of frames into views and into shadow maps, both sides of each triangle.

    First 1/z of all that a mesh covers: by a compute shader where there is one, else as depth; then each pixel of the
    view looks back into the frame. Which triangles there are is found once for the points, not for each view.
    """

    def __init__(self, context: moderngl.Context, can_compute: bool):
        super().__init__(context)
        self._can_compute = can_compute
        self._passes = FullscreenPasses(context)
        self._scratch = Fitted(context, SplatImage)  # of the size of a shadow view
        self._compute: moderngl.ComputeShader | None = None  # these two are made when they are first needed
        self._array: moderngl.VertexArray | None = None

    def find_triangles(self, grid: Grid) -> None:
        """Which triangles there are, and how far pixels reach beside them, by shaders/common/grid.glsl."""
        target, surface = grid.surface.triangles.target, {"surface_map": grid.surface.texture}
        empty(target, grid.surface.window)
        finding = self._passes.get("grid_triangles.frag")
        finding.draw(target, surface, intrinsics=grid.source.intrinsics, max_step=grid.max_step)

    def add_surface(
        self,
        surfaces: SurfaceImage,
        splats: SplatImage,
        shown: ShownGrid,
        eye: Eye,
        number: int,
        lights: dict[str, Any],
    ) -> None:
        """The mesh among the surfaces of others. number: of the material, counted from 1.

        lights: inputs of shaders/common/shadowed_lights.glsl, for flat shading.
        """
        grid = shown.points
        seen = self._draw_depths(splats, grid, eye) | _maps(grid) | _way(grid, eye)
        inputs = seen | {"scale": grid.scale, "material_number": number / 65535}
        with enabled(self._context, DEPTH_TEST):
            self._resolve(shown, inputs, lights).draw(surfaces.shared_target, {}, **inputs)

    def _resolve(self, shown: ShownGrid, inputs: dict[str, Any], lights: dict[str, Any]) -> FullscreenPass:
        """The pass that looks a mesh up; adds to its inputs what colours it."""
        inputs["color_map"] = shown.colors.texture if shown.light is None else shown.light.texture
        if shown.shading == "flat":
            inputs |= lights | {"material": shown.material}
            return self._passes.get("grid_flat.frag", self._can_compute, SHADOWS=int("shadow_map" in lights))
        constants = {"SHADING": SHADINGS.index(shown.shading)}
        if shown.has_doubts:
            inputs["certainty_map"], constants["CERTAINTY"] = shown.points.surface.certainty, 1
        return self._passes.get("grid.frag", self._can_compute, **constants)

    def add_shadow(self, tile: Tile, grid: Grid, eye: Eye) -> None:
        """The mesh's depth in a light's view. The eye is the light's."""
        if not self._can_compute:
            self._draw_pieces(tile.target, grid, eye)
            return
        image = self._scratch.fit((tile.side, tile.side))
        self._note_pieces(image, grid, eye)
        with enabled(self._context, DEPTH_TEST):
            shadow, near = self._passes.get("shadow.frag", True), eye.near / grid.scale
            shadow.draw(tile.target, {}, first=tile.first, side=tile.side, near=near)

    def _draw_depths(self, image: SplatImage, grid: Grid, eye: Eye) -> dict[str, Any]:
        """Draws what the mesh covers. Returns where its depths are."""
        if self._can_compute:
            self._note_pieces(image, grid, eye)
            return {"target_size": image.size}
        image.visible.use()
        image.visible.clear(depth=1.0)
        self._draw_pieces(image.visible, grid, eye)
        return {"window_depths": image.depth}

    def _note_pieces(self, image: SplatImage, grid: Grid, eye: Eye) -> None:
        """1/z of the mesh, by the compute shader."""
        self._compute = self._compute or self._keep(build_compute(self._context, "grid.comp"))
        self._context.finish()  # whoever still reads 1/z comes before it is cleared: llvmpipe's threads heed no barrier
        image.nearest.clear()
        image.nearest.bind_to_storage_buffer(0)
        window = _squares(grid)
        self._set_inputs(self._compute, grid, eye)
        self._compute.run(-(-window[2] // GROUP), window[3])
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        image.window = 0, 0, *image.size
        image.raise_version()

    def _draw_pieces(self, target: moderngl.Framebuffer, grid: Grid, eye: Eye) -> None:
        """Depth of the mesh, by quads that are found from their numbers: there is no vertex buffer but for their order."""
        if self._array is None:
            order = 4 * np.arange(4 * TOGETHER, dtype=np.uint32)[:, None] + np.array((0, 1, 2, 3, 2, 1), np.uint32)
            program = self._keep(build_program(self._context, "grid.vert", "grid_depth.frag"))
            buffer = self._allocate(self._context.buffer, order.tobytes())
            self._array = self._allocate(self._context.vertex_array, program, [], buffer)
        self._set_inputs(self._array.program, grid, eye)
        _, _, columns, rows = _squares(grid)
        target.use()
        with enabled(self._context, DEPTH_TEST):
            for first in range(0, columns * rows, TOGETHER):
                set_uniforms(self._array.program, first_square=first)
                self._array.render(moderngl.TRIANGLES, vertices=24 * min(TOGETHER, columns * rows - first))

    def _set_inputs(self, program: moderngl.Program | moderngl.ComputeShader, grid: Grid, eye: Eye) -> None:
        inputs = _maps(grid) | _way(grid, eye) | {"window": _squares(grid)}
        inputs["target_size"] = eye.camera.width, eye.camera.height
        bind_textures(program, inputs)
        set_uniforms(program, **inputs)

    def release(self) -> None:
        self._scratch.release()
        self._passes.release()
        super().release()


def _maps(grid: Grid) -> dict[str, Any]:
    return {"surface_map": grid.surface.texture, "triangle_map": grid.surface.triangles.texture}


def _way(grid: Grid, eye: Eye) -> dict[str, Any]:
    """The uniforms of the warp."""
    return source_and_target(grid.source, eye.camera, carried(grid, eye)) | {"near": eye.near / grid.scale}


def _squares(grid: Grid) -> Box:
    """First column and row, columns and rows of the squares that have corners among the points."""
    left, top, width, height = grid.surface.window
    return left - 1, top - 1, width + 1, height + 1


def depth_step(look: Look) -> Step:
    """By how much neighbours of one surface may differ: the look's step, else by their tangent planes."""
    return BY_PLANES if look.max_depth_step is None else parse_max_depth_step(look.max_depth_step)
