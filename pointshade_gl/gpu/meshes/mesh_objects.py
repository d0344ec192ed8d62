"""Draws triangle meshes, and point objects as meshes with triangles between neighbouring pixels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple, TypeVar

import moderngl
import numpy as np

from ...scene.appearance import LIT_EARLY, NOT_LIT, Appearance, shader_model
from ...scene.camera import Camera, Eye
from ...scene.noise import Step
from ...scene.objects import Mesh
from ...scene.values import srgb_to_linear
from ..context.caller_state import DEPTH_TEST, PROGRAM_POINT_SIZE, enabled
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import Box, Fitted, Image, Owner, check_memory, check_size, depth_tested, empty
from ..core.programs import (
    FullscreenPass,
    FullscreenPasses,
    build_compute,
    build_program,
    set_inputs,
    set_uniforms,
    source_and_target,
)
from ..core.steps import Parts
from ..core.view_images import Canvas, Drawable, ShownFrame, SplatImage, SurfaceImage, Target
from ..points.point_objects import model_view
from ..points.rasterizers import MOST_GROUPS, RimList, clear_nearest, head_of, no_rims, window_of
from ..points.set_merge import shared_variant
from ..shading.light_set import DARK, HIGHLIGHTS, SPLAT_SHADOWS, ShadowTile, environment_of

CORNER = "position", "normal", "uv"
TINT = "tint"  # a colour less white: without one it is 0 throughout, so that nothing changes
WAYS = "16f 9f /i", "view", "normal_view"
DRAWS = {  # to be lit later, lit at its corners, or its depth only: shaders, and what they read of corners and copies
    "surface": ("meshes/mesh.vert", "meshes/mesh.frag", ("3f 3f 2f 12x", *CORNER), WAYS),
    "lit": ("meshes/mesh_lit.vert", "meshes/mesh_lit.frag", ("3f 3f 2f 3f", *CORNER, "lit_at"), WAYS),
    "shadow": ("meshes/mesh.vert", "meshes/mesh_shadow.frag", ("3f 32x", "position"), ("16f 36x /i", "view")),
}  # fmt: skip
_Thing = TypeVar("_Thing")


@dataclass(eq=False, slots=True)
class PlacedMesh(Parts, Drawable):
    """A mesh and its transforms to the world, of each of its copies one."""

    mesh: Mesh
    worlds: np.ndarray  # (n, 4, 4) node-to-world

    kind = "mesh"

    @property
    def several(self) -> int:
        return len(self.worlds)

    @property
    def shading(self) -> str:
        return self.mesh.shading

    @property
    def is_lit_as_drawn(self) -> bool:
        return self.shading in LIT_EARLY

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        passes.meshes.add_shadow(tile, self, eye)

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        passes.meshes.add_surface(target.surfaces, self, eye, number, lights)


def joined(instances: Iterable[_Thing]) -> Iterator[tuple[int, _Thing | PlacedMesh]]:
    """Yield instances with their numbers; copies of one mesh that follow each other as one, with the first's number.

    They are drawn at once, and in the same order.
    """
    runs = groupby(enumerate(instances), lambda one: one[1].mesh if isinstance(one[1], PlacedMesh) else one[0])
    for mesh, run in runs:
        copies: list[tuple[int, Any]] = list(run)
        if isinstance(mesh, Mesh) and len(copies) > 1:
            worlds = np.concatenate([copy.worlds for _, copy in copies])
            worlds.flags.writeable = False
            yield copies[0][0], PlacedMesh(mesh, worlds)
        else:
            yield copies[0]


class MeshObjects(Owner):
    """Draws meshes into views and into shadow maps, both sides of each triangle. Keeps those of the last scenes."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._programs = {
                name: self._keep(build_program(context, vertex, fragment, COPIES=1))
                for name, (vertex, fragment, *_) in DRAWS.items()
            }
            self._ways = self._allocate(context.buffer, reserve=100)  # of the copies that are drawn
        self._kept: dict[Mesh, MeshBuffers] = {}

    def add_surface(
        self, surfaces: SurfaceImage, placed: PlacedMesh, eye: Eye, number: int, lights: dict[str, Any]
    ) -> None:
        """Draw the mesh among the surfaces of other objects. number: of its material, counted from 1.

        lights: inputs of shaders/common/shadowed_lights.glsl, for meshes that are lit at their corners.
        """
        mesh, buffers = placed.mesh, self._buffers(placed.mesh)
        inputs = {"base_color": mesh.color, "material_number": float(number), "picture": buffers.picture}
        if mesh.shading in ("flat", "gouraud"):
            array = buffers.arrays["lit"]
            inputs |= DARK.inputs | lights | {"material": mesh.material.strengths}
            for name in (
                *HIGHLIGHTS,
                *SPLAT_SHADOWS,
            ):  # corners have no highlights of an environment, and none of these
                inputs.pop(name, None)
        else:
            array = buffers.arrays["surface"]
            inputs["is_lit"] = mesh.shading not in NOT_LIT
        self._draw(surfaces.shared_target, array, inputs, placed, eye)

    def add_shadow(self, tile: ShadowTile, placed: PlacedMesh, eye: Eye) -> None:
        """Draw the mesh's depth into a shadow map. eye: the light's camera."""
        self._draw(tile.target, self._buffers(placed.mesh).arrays["shadow"], {}, placed, eye)

    def keep_only(self, meshes: Iterable[Mesh]) -> list[Mesh]:
        """Free the meshes that are not among these, and return them."""
        wanted = set(meshes)
        unused = [mesh for mesh in self._kept if mesh not in wanted]
        for mesh in unused:
            self._kept.pop(mesh).release()
        return unused

    def _draw(
        self, target: moderngl.Framebuffer, array: moderngl.VertexArray, inputs: dict[str, Any], placed: PlacedMesh,
        eye: Eye,
    ) -> None:  # fmt: skip
        views = np.linalg.inv(eye.pose) @ placed.worlds
        by_column = views.transpose(0, 2, 1).reshape(-1, 16)
        turns = np.linalg.inv(views[:, :3, :3]).reshape(-1, 9)  # by row: transposed
        ways = np.concatenate([by_column, turns], 1).astype("f4")
        if ways.nbytes > self._ways.size:
            self._ways.orphan(ways.nbytes)
            check_memory(self._context)
        self._ways.write(ways)
        camera = eye.camera
        inputs |= {"target": camera.intrinsics, "target_size": (camera.width, camera.height), "near": eye.near}
        set_inputs(array.program, inputs)
        target.use()
        with enabled(self._context, DEPTH_TEST):
            array.render(moderngl.TRIANGLES, instances=len(ways))

    def _buffers(self, mesh: Mesh) -> MeshBuffers:
        if mesh not in self._kept:
            self._kept[mesh] = MeshBuffers(self._context, mesh, self._programs, self._ways)
        return self._kept[mesh]

    def release(self) -> None:
        self.keep_only([])
        super().release()


