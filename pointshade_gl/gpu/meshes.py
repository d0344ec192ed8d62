"""Mesh pass: triangles -> surfaces of the view, or depth in a light's view."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..mesh import Mesh
from .passes import bind_textures
from .programs import build_program, set_uniforms


class MeshPass:
    """Keeps the meshes of the last scenes on the GPU; both sides of a triangle are drawn."""

    def __init__(self, context: moderngl.Context):
        self._context = context
        self._surface = build_program(context, "mesh.vert", "mesh.frag")
        self._lit = build_program(context, "mesh_lit.vert", "mesh_lit.frag")
        self._shadow = build_program(context, "mesh.vert", "mesh_shadow.frag")
        self._kept: dict[int, MeshBuffers] = {}

    def draw_surface(
        self,
        target: moderngl.Framebuffer,
        mesh: Mesh,
        camera: Camera,
        view: np.ndarray,
        near: float,
        material_number: float,
        lights: dict[str, Any],
    ) -> None:
        """view (4, 4) takes node axes to target axes. The target has a depth buffer.

        lights are the inputs of shaders/common/scene_light.glsl, for meshes that are lit at their corners.
        """
        buffers = self._buffers(mesh)
        inputs = _camera(camera, view, near) | {"base_color": mesh.color, "material_number": material_number}
        inputs |= {"picture": buffers.picture, "normal_view": np.linalg.inv(view[:3, :3]).astype("f4").tobytes()}
        if mesh.shading in ("flat", "gouraud"):
            program, array = self._lit, buffers.lit
            inputs |= lights | {"material": mesh.material.strengths}
        else:
            program, array = self._surface, buffers.surface
            inputs["is_lit"] = mesh.shading != "none"
        bind_textures(inputs)
        set_uniforms(program, **inputs)
        self._draw(target, array)

    def draw_shadow(
        self, target: moderngl.Framebuffer, mesh: Mesh, camera: Camera, view: np.ndarray, near: float
    ) -> None:
        """Into the target's viewport, which has the camera's size."""
        set_uniforms(self._shadow, **_camera(camera, view, near))
        self._draw(target, self._buffers(mesh).shadow)

    def keep_only(self, meshes: list[Mesh]) -> None:
        """Frees the meshes that are not among these."""
        wanted = {id(mesh) for mesh in meshes}
        for key in [key for key in self._kept if key not in wanted]:
            self._kept.pop(key).release()

    def _draw(self, target: moderngl.Framebuffer, array: moderngl.VertexArray) -> None:
        target.use()
        self._context.enable_only(moderngl.DEPTH_TEST)
        array.render(moderngl.TRIANGLES)
        self._context.enable_only(moderngl.NOTHING)

    def _buffers(self, mesh: Mesh) -> MeshBuffers:
        if id(mesh) not in self._kept:
            self._kept[id(mesh)] = MeshBuffers(self._context, mesh, self._surface, self._lit, self._shadow)
        return self._kept[id(mesh)]

    def release(self) -> None:
        self.keep_only([])
        for program in (self._shadow, self._lit, self._surface):
            program.release()


class MeshBuffers:
    """One mesh on the GPU."""

    def __init__(
        self,
        context: moderngl.Context,
        mesh: Mesh,
        surface: moderngl.Program,
        lit: moderngl.Program,
        shadow: moderngl.Program,
    ):
        self.mesh = mesh  # kept alive: its identity is its name
        faces, positions, uv = mesh.faces, mesh.positions, mesh.uv
        uv = np.zeros((len(positions), 2), np.float32) if uv is None else uv
        if mesh.normals is None or mesh.shading == "flat":
            positions, uv = positions[faces.ravel()], uv[faces.ravel()]
            a, b, c = positions.reshape(-1, 3, 3).transpose(1, 0, 2)
            normals = np.cross(b - a, c - a).repeat(3, 0)
            faces = np.arange(len(positions), dtype=np.uint32)
        else:
            normals = mesh.normals
        normals = np.where(
            normals.any(-1, keepdims=True), normals, np.array((0, 0, 1), np.float32)
        )  # of triangles without area
        middle = positions
        if mesh.shading == "flat":
            middle = positions.reshape(-1, 3, 3).mean(1).repeat(3, 0)
        vertices = np.concatenate([positions, normals, uv, middle], -1).astype("f4")
        self._vertices = context.buffer(vertices.tobytes() or bytes(44))
        self._faces = context.buffer(np.ascontiguousarray(faces).tobytes() or bytes(12))

        def array(program: moderngl.Program, layout: str, *names: str) -> moderngl.VertexArray:
            return context.vertex_array(program, [(self._vertices, layout, *names)], self._faces)

        self.surface = array(surface, "3f 3f 2f 12x", "position", "normal", "uv")
        self.lit = array(lit, "3f 3f 2f 3f", "position", "normal", "uv", "lit_at")
        self.shadow = array(shadow, "3f 32x", "position")
        texture = np.full((1, 1, 3), 255, np.uint8) if mesh.texture is None else mesh.texture
        self.picture = context.texture(
            (texture.shape[1], texture.shape[0]), texture.shape[2], texture.tobytes(), alignment=1
        )
        self.picture.build_mipmaps()
        self.picture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)

    def release(self) -> None:
        for item in (self.picture, self.shadow, self.lit, self.surface, self._faces, self._vertices):
            item.release()


def _camera(camera: Camera, view: np.ndarray, near: float) -> dict[str, Any]:
    return {
        "target": camera.intrinsics,
        "target_size": (camera.width, camera.height),
        "view": view.T.astype("f4").tobytes(),
        "near": near,
    }
