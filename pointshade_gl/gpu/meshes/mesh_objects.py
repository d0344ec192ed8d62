"""Draws triangle meshes: as visible surfaces of a view, or as depth in a shadow map."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any, NamedTuple, TypeVar

import moderngl
import numpy as np

from ...scene.appearance import NOT_LIT
from ...scene.camera import Eye
from ...scene.objects import Mesh
from ..context.raw_gl import DEPTH_TEST
from ..context.saved_state import enabled
from ..core.images import check_size
from ..core.memory import Owner, check_memory
from ..core.passes import set_inputs
from ..core.programs import build_program
from ..core.view_images import SurfaceImage
from ..shading.light_set import DARK, HIGHLIGHTS
from ..shading.shadow_map import Tile

CORNER = "position", "normal", "uv"
WAYS = "16f 9f /i", "view", "normal_view"
DRAWS = {  # to be lit later, lit at its corners, or its depth only: shaders, and what they read of corners and copies
    "surface": ("meshes/mesh.vert", "meshes/mesh.frag", ("3f 3f 2f 12x", *CORNER), WAYS),
    "lit": ("meshes/mesh_lit.vert", "meshes/mesh_lit.frag", ("3f 3f 2f 3f", *CORNER, "lit_at"), WAYS),
    "shadow": ("meshes/mesh.vert", "meshes/mesh_shadow.frag", ("3f 32x", "position"), ("16f 36x /i", "view")),
}  # fmt: skip
_Thing = TypeVar("_Thing")


class PlacedMesh(NamedTuple):
    """A mesh and its transforms to the world, of each of its copies one."""

    mesh: Mesh
    worlds: np.ndarray  # (n, 4, 4) node-to-world

    @property
    def shading(self) -> str:
        return self.mesh.shading


def joined(things: Iterable[_Thing]) -> Iterator[tuple[int, _Thing | PlacedMesh]]:
    """Yield things with their numbers; copies of one mesh that follow each other as one, with the first one's number.

    They are drawn at once, and in the same order.
    """
    runs = groupby(enumerate(things), lambda one: one[1].mesh if isinstance(one[1], PlacedMesh) else one[0])
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
        inputs = _camera(eye) | {"base_color": mesh.color, "material_number": float(number)}
        inputs |= {"picture": buffers.picture}
        if mesh.shading in ("flat", "gouraud"):
            array = buffers.arrays["lit"]
            inputs |= DARK.inputs | lights | {"material": mesh.material.strengths}
            for name in HIGHLIGHTS:  # corners have no highlights of an environment
                inputs.pop(name, None)
        else:
            array = buffers.arrays["surface"]
            inputs["is_lit"] = mesh.shading not in NOT_LIT
        self._draw(surfaces.shared_target, array, inputs, placed, eye)

    def add_shadow(self, tile: Tile, placed: PlacedMesh, eye: Eye) -> None:
        """Draw the mesh's depth into a shadow map. eye: the light's camera."""
        self._draw(tile.target, self._buffers(placed.mesh).arrays["shadow"], _camera(eye), placed, eye)

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
            self.arrays = {
                name: self._allocate(context.vertex_array, programs[name], [(corners, *read), (ways, *way)], order)
                for name, (_, _, read, way) in DRAWS.items()
            }
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


def _camera(eye: Eye) -> dict[str, Any]:
    return {
        "target": eye.camera.intrinsics,
        "target_size": (eye.camera.width, eye.camera.height),
        "near": eye.near,
    }
