"""Draws point objects as meshes, with triangles between neighbouring pixels instead of splats."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl

from ...scene.appearance import Look, shader_model
from ...scene.camera import Eye
from ...scene.noise import Step
from ..core.canvas import Canvas
from ..core.frame_textures import Colors, FrameTextures
from ..core.images import Fitted, Image, depth_tested, empty
from ..core.passes import FullscreenPass, FullscreenPasses
from ..core.view_images import SplatImage, SurfaceImage, Target
from ..points.point_objects import carried
from ..points.resolve import shared_variant
from ..shading.light_set import environment_of
from ..shading.shadow_map import Tile
from .grid_depths import ComputedDepths, DrawnDepths, Grid

BY_PLANES: Step = (0.0, 0.0)  # surfaces end where neighbours leave each other's tangent planes, see common/grid.glsl


class ShownGrid(NamedTuple):
    """A frame as triangles, with its colours or its light."""

    points: Grid
    textures: FrameTextures
    colors: Colors
    shading: str
    light: Image | None  # of the points, for gouraud shading
    material: tuple[float, float, float, float] | None  # for flat shading, which is lit as it is drawn
    visibility: Image | None = None  # what its points see of the light from all around, if something may hide it

    @property
    def is_shaded(self) -> bool:
        """Return whether it is lit when its visible surfaces are known."""
        return self.shading == "phong"

    @property
    def has_doubts(self) -> bool:
        """Return whether some of the normals are uncertain and are used."""
        return self.shading == "phong" and self.points.surface.certainty is not None


class GridObjects(FullscreenPasses):
    """Draws the meshes between the pixels of frames into views and into shadow maps, both sides of each triangle.

    First it rasterises 1/z of the mesh, by a compute shader where there is one, else as depth; then each pixel of the
    view looks up its point in the frame. Which triangles exist is found once for the points, not for each view.
    """

    def __init__(self, context: moderngl.Context, can_compute: bool, is_software: bool):
        super().__init__(context)
        self._scratch = self._keep(Fitted(context, SplatImage))  # of the size of a shadow view
        self._depths = self._keep(ComputedDepths(context, is_software) if can_compute else DrawnDepths(context))
        self._look_up = can_compute

    def find_triangles(self, grid: Grid) -> None:
        """Find which triangles exist, and how far pixels reach beside them, by shaders/common/grid.glsl."""
        target, surface = grid.surface.triangles.target, {"surface_map": grid.surface.texture}
        empty(target, grid.surface.window)
        finding = self.fullscreen("meshes/grid_triangles.frag")
        finding.draw(target, surface, intrinsics=grid.source.intrinsics, max_step=grid.max_step)
        if self._look_up:
            target, (left, top, width, height) = grid.surface.planes.target, grid.surface.window
            empty(target, (left, top, width + 1, height + 1))
            self.fullscreen("meshes/grid_planes.frag").draw(target, grid.maps(), intrinsics=grid.source.intrinsics)

    def draw_splats(self, image: SplatImage, grid: Grid, eye: Eye) -> None:
        """Rasterise the depth of the mesh in a view."""
        self._depths.draw(image, grid, eye)

    def draw_picture(self, canvas: Canvas, splats: SplatImage, shown: ShownGrid, eye: Eye) -> None:
        """Draw the picture of a mesh whose colours are known already: for none and gouraud."""
        self.draw_lit(canvas, splats, shown, eye, {})

    def draw_lit(self, canvas: Canvas, splats: SplatImage, shown: ShownGrid, eye: Eye, lights: dict[str, Any]) -> None:
        """Draw the picture of a mesh, lit in the same pass: for phong. lights: inputs of shaders/common/lights.glsl."""
        constants = {"LINEAR": int(canvas.linear), "ALONE": int("only_light" in lights), **environment_of(lights)}
        inputs = lights | self._inputs(splats, shown, eye)
        passed = self._pass("meshes/grid_picture.frag", shown, **constants)
        with canvas.opened(splats.window) as image:
            passed.draw(image, {}, **inputs)

    def draw_surface(
        self, surfaces: SurfaceImage, splats: SplatImage, shown: ShownGrid, eye: Eye, samples: int | None = None
    ) -> None:
        """Draw the surfaces of a mesh that is alone, for the light pass. samples: as for points."""
        surfaces.window, surfaces.has_doubts, surfaces.has_eye_dome = splats.window, shown.has_doubts, False
        surfaces.has_visibility, surfaces.knows_visibility = shown.visibility is not None, True
        empty(surfaces.target, splats.window)
        own = {"scale": 1.0, "material_number": 1.0, "near": eye.near}
        how = 0
        if samples is not None:
            view = carried(shown.points.pose, shown.points.scale, eye)
            how = shared_variant(view, shown.points.surface.texture, shown.colors.texture)
            own["samples"] = samples
        passed = self._pass("meshes/grid.frag", shown, SHARED=how)
        passed.draw(surfaces.target, {}, **self._inputs(splats, shown, eye) | own)
        surfaces.raise_version()

    def add_surface(self, target: Target, shown: ShownGrid, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        """Draw the mesh among the surfaces of other objects. number: of the material, counted from 1.

        lights: inputs of shaders/common/shadowed_lights.glsl, for flat shading.
        """
        splats, shared = target.splats, target.surfaces.shared_target
        self.draw_splats(splats, shown.points, eye)
        scale, inputs = shown.points.scale, self._inputs(splats, shown, eye)
        inputs |= {"scale": scale, "material_number": float(number), "near": eye.near / scale}
        if shown.shading == "flat":
            inputs |= lights | {"material": shown.material}
            shadows = 2 if "shadow_map" in lights else 0  # soft ones, in case: of hard ones the picture is the same
            constants = {"SHADOWS": shadows, **environment_of(lights)}
            passed = self.fullscreen("meshes/grid_flat.frag", self._look_up, **constants)
        else:
            passed = self._pass("meshes/grid.frag", shown)
        with depth_tested(self._context, shared, splats.window):
            passed.draw(shared, {}, **inputs)

    def _inputs(self, splats: SplatImage, shown: ShownGrid, eye: Eye) -> dict[str, Any]:
        """Return the inputs that place the mesh and colour it."""
        colors = shown.colors.texture if shown.light is None else shown.light.texture
        inputs = shown.points.maps() | shown.points.way(eye) | {"color_map": colors}
        if shown.has_doubts:
            inputs["certainty_map"] = shown.points.surface.certainty
        if shown.is_shaded and shown.visibility is not None:
            inputs["visibility_map"] = shown.visibility.texture
        if not self._look_up:
            return inputs | {"window_depths": splats.depth, "near": eye.near / shown.points.scale}
        splats.nearest.bind_to_storage_buffer(0)
        return inputs | {"target_size": splats.size}

    def _pass(self, fragment: str, shown: ShownGrid, **constants: int) -> FullscreenPass:
        constants |= {"SHADING": shader_model(shown.shading)} | ({"CERTAINTY": 1} if shown.has_doubts else {})
        constants |= {"VISIBILITY": 1} if shown.is_shaded and shown.visibility is not None else {}
        return self.fullscreen(fragment, self._look_up, **constants)

    def add_shadow(self, tile: Tile, grid: Grid, eye: Eye) -> None:
        """Draw the mesh's depth into a shadow map. eye: the light's camera."""
        image = self._scratch.fit((tile.side, tile.side))
        self._depths.draw(image, grid, eye)
        with depth_tested(self._context, tile.target, tile.part(image.window)):
            if self._look_up:
                shadow, near = self.fullscreen("shading/shadow.frag", True), eye.near / grid.scale
                shadow.draw(tile.target, {}, first=tile.first, side=tile.side, near=near)
            else:
                shadow = self.fullscreen("meshes/grid_shadow.frag")
                shadow.draw(tile.target, {"window_depths": image.depth}, first=tile.first)


def depth_step(look: Look) -> Step:
    """Return by how much neighbours of one surface may differ: the look's step, else by their tangent planes."""
    return look.depth_step or BY_PLANES
