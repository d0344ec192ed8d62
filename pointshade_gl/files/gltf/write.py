"""Writes a scene as glTF: one glTF node for each node, and more below it for content that one cannot hold."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ...messages.validation import check_path, check_type
from ...scene.appearance import NOT_LIT, Material
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.light import Light
from ...scene.mesh import Mesh
from ...scene.node import Node
from ...scene.point_cloud import PointCloud
from ...scene.point_object import PointObject
from ..access.atomic_write import FileSet, check_place, naming_written
from ..access.content import FilePath
from ..access.written_suffixes import SCENES, check_suffix
from .cameras_and_lights import FLIP, Matrix, light_place, write_camera, write_light
from .checks import telling
from .clouds import POINTS, cloud_attributes, cloud_extras, cloud_place
from .container import IMAGE_BASED, LIGHTS, UNLIT, pack
from .environments import write_environment
from .points import write_material, write_points
from .transforms import transform_of

NO_NAME = r"\W+"  # not in the names of folders
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # numbers of OpenGL
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {"f": 5126, "H": 5123, "I": 5125}  # by NumPy's type


def save_scene(path: FilePath, scene: Scene) -> None:
    """See the package, which imports this module when it is first needed."""
    path, scene = check_path(path), check_type(scene, Scene, "scene")
    check_suffix(path, SCENES)
    check_place(path)
    with naming_written(path), FileSet(path.parent) as files:
        writer = _Writer(path, files)
        writer.scene(scene)
        writer.finish()
        files.commit()


class _Writer:
    def __init__(self, path: Path, files: FileSet) -> None:
        self.gltf: dict[str, list[dict[str, Any]]] = defaultdict(list)  # numbered parts
        self.path, self.files = path, files
        self.is_binary = path.suffix.lower() == ".glb"
        self.blob = bytearray()
        self.lights: list[dict[str, Any]] = []
        self.around: list[dict[str, Any]] = []  # image-based lights
        self.frames: dict[Frame, dict[str, Any]] = {}
        self.folders: set[str] = set()
        self.known: dict[Any, int] = {}  # numbers of the parts that several nodes share: meshes, materials, pictures

    def scene(self, scene: Scene) -> None:
        """Numbers the nodes from above, each before those below it."""
        nodes = self.gltf["nodes"]
        roots: list[int] = []
        stack: list[tuple[Node, list[int]]] = [(node, roots) for node in scene.nodes[::-1]]
        while stack:
            node, siblings = stack.pop()
            with telling(f"node {node.name!r}" if node.name else f"node {len(nodes)}"):
                siblings.append(self.node(node))
            below = nodes[siblings[-1]]["children"]
            stack += [(child, below) for child in node.children[::-1]]
        said: dict[str, Any] = {}
        if scene.ambient != (1.0, 1.0, 1.0):
            said["ambient"] = list(scene.ambient)
        pose = np.asarray(scene.pose)
        if scene.camera is not None:
            self.add("cameras", **write_camera(scene.camera))
            roots.append(self.add_node("camera", pose @ FLIP, camera=0))
        elif not np.array_equal(pose, FLIP):
            said["pose"] = pose.tolist()
        around = None if scene.environment is None else write_environment(scene.environment, self.image)
        self.around += [] if around is None else [around]
        extensions = None if around is None else {IMAGE_BASED: {"light": 0}}
        self.add("scenes", extensions=extensions, extras=_extras(said), nodes=roots or None)

    def add(self, kind: str, **values: Any) -> int:
        """Adds a part without the values that are None. Returns its number."""
        self.gltf[kind].append({key: value for key, value in values.items() if value is not None})
        return len(self.gltf[kind]) - 1

    def node(self, node: Node) -> int:
        """One of our nodes with its content, without its children."""
        contents = node.content if isinstance(node.content, tuple) else (node.content,)
        here = [item for item in contents if isinstance(item, Mesh | PointCloud) and _is_drawn(item)]
        clouds = [item for item in here if isinstance(item, PointCloud) and not _is_at_zero(item)]
        matrix = node.transform
        if len(clouds) == len(contents) == 1 and not node.children:
            matrix = matrix @ cloud_place(clouds.pop())
        here = [item for item in here if item not in clouds]
        points = [item for item in contents if isinstance(item, PointObject)]
        lights = [item for item in contents if isinstance(item, Light)]
        switches = {name: False for name in ("visible", "shadow") if not getattr(node, name)}
        values: dict[str, Any] = {"extras": dict(switches)}
        if here:
            values["mesh"] = self.mesh(tuple(here))
        if points:
            values["extras"] |= self.points(points.pop(0), node.name)
        if lights and np.array_equal(light_place(lights[0]), np.eye(4)):
            values["extensions"] = self.light(lights.pop(0), node.shadow)
        index = self.add_node(node.name, matrix, **values)
        below = self.gltf["nodes"][index]["children"]
        shadow = {} if node.shadow else {"shadow": False}
        below += [self.add_node("", np.eye(4), extras=shadow | self.points(item, node.name)) for item in points]
        below += [self.add_node("", cloud_place(item), extras=dict(shadow), mesh=self.mesh((item,))) for item in clouds]
        below += [self.add_node("", light_place(item), extensions=self.light(item, True)) for item in lights]
        return index

    def add_node(self, name: str, matrix: Matrix, extras: dict[str, Any] | None = None, **values: Any) -> int:
        values |= {"extras": _extras(extras or {})} | transform_of(matrix)
        return self.add("nodes", name=name or None, **values, children=[])

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

    def mesh(self, things: tuple[Mesh | PointCloud, ...]) -> int:
        if things not in self.known:
            primitives = [self.triangles(one) if isinstance(one, Mesh) else self.cloud(one) for one in things]
            self.known[things] = self.add("meshes", primitives=primitives)
        return self.known[things]

    def triangles(self, mesh: Mesh) -> dict[str, Any]:
        kind = np.uint16 if len(mesh.positions) < 0xFFFF else np.uint32
        attributes = self.attributes(mesh.normals, {"POSITION": mesh.positions})
        if mesh.uv is not None:
            attributes["TEXCOORD_0"] = self.accessor(mesh.uv)
        indices = self.accessor(mesh.faces.astype(kind).reshape(-1, 1), ELEMENT_ARRAY_BUFFER)
        material = self.material(mesh, mesh.color, mesh.texture)
        return {"attributes": attributes, "indices": indices} | ({} if material is None else {"material": material})

    def cloud(self, cloud: PointCloud) -> dict[str, Any]:
        primitive = {"mode": POINTS, "attributes": self.attributes(cloud.normals, cloud_attributes(cloud))}
        beside = {"material": self.material(cloud), "extras": _extras(cloud_extras(cloud))}
        return primitive | {key: value for key, value in beside.items() if value is not None}

    def attributes(self, normals: NDArray[np.float32] | None, held: dict[str, NDArray[Any]]) -> dict[str, int]:
        at = held["POSITION"]
        bounds = {"max": at.max(0).tolist(), "min": at.min(0).tolist()}  # glTF requires them
        numbers = {key: self.accessor(one, **(bounds if one is at else {})) for key, one in held.items()}
        return numbers | ({} if normals is None else {"NORMAL": self.accessor(_unit(normals))})

    def accessor(self, values: NDArray[Any], target: int = ARRAY_BUFFER, **beside: Any) -> int:
        view, kind = self.view(values.tobytes(), target), KINDS[values.shape[1]]
        component = COMPONENTS[values.dtype.char]
        if kind == "VEC4":  # colours
            beside["normalized"] = True
        return self.add("accessors", bufferView=view, componentType=component, count=len(values), type=kind, **beside)

    def view(self, data: bytes, target: int | None) -> int:
        self.blob += bytes(-len(self.blob) % 4)
        start = len(self.blob)
        self.blob += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), target=target)

    def material(
        self,
        thing: Mesh | PointCloud,
        color: tuple[float, float, float] = (1.0, 1.0, 1.0),
        texture: NDArray[np.uint8] | None = None,
    ) -> int | None:
        said: dict[str, Any] = write_material(thing.material)
        if thing.shading not in ("phong", "none"):
            said["shading"] = thing.shading
        key = (color, id(texture), thing.shading, thing.material)
        if key == ((1.0, 1.0, 1.0), id(None), "phong", Material()):
            return None
        if key not in self.known:
            # glTF's default metal would reflect no diffuse light in other viewers
            base: dict[str, Any] = {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0}
            if texture is not None:
                base["baseColorTexture"] = {"index": self.texture(texture)}
            self.known[key] = self.add(
                "materials",
                extensions={UNLIT: {}} if thing.shading in NOT_LIT else None,
                extras=_extras(said),
                pbrMetallicRoughness=base,
                alphaMode="MASK" if texture is not None and texture.shape[2] == 4 else None,
                doubleSided=True,
            )
        return self.known[key]

    def texture(self, texture: NDArray[np.uint8]) -> int:
        key = ("texture", id(texture))
        if key not in self.known:
            self.known[key] = self.add("textures", source=self.image(texture))
        return self.known[key]

    def image(self, picture: NDArray[np.uint8]) -> int:
        from PIL import Image  # only here

        file = BytesIO()
        Image.fromarray(picture).save(file, "PNG")
        if self.is_binary:
            return self.add("images", mimeType="image/png", bufferView=self.view(file.getvalue(), None))
        name = f"{self.path.stem}_{len(self.gltf['images'])}.png"
        self.files.stage(name).write_bytes(file.getvalue())
        return self.add("images", uri=quote(name))

    def finish(self) -> None:
        """Stages the buffer and, last, the file that names all others."""
        binary = f"{self.path.stem}.bin"
        if self.blob:
            self.add("buffers", uri=None if self.is_binary else quote(binary), byteLength=len(self.blob))
        if self.is_binary:
            text = json.dumps(self.document(), allow_nan=False).encode()
            self.files.stage(self.path.name).write_bytes(pack(text, bytes(self.blob)))
            return
        if self.blob:
            self.files.stage(binary).write_bytes(self.blob)
        self.files.stage(self.path.name).write_text(_lines(self.document()) + "\n", encoding="utf-8")

    def document(self) -> dict[str, Any]:
        """The whole file as JSON has it, without empty lists, in the order in which people read: bytes last."""
        for node in self.gltf["nodes"]:
            if not node["children"]:
                del node["children"]
        held = {name: {"lights": some} for name, some in ((LIGHTS, self.lights), (IMAGE_BASED, self.around)) if some}
        used = {**held, UNLIT: any("extensions" in one for one in self.gltf["materials"])}
        said: dict[str, Any] = {"asset": {"generator": "pointshade_gl", "version": "2.0"}}
        said |= {"extensionsUsed": [name for name, is_used in used.items() if is_used], "scene": 0}
        said |= {kind: self.gltf[kind] for kind in ("scenes", "nodes", "cameras")}
        said |= {"extensions": held} if held else {}
        said |= {kind: self.gltf[kind] for kind in ("meshes", "materials")} | self.gltf
        return {key: value for key, value in said.items() if value != []}


def _lines(value: Any, indent: str = "") -> str:
    """JSON with one line for each short value and for each part of a list."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = indent + "  "
    if len(text) <= 100 or not isinstance(value, dict | list):
        return text
    if isinstance(value, list):
        lines = [json.dumps(item, ensure_ascii=False) for item in value]
    else:
        lines = [f"{json.dumps(key)}: {_lines(item, inner)}" for key, item in value.items()]
    begin, end = "[]" if isinstance(value, list) else "{}"
    return begin + ",".join(f"\n{inner}{line}" for line in lines) + f"\n{indent}{end}"


def _extras(said: dict[str, Any]) -> dict[str, Any] | None:
    return {"pointshade": said} if said else None


def _is_drawn(thing: Mesh | PointCloud) -> bool:
    return len(thing.faces if isinstance(thing, Mesh) else thing) > 0


def _is_at_zero(cloud: PointCloud) -> bool:
    """Return whether a glTF node can hold these points in its own axes."""
    return np.array_equal(cloud_place(cloud), np.eye(4))


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals of unit length, as glTF requires. Those that have it already stay as they are."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where((np.abs(length - 1) < 1e-4) | (length == 0), normals, normals / np.maximum(length, 1e-30))
