"""Draws triangle meshes: as visible surfaces of a view, or as depth in a shadow map."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Eye
from ...scene.mesh import Mesh
from ..context.raw_gl import DEPTH_TEST
from ..context.saved_state import enabled
from ..core.images import check_size
from ..core.memory import Owner
from ..core.passes import set_inputs
from ..core.programs import build_program
from ..core.view_images import SurfaceImage
from ..shading.shadow_map import Tile

DRAWS = {  # to be lit later, lit at its corners, or its depth only: shaders, and what they read of `mesh_vertices`
    "surface": ("meshes/mesh.vert", "meshes/mesh.frag", "3f 3f 2f 12x", "position", "normal", "uv"),
    "lit": ("meshes/mesh_lit.vert", "meshes/mesh_lit.frag", "3f 3f 2f 3f", "position", "normal", "uv", "lit_at"),
    "shadow": ("meshes/mesh.vert", "meshes/mesh_shadow.frag", "3f 32x", "position"),
}


class PlacedMesh(NamedTuple):
    """A mesh and its transform to the world."""

    mesh: Mesh
    world: np.ndarray  # (4, 4) node-to-world


class MeshObjects(Owner):
    """Draws meshes into views and into shadow maps, both sides of each triangle. Keeps those of the last scenes."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._programs = {
                name: self._keep(build_program(context, vertex, fragment))
                for name, (vertex, fragment, *_) in DRAWS.items()
            }
        self._kept: dict[Mesh, MeshBuffers] = {}

    def add_surface(
        self, surfaces: SurfaceImage, placed: PlacedMesh, eye: Eye, number: int, lights: dict[str, Any]
    ) -> None:
        """Draw the mesh among the surfaces of other objects. number: of its material, counted from 1.

        lights: inputs of shaders/common/shadowed_lights.glsl, for meshes that are lit at their corners.
        """
        mesh, view = placed.mesh, np.linalg.inv(eye.pose) @ placed.world
        buffers = self._buffers(mesh)
        inputs = _camera(eye, view) | {"base_color": mesh.color, "material_number": float(number)}
        inputs |= {"picture": buffers.picture, "normal_view": np.linalg.inv(view[:3, :3]).astype("f4").tobytes()}
        if mesh.shading in ("flat", "gouraud"):
            array = buffers.arrays["lit"]
            inputs |= lights | {"material": mesh.material.strengths}
        else:
            array = buffers.arrays["surface"]
            inputs["is_lit"] = mesh.shading != "none"
        self._draw(surfaces.shared_target, array, inputs)

    def add_shadow(self, tile: Tile, placed: PlacedMesh, eye: Eye) -> None:
        """Draw the mesh's depth into a shadow map. eye: the light's camera."""
        inputs = _camera(eye, np.linalg.inv(eye.pose) @ placed.world)
        self._draw(tile.target, self._buffers(placed.mesh).arrays["shadow"], inputs)

    def keep_only(self, meshes: Iterable[Mesh]) -> list[Mesh]:
        """Free the meshes that are not among these, and return them."""
        wanted = set(meshes)
        unused = [mesh for mesh in self._kept if mesh not in wanted]
        for mesh in unused:
            self._kept.pop(mesh).release()
        return unused

    def _draw(self, target: moderngl.Framebuffer, array: moderngl.VertexArray, inputs: dict[str, Any]) -> None:
        set_inputs(array.program, inputs)
        target.use()
        with enabled(self._context, DEPTH_TEST):
            array.render(moderngl.TRIANGLES)

    def _buffers(self, mesh: Mesh) -> MeshBuffers:
        if mesh not in self._kept:
            self._kept[mesh] = MeshBuffers(self._context, mesh, self._programs)
        return self._kept[mesh]

    def release(self) -> None:
        self.keep_only([])
        super().release()


class MeshBuffers(Owner):
    """One mesh on the GPU."""

    def __init__(self, context: moderngl.Context, mesh: Mesh, programs: dict[str, moderngl.Program]):
        super().__init__(context)
        vertices, faces = mesh_vertices(mesh)
        with self._all_or_nothing():
            corners = self._allocate(context.buffer, vertices.tobytes() or bytes(44))
            order = self._allocate(context.buffer, np.ascontiguousarray(faces).tobytes() or bytes(12))
            self.arrays = {
                name: self._allocate(context.vertex_array, programs[name], [(corners, *layout)], order)
                for name, (_, _, *layout) in DRAWS.items()
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


def _camera(eye: Eye, view: np.ndarray) -> dict[str, Any]:
    return {
        "target": eye.camera.intrinsics,
        "target_size": (eye.camera.width, eye.camera.height),
        "view": view.T.astype("f4").tobytes(),
        "near": eye.near,
    }