class MeshBuffers(Owner):
    """One mesh on the GPU."""

    def __init__(
        self, context: moderngl.Context, mesh: Mesh, programs: dict[str, moderngl.Program], ways: moderngl.Buffer
    ):
        super().__init__(context)
        vertices, faces = mesh_vertices(mesh)
        with self._all_or_nothing():
            corners = self._allocate(context.buffer, vertices.tobytes() or bytes(44))
            order = self._allocate(context.buffer, np.ascontiguousarray(faces).tobytes() or bytes(12))
            found = mesh_tints(mesh)
            tints = self._allocate(context.buffer, np.zeros(3, "f4").tobytes() if found is None else found.tobytes())
            tint = tints, "3f /r" if found is None else "3f", TINT
            self.arrays = {
                name: self._allocate(
                    context.vertex_array, programs[name],
                    [(corners, *read), (ways, *way), *([tint] if name != "shadow" else [])], order,
                )
                for name, (_, _, read, way) in DRAWS.items()
            }  # fmt: skip
            self.picture = self._texture(np.full((1, 1, 3), 255, np.uint8) if mesh.texture is None else mesh.texture)

    def _texture(self, pixels: np.ndarray) -> moderngl.Texture:
        height, width, components = pixels.shape
        check_size(self._context, width, height)
        make = self._context.texture
        texture = self._allocate(make, (width, height), components, pixels.tobytes(), alignment=1)
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        return texture


