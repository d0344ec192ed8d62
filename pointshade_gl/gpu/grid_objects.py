"""Point objects as meshes: the triangles between neighbouring pixels, instead of splats."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl

from ..camera import Eye
from ..estimators import Step, parse_max_depth_step
from ..look import SHADINGS, Look
from .grid_depths import ComputedDepths, DrawnDepths, Grid
from .images import Fitted, confine, empty
from .memory import Owner
from .passes import FullscreenPass, FullscreenPasses
from .raw_gl import DEPTH_TEST
from .shadows import Tile
from .state import enabled
from .target import SplatImage, SurfaceImage
from .textures import Colors, FrameTextures, PointLight

BY_PLANES: Step = (0.0, 0.0)  # surfaces end where neighbours leave each other's tangent planes, see common/grid.glsl


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

    def __init__(self, context: moderngl.Context, can_compute: bool, is_software: bool):
        super().__init__(context)
        self._passes = FullscreenPasses(context)
        self._scratch = Fitted(context, SplatImage)  # of the size of a shadow view
        self._depths = ComputedDepths(context, is_software) if can_compute else DrawnDepths(context)
        self._look_up = can_compute

    def find_triangles(self, grid: Grid) -> None:
        """Which triangles there are, and how far pixels reach beside them, by shaders/common/grid.glsl."""
        target, surface = grid.surface.triangles.target, {"surface_map": grid.surface.texture}
        empty(target, grid.surface.window)
        finding = self._passes.get("grid_triangles.frag")
        finding.draw(target, surface, intrinsics=grid.source.intrinsics, max_step=grid.max_step)
        if self._look_up:
            target, (left, top, width, height) = grid.surface.triangles.planes_target, grid.surface.window
            empty(target, (left, top, width + 1, height + 1))
            self._passes.get("grid_planes.frag").draw(target, grid.maps(), intrinsics=grid.source.intrinsics)

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
        self._depths.draw(splats, grid, eye)
        seen = {"target_size": splats.size} if self._look_up else {"window_depths": splats.depth}
        inputs = seen | grid.maps() | grid.way(eye) | {"scale": grid.scale, "material_number": number / 65535}
        resolve = self._resolve(shown, inputs, lights)
        confine(surfaces.shared_target, splats.window)
        with enabled(self._context, DEPTH_TEST):
            resolve.draw(surfaces.shared_target, {}, **inputs)
        confine(surfaces.shared_target, None)

    def _resolve(self, shown: ShownGrid, inputs: dict[str, Any], lights: dict[str, Any]) -> FullscreenPass:
        """The pass that looks a mesh up; adds to its inputs what colours it."""
        inputs["color_map"] = shown.colors.texture if shown.light is None else shown.light.texture
        if shown.shading == "flat":
            inputs |= lights | {"material": shown.material}
            return self._passes.get("grid_flat.frag", self._look_up, SHADOWS=int("shadow_map" in lights))
        constants = {"SHADING": SHADINGS.index(shown.shading)}
        if shown.has_doubts:
            inputs["certainty_map"], constants["CERTAINTY"] = shown.points.surface.certainty, 1
        return self._passes.get("grid.frag", self._look_up, **constants)

    def add_shadow(self, tile: Tile, grid: Grid, eye: Eye) -> None:
        """The mesh's depth in a light's view. The eye is the light's."""
        if isinstance(self._depths, DrawnDepths):
            self._depths.add(tile.target, grid, eye)
            return
        image = self._scratch.fit((tile.side, tile.side))
        self._depths.draw(image, grid, eye)
        left, top, width, height = image.window
        confine(tile.target, (tile.first[0] + left, tile.first[1] + top, width, height))
        with enabled(self._context, DEPTH_TEST):
            shadow, near = self._passes.get("shadow.frag", True), eye.near / grid.scale
            shadow.draw(tile.target, {}, first=tile.first, side=tile.side, near=near)
        confine(tile.target, None)

    def release(self) -> None:
        for item in (self._scratch, self._depths, self._passes):
            item.release()
        super().release()


def depth_step(look: Look) -> Step:
    """By how much neighbours of one surface may differ: the look's step, else by their tangent planes."""
    return BY_PLANES if look.max_depth_step is None else parse_max_depth_step(look.max_depth_step)
