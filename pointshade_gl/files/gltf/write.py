"""Writes a scene as glTF: one glTF node for each node, and more below it for content that one cannot hold."""

from __future__ import annotations

import json
import re
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ...messages.validation import check_path, check_type
from ...scene.appearance import Material
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.light import Light
from ...scene.mesh import Mesh
from ...scene.node import Node
from ...scene.point_object import PointObject
from ..access.atomic_write import FileSet
from ..access.content import FilePath
from .checks import telling
from .container import LIGHTS, UNLIT, library, pack
from .layout import layout
from .points import write_material, write_points
from .transforms import transform_of
from .views import FLIP, Matrix, light_place, write_camera, write_light

NO_NAME = r"\W+"  # not in the names of folders


def save_scene(path: FilePath, scene: Scene) -> None:
    """See the package, which imports this module when it is first needed."""
    path, scene = check_path(path), check_type(scene, Scene, "scene")
    if path.suffix.lower() not in (".gltf", ".glb"):
        raise ValueError(f"cannot write {path}: its suffix must be .gltf or .glb")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: there is no folder {path.parent}, create it first")
    with FileSet(path.parent) as files:
        writer = _Writer(path, files)
        writer.scene(scene)
        writer.finish()
        files.commit()


class _Writer:
    def __init__(self, path: Path, files: FileSet) -> None:
        self.lib = library()
        self.gltf = self.lib.GLTF2()
        self.gltf.asset = self.lib.Asset(generator="pointshade_gl")
        self.path, self.files = path, files
        self.is_binary = path.suffix.lower() == ".glb"
        self.blob = bytearray()
        self.lights: list[dict[str, Any]] = []
        self.frames: dict[Frame, dict[str, Any]] = {}
        self.folders: set[str] = set()
        self.known: dict[Any, int] = {}  # numbers of the parts that several nodes share: meshes, materials, pictures

    def scene(self, scene: Scene) -> None:
        """Numbers the nodes from above, each before those below it."""
        roots: list[int] = []
        stack: list[tuple[Node, list[int]]] = [(node, roots) for node in scene.nodes[::-1]]
        while stack:
            node, siblings = stack.pop()
            with telling(f"node {node.name!r}" if node.name else f"node {len(self.gltf.nodes)}"):
                siblings.append(self.node(node))
            below = self.gltf.nodes[siblings[-1]].children
            stack += [(child, below) for child in node.children[::-1]]
        said: dict[str, Any] = {}
        if scene.ambient != (1.0, 1.0, 1.0):
            said["ambient"] = list(scene.ambient)
        pose = np.asarray(scene.pose)
        if scene.camera is not None:
            values = write_camera(scene.camera)
            values["perspective"] = self.lib.Perspective(**values["perspective"])
            self.gltf.cameras.append(self.lib.Camera(**values))
            roots.append(self.add_node("camera", pose @ FLIP, camera=0))
        elif not np.array_equal(pose, FLIP):
            said["pose"] = pose.tolist()
        self.gltf.scenes.append(self.lib.Scene(nodes=roots, extras={"pointshade": said} if said else {}))
        self.gltf.scene = 0

    def node(self, node: Node) -> int:
        """One of our nodes with its content, without its children."""
        contents = node.content if isinstance(node.content, tuple) else (node.content,)
        meshes = tuple(item for item in contents if isinstance(item, Mesh) and len(item.faces))
        points = [item for item in contents if isinstance(item, PointObject)]
        lights = [item for item in contents if isinstance(item, Light)]
        switches = {name: False for name in ("visible", "shadow") if not getattr(node, name)}
        values: dict[str, Any] = {"extras": dict(switches)}
        if meshes:
            values["mesh"] = self.mesh(meshes)
        if points:
            values["extras"] |= self.points(points.pop(0), node.name)
        if lights and np.array_equal(light_place(lights[0]), np.eye(4)):
            values["extensions"] = self.light(lights.pop(0), node.shadow)
        index = self.add_node(node.name, np.asarray(node.transform), **values)
        below = self.gltf.nodes[index].children
        shadow = {} if node.shadow else {"shadow": False}
        below += [self.add_node("", np.eye(4), extras=shadow | self.points(item, node.name)) for item in points]
        below += [self.add_node("", light_place(item), extensions=self.light(item, True)) for item in lights]
        return index

    def add_node(self, name: str, matrix: Matrix, extras: dict[str, Any] | None = None, **values: Any) -> int:
        extras = {"pointshade": extras} if extras else {}
        self.gltf.nodes.append(self.lib.Node(name=name or None, extras=extras, **transform_of(matrix), **values))
        return len(self.gltf.nodes) - 1

    def points(self, points: PointObject, name: str) -> dict[str, Any]:
        folders = [self.folder(name) for _ in points.frames]
        return write_points(points, self.files.folder, folders, self.files.stage, self.frames)

    def folder(self, name: str) -> str:
        """A new name for a frame's folder."""
        file = self.path.name.replace(".", "_") if self.is_binary else self.path.stem  # of room.gltf and room.glb each
        plain = f"{file}_{re.sub(NO_NAME, '_', name) or 'points'}"
        folder, k = plain, 1
        while folder in self.folders:
            k += 1
            folder = f"{plain}_{k}"
        self.folders.add(folder)
        return folder

    def light(self, light: Light, node_casts: bool) -> dict[str, Any]:
        self.lights.append(write_light(light, node_casts))
        return {LIGHTS: {"light": len(self.lights) - 1}}

    def mesh(self, meshes: tuple[Mesh, ...]) -> int:
        key = meshes
        if key not in self.known:
            primitives = [self.primitive(mesh) for mesh in meshes]
            self.gltf.meshes.append(self.lib.Mesh(primitives=primitives))
            self.known[key] = len(self.gltf.meshes) - 1
        return self.known[key]

    def primitive(self, mesh: Mesh) -> Any:
        kind = np.uint16 if len(mesh.positions) < 0xFFFF else np.uint32
        attributes = self.lib.Attributes(POSITION=self.accessor(mesh.positions, "VEC3"))
        place = self.gltf.accessors[attributes.POSITION]  # glTF requires the bounds of positions
        place.min, place.max = mesh.positions.min(0).tolist(), mesh.positions.max(0).tolist()
        attributes.NORMAL = None if mesh.normals is None else self.accessor(_unit(mesh.normals), "VEC3")
        attributes.TEXCOORD_0 = None if mesh.uv is None else self.accessor(mesh.uv, "VEC2")
        indices = self.accessor(mesh.faces.astype(kind).reshape(-1, 1), "SCALAR")
        return self.lib.Primitive(attributes=attributes, indices=indices, mode=None, material=self.material(mesh))

    def accessor(self, values: NDArray[Any], kind: str) -> int:
        is_corner = kind == "SCALAR"
        view = self.view(values.tobytes(), self.lib.ELEMENT_ARRAY_BUFFER if is_corner else self.lib.ARRAY_BUFFER)
        component = {"f": self.lib.FLOAT, "H": self.lib.UNSIGNED_SHORT, "I": self.lib.UNSIGNED_INT}[values.dtype.char]
        known = {"bufferView": view, "componentType": component, "count": len(values), "type": kind}
        self.gltf.accessors.append(self.lib.Accessor(**known, **dict.fromkeys(("byteOffset", "normalized"))))
        return len(self.gltf.accessors) - 1

    def view(self, data: bytes, target: int | None) -> int:
        self.blob += bytes(-len(self.blob) % 4)
        self.gltf.bufferViews.append(
            self.lib.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), target=target)
        )
        self.blob += data
        return len(self.gltf.bufferViews) - 1

    def material(self, mesh: Mesh) -> int | None:
        said: dict[str, Any] = write_material(mesh.material)
        if mesh.shading not in ("phong", "none"):
            said["shading"] = mesh.shading
        key = (mesh.color, id(mesh.texture), mesh.shading, mesh.material)
        if key == ((1.0, 1.0, 1.0), id(None), "phong", Material()):
            return None
        if key not in self.known:
            # glTF's default metal would reflect no diffuse light in other viewers
            base = self.lib.PbrMetallicRoughness(baseColorFactor=[*mesh.color, 1.0], metallicFactor=0.0)
            base.roughnessFactor = None
            material = self.lib.Material(
                pbrMetallicRoughness=base, doubleSided=True, emissiveFactor=None, alphaMode=None
            )
            material.extras = {"pointshade": said} if said else {}
            if mesh.shading == "none":
                material.extensions = {UNLIT: {}}
            if mesh.texture is not None:
                base.baseColorTexture = self.lib.TextureInfo(index=self.texture(mesh.texture), texCoord=None)
                material.alphaMode = None if mesh.texture.shape[2] == 3 else "MASK"
            self.gltf.materials.append(material)
            self.known[key] = len(self.gltf.materials) - 1
        return self.known[key]

    def texture(self, texture: NDArray[np.uint8]) -> int:
        key = ("texture", id(texture))
        if key not in self.known:
            from PIL import Image  # only here

            file = BytesIO()
            Image.fromarray(texture).save(file, "PNG")
            number = len(self.gltf.images)
            if self.is_binary:
                image = self.lib.Image(bufferView=self.view(file.getvalue(), None), mimeType="image/png")
            else:
                name = f"{self.path.stem}_{number}.png"
                self.files.stage(name).write_bytes(file.getvalue())
                image = self.lib.Image(uri=quote(name))
            self.gltf.images.append(image)
            self.gltf.textures.append(self.lib.Texture(source=number))
            self.known[key] = number
        return self.known[key]

    def finish(self) -> None:
        """Stages the buffer and, last, the file that names all others."""
        gltf = self.gltf
        if self.lights:
            gltf.extensions[LIGHTS] = {"lights": self.lights}
        unlit = any(UNLIT in material.extensions for material in gltf.materials)
        gltf.extensionsUsed = [*([LIGHTS] if self.lights else []), *([UNLIT] if unlit else [])]
        if self.blob:
            gltf.buffers.append(self.lib.Buffer(byteLength=len(self.blob)))
        if self.is_binary:
            text = gltf.gltf_to_json(indent=None).encode()
            self.files.stage(self.path.name).write_bytes(pack(text, bytes(self.blob)))
            return
        if self.blob:
            name = f"{self.path.stem}.bin"
            gltf.buffers[0].uri = quote(name)
            self.files.stage(name).write_bytes(self.blob)
        text = layout(json.loads(gltf.gltf_to_json()))
        self.files.stage(self.path.name).write_text(text, encoding="utf-8")


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals of unit length, as glTF requires. Those that have it already stay as they are."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where((np.abs(length - 1) < 1e-4) | (length == 0), normals, normals / np.maximum(length, 1e-30))