def mesh_vertices(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 11) float32, position, normal, uv and where it is lit, of each corner; and the (m,) or (m, 3) corners
    of the triangles, uint32."""
    faces, positions, uv = mesh.faces, mesh.positions, mesh.uv
    uv = np.zeros((len(positions), 2), np.float32) if uv is None else uv
    if mesh.normals is None or mesh.shading == "flat":
        positions, uv = positions[faces.ravel()], uv[faces.ravel()]
        a, b, c = positions.reshape(-1, 3, 3).transpose(1, 0, 2)
        normals = np.cross(b - a, c - a).repeat(3, 0)
        faces = np.arange(len(positions), dtype=np.uint32)
    else:
        normals = mesh.normals
    ahead = np.array((0, 0, 1), np.float32)  # of triangles without area
    normals = np.where(normals.any(-1, keepdims=True), normals, ahead)
    middle = positions
    if mesh.shading == "flat":
        middle = positions.reshape(-1, 3, 3).mean(1).repeat(3, 0)
    return np.concatenate([positions, normals, uv, middle], -1).astype("f4"), faces


def mesh_tints(mesh: Mesh) -> np.ndarray | None:
    """Return (n, 3) float32, the linear colour of each corner less white; None for a mesh without colours."""
    if mesh.colors is None or not len(mesh.faces):
        return None
    tints = srgb_to_linear(np.arange(256) / 255).astype("f4")[mesh.colors] - np.float32(1)
    is_apart = mesh.normals is None or mesh.shading == "flat"
    return np.ascontiguousarray(tints[mesh.faces.ravel()] if is_apart else tints)


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

    kind, several = "mesh", 1

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        passes.grids.add_shadow(tile, self, eye)

    def way(self, eye: Eye) -> dict[str, Any]:
        """Return the uniforms that project the grid into a view."""
        return source_and_target(self.source, eye.camera, model_view(self.pose, self.scale, eye))

    def maps(self) -> dict[str, Any]:
        return {"surface_map": self.surface.texture, "triangle_map": self.surface.triangles.texture}

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
        left, top, width, height = grid.surface.window
        columns, rows = width + 1 + left % 2, height + 1 + top % 2  # blocks begin at an even column and row
        planes = {"plane_map": grid.surface.planes.texture, "squares": (left // 2 * 2, top // 2 * 2, columns, rows)}
        set_inputs(squares, way | listed | planes)
        squares.run(-(-columns // (2 * GROUP)), -(-rows // ROWS))
        self._run_list(odd, odd_list, way | listed | grid.maps())
        ends = {"near": listed["near"], "surface_map": grid.surface.texture}
        self._run_list(rims, rim_list, way | ends | no_rims())
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)
        image.window = window_of(head_of(self._window), *image.size) if self._is_software else (0, 0, *image.size)
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


BY_PLANES: Step = (0.0, 0.0)  # surfaces end where neighbours leave each other's tangent planes, see common/grid.glsl


@dataclass(eq=False, slots=True)
class ShownGrid(ShownFrame):
    """A frame as triangles, with its colours or its light."""

    points: Grid
    textures: FrameTextures
    colors: Colors
    shading: str  # pyright: ignore[reportIncompatibleMethodOverride]
    light: Image | None  # of the points, for gouraud shading
    material: tuple[float, float, float, float] | None  # for flat shading, which is lit as it is drawn
    visibility: Image | None = None  # what its points see of the light from all around, if something may hide it

    @property
    def is_lit_as_drawn(self) -> bool:
        return self.shading == "flat"

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        passes.grids.add_surface(target, self, eye, number, lights)

    @property
    def is_shaded(self) -> bool:
        """Return whether it is lit when its visible surfaces are known."""
        return self.shading == "phong"


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
            view = model_view(shown.points.pose, shown.points.scale, eye)
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
            constants = {"SHADOWS": shadows, "SPLATS": int("splat_map" in lights), **environment_of(lights)}
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

    def add_shadow(self, tile: ShadowTile, grid: Grid, eye: Eye) -> None:
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


def depth_step(look: Appearance) -> Step:
    """Return by how much neighbours of one surface may differ: the look's step, else by their tangent planes."""
    return look.depth_step or BY_PLANES
