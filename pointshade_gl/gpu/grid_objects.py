"""Point objects as meshes: the triangles between neighbouring pixels, instead of splats."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..camera import Camera, Eye
from ..estimators import Step, parse_max_depth_step
from ..look import Look
from .images import confine
from .memory import Owner
from .passes import FullscreenPass, bind_textures
from .point_objects import carried
from .programs import build_program, set_uniforms, source_and_target
from .raw_gl import DEPTH_TEST
from .shadows import Tile
from .state import enabled
from .target import SurfaceImage
from .textures import Colors, FrameTextures, PointLight, PointSurface

TOGETHER = 1 << 16  # squares that one call draws
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
    """Draws the triangles of point objects into views and into shadow maps, both sides of each.

    There is no vertex buffer: the vertex shaders find pixels by gl_VertexID. Which triangles there are is found once
    for the points, not for each view.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._finding: FullscreenPass | None = None
        self._programs: dict[str, tuple[moderngl.Program, moderngl.VertexArray]] = {}  # made when first needed
        with self._all_or_nothing():
            corners = 4 * np.arange(TOGETHER, dtype=np.uint32)[:, None] + np.array((0, 1, 2, 3, 2, 1), np.uint32)
            self._corners = self._allocate(context.buffer, corners.tobytes())

    def find_triangles(self, grid: Grid) -> None:
        """Which triangles there are, by shaders/common/grid.glsl."""
        self._finding = self._finding or self._keep(FullscreenPass(self._context, "grid_triangles.frag"))
        target, surface = grid.surface.triangles.target, {"surface_map": grid.surface.texture}
        confine(target, grid.surface.window)
        self._finding.draw(target, surface, intrinsics=grid.source.intrinsics, max_step=grid.max_step)

    def add_surface(
        self, surfaces: SurfaceImage, shown: ShownGrid, eye: Eye, number: int, lights: dict[str, Any]
    ) -> None:
        """The triangles among the surfaces of others. number: of the material, counted from 1.

        lights: inputs of shaders/common/shadowed_lights.glsl, for flat shading.
        """
        grid, shading = shown.points, shown.shading
        inputs: dict[str, Any] = {"scale": grid.scale, "material_number": float(number)}
        if shading == "gouraud":
            assert shown.light is not None
            inputs["light_map"] = shown.light.texture
        else:
            inputs |= {"color_map": shown.colors.texture, "source_size": grid.surface.size}
            is_flat = shading == "flat"
            inputs |= lights | {"material": shown.material} if is_flat else {"is_lit": shading == "phong"}
        if shown.has_doubts:
            inputs["certainty_map"], shading = grid.surface.certainty, "phong_doubtful"
        variant = "flat_shadowed" if shading == "flat" and "shadow_map" in lights else shading
        self._draw(variant, surfaces.shared_target, grid, eye, inputs)

    def add_shadow(self, tile: Tile, grid: Grid, eye: Eye) -> None:
        """The triangles' depth in a light's view. The eye is the light's."""
        self._draw("shadow", tile.target, grid, eye, {})

    def _draw(self, variant: str, target: moderngl.Framebuffer, grid: Grid, eye: Eye, inputs: dict[str, Any]) -> None:
        left, top, width, height = grid.surface.window
        squares = max(width - 1, 0) * max(height - 1, 0)
        program, array = self._program(variant)
        inputs |= {"surface_map": grid.surface.texture, "triangle_map": grid.surface.triangles.texture}
        inputs |= {"window": (left, top, width - 1), "near": eye.near / grid.scale}
        inputs |= {"target_size": (eye.camera.width, eye.camera.height)}
        inputs |= source_and_target(grid.source, eye.camera, carried(grid, eye))
        bind_textures(program, inputs)
        set_uniforms(program, **inputs)
        target.use()
        with enabled(self._context, DEPTH_TEST):
            for first in range(0, squares, TOGETHER):
                set_uniforms(program, first_square=first)
                array.render(moderngl.TRIANGLES, vertices=6 * min(TOGETHER, squares - first))

    def _program(self, variant: str) -> tuple[moderngl.Program, moderngl.VertexArray]:
        if variant not in self._programs:
            vertex, fragment, constants = PROGRAMS[variant]
            program = self._keep(build_program(self._context, vertex, fragment, None, **constants))
            self._programs[variant] = program, self._allocate(self._context.vertex_array, program, [], self._corners)
        return self._programs[variant]


PROGRAMS: dict[str, tuple[str, str, dict[str, int]]] = {
    "none": ("grid.vert", "grid.frag", {}),
    "flat": ("grid_flat.vert", "grid_flat.frag", {}),
    "flat_shadowed": ("grid_flat.vert", "grid_flat.frag", {"SHADOWS": 1}),
    "gouraud": ("grid_gouraud.vert", "grid_gouraud.frag", {}),
    "phong": ("grid.vert", "grid.frag", {}),
    "phong_doubtful": ("grid.vert", "grid.frag", {"CERTAINTY": 1}),
    "shadow": ("grid.vert", "grid_shadow.frag", {}),
}


def depth_step(look: Look) -> Step:
    """By how much neighbours of one surface may differ: the look's step, else by their tangent planes."""
    return BY_PLANES if look.max_depth_step is None else parse_max_depth_step(look.max_depth_step)
