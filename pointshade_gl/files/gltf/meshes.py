"""Converts glTF meshes and their materials to scene meshes and clouds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.words import cut
from ...scene.cloud import PointCloud
from ...scene.objects import Mesh
from .buffers import Parts
from .checks import label, numbers, pick, telling
from .clouds import POINTS, read_cloud
from .container import UNLIT
from .extras import options
from .points import read_material

TRIANGLES, STRIP, FAN = 4, 5, 6
_MATERIAL_KEYS = ("ambient", "diffuse", "specular", "shininess", "shading")


class Meshes:
    """The meshes of one file, each read once; nodes that show the same one share it."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._read: dict[int, tuple[Mesh | PointCloud, ...]] = {}
        self._materials: dict[int | None, dict[str, Any]] = {None: {}}

    def __getitem__(self, index: Any) -> tuple[Mesh | PointCloud, ...]:
        """One for each primitive that has triangles or points. Raises ValueError or OSError."""
        mesh = pick(self._parts.gltf.meshes, index, "mesh")
        if index not in self._read:
            found = []
            for k, primitive in enumerate(mesh.primitives or ()):
                part = label("mesh", index, mesh.name) + (f" primitive {k}" if len(mesh.primitives) > 1 else "")
                with telling(part):
                    found.append(self._primitive(primitive, part))
            self._read[index] = tuple(mesh for mesh in found if mesh is not None)
        return self._read[index]

    def _primitive(self, primitive: SimpleNamespace, part: str) -> Mesh | PointCloud | None:
        parts, held = self._parts, primitive.attributes or {}
        mode = TRIANGLES if primitive.mode is None else primitive.mode
        if mode not in (POINTS, TRIANGLES, STRIP, FAN) or held.get("POSITION") is None:
            what = "no positions" if held.get("POSITION") is None else "lines"
            parts.note(f"{part} is left out: it has {what}, only triangles and points are drawn")
            return None
        if mode != POINTS and held.get("COLOR_0") is not None:
            parts.note(f"{part}: its colours per corner (COLOR_0) are not drawn")
        if primitive.targets:
            parts.note(f"{part}: its morph targets are not drawn")
        if mode == POINTS:
            return read_cloud(parts, primitive, dict(self._material(primitive.material)), part)
        points = parts.array(held["POSITION"], ("VEC3",)).astype(np.float32)
        if primitive.indices is None:
            corners = np.arange(len(points), dtype=np.uint32)
            parts.count_corners(len(corners))
        else:
            corners = parts.array(primitive.indices, ("SCALAR",))[:, 0]
        faces = triangles(corners, mode)
        parts.count_corners(max(faces.size - len(corners), 0))  # strips and fans have three for each
        if not len(faces):
            parts.note(f"{part} is left out: it has no triangle")
            return None
        look = dict(self._material(primitive.material))
        channel = look.pop("channel", 0)
        uv = held.get(f"TEXCOORD_{channel}")
        if uv is None and "texture" in look:
            parts.note(f"{part}: its texture is not drawn, it has no TEXCOORD_{channel}")
            del look["texture"]
        normals = held.get("NORMAL")
        return Mesh(
            points,
            faces,
            normals=None if normals is None else parts.array(normals, ("VEC3",)).astype(np.float32),
            uv=None if uv is None else parts.array(uv, ("VEC2",)).astype(np.float32),
            **look,
        )

    def _material(self, index: Any) -> dict[str, Any]:
        """Fields of Mesh that a material decides, and the channel of its texture's coordinates."""
        if index not in self._materials:
            material = pick(self._parts.gltf.materials, index, "material")
            part = label("material", index, material.name)
            if material.alphaMode not in (None, "OPAQUE"):
                self._parts.note(f"{part}: its transparency ({cut(material.alphaMode)}) is not drawn")
            with telling(part):
                said = options(material.extras, _MATERIAL_KEYS)
                look: dict[str, Any] = {"shading": "none"} if UNLIT in (material.extensions or {}) else {}
                if "shading" in said:
                    look["shading"] = said["shading"]
                look["material"] = read_material({key: value for key, value in said.items() if key != "shading"})
                base = material.pbrMetallicRoughness
                if base is not None and base.baseColorFactor is not None:
                    red, green, blue, _ = numbers(base.baseColorFactor, (4,), "baseColorFactor").tolist()
                    look["color"] = (red, green, blue)
                if base is not None and base.baseColorTexture is not None:
                    look["texture"] = self._texture(base.baseColorTexture.index, material.alphaMode or "OPAQUE")
                    look["channel"] = base.baseColorTexture.texCoord or 0
            self._materials[index] = look
        return self._materials[index]

    def _texture(self, index: Any, alpha_mode: str) -> NDArray[np.uint8]:
        texture = pick(self._parts.gltf.textures, index, "texture")
        with telling(label("texture", index, texture.name)):
            picture = self._parts.picture(texture.source)
        return np.ascontiguousarray(picture[..., :3]) if alpha_mode == "OPAQUE" else picture


def triangles(corners: NDArray[Any], mode: int) -> NDArray[np.uint32]:
    """(m, 3) corners of the triangles of a list, a strip or a fan, in the winding that glTF gives them."""
    corners = corners.astype(np.uint32)
    if mode == TRIANGLES:
        if len(corners) % 3:
            raise ValueError(f"its triangles have {len(corners)} corners, expected a multiple of 3")
        return corners.reshape(-1, 3)
    k = np.arange(max(0, len(corners) - 2))
    rows = [k, k + 1 + k % 2, k + 2 - k % 2] if mode == STRIP else [k + 1, k + 2, 0 * k]
    return corners[np.column_stack(rows)]
