"""Writes a scene as glTF: one glTF node for each node, and more below it for content that one cannot hold."""

from __future__ import annotations

import re
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_path, check_type
from ...scene.appearance import Material
from ...scene.cloud import PointCloud
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.light import UPPER_LEFT, Light
from ...scene.node import Node
from ...scene.objects import Mesh, PointObject
from ..access.atomic_write import FileSet, check_place, name_key, naming_written
from ..access.content import FilePath
from ..access.written_suffixes import SCENES, check_suffix
from .cameras_and_lights import FLIP, Matrix, Units, light_place, looking_along, write_camera, write_light
from .checks import telling
from .clouds import POINTS, cloud_attributes, cloud_extras, cloud_place
from .container import IMAGE_BASED, LIGHTS
from .document import Document, extras_of
from .environments import write_environment
from .fallbacks import Fallback, write_fallback
from .points import write_points
from .transforms import transform_of, unsheared

NO_NAME = r"\W+"  # not in the names of folders
_LEANING = 0.5  # cosine: a scene whose y points down by as much is turned for other programs
_REACHES = 1e-3, 1e6  # nearest, in radii of the scene, and farthest distance at which lights are matched


def save_scene(path: FilePath, scene: Scene, fallback: Fallback, light_units: Units) -> None:
    """See the package, which imports this module when it is first needed."""
    path, scene = check_path(path), check_type(scene, Scene, "scene")
    if fallback is not None:
        check_choice("fallback", fallback, get_args(get_args(Fallback)[0]))
    check_choice("light_units", light_units, get_args(Units))
    check_suffix(path, SCENES)
    check_place(path)
    with naming_written(path), FileSet(path.parent) as files:
        document = Document(path, files)
        _Writer(document, fallback, light_units).scene(scene)
        document.finish()
        files.commit()


class _Writer:
    def __init__(self, document: Document, fallback: Fallback, units: Units) -> None:
        self.document = document
        self.fallback: Fallback = fallback
        self.units: Units = units
        self.frames: dict[Frame, dict[str, Any]] = {}
        self.folders: set[str] = set()
        self.above: dict[int, int] = {}  # by node: one more above it, where one cannot say a shear

    def scene(self, scene: Scene) -> None:
        """Numbers the nodes from above, each before those below it."""
        self.middle, self.radius = scene.bounds
        self.viewer = scene.framed().pose
        nodes = self.document.gltf["nodes"]
        roots: list[int] = []
        stack: list[tuple[Node, list[int], Matrix, bool]] = [(n, roots, np.eye(4), True) for n in scene.nodes[::-1]]
        while stack:
            node, siblings, above, is_shown = stack.pop()
            world, is_shown = above @ node.transform, is_shown and node.visible
            with telling(f"node {node.name!r}" if node.name else f"node {len(nodes)}"):
                number = self.node(node, world, is_shown)
            siblings.append(self.above.pop(number, number))
            below = nodes[number]["children"]
            stack += [(child, below, world, is_shown) for child in node.children[::-1]]
        said: dict[str, Any] = {}
        if scene.ambient != (1.0, 1.0, 1.0):
            said["ambient"] = list(scene.ambient)
        pose = np.asarray(scene.pose)
        if scene.camera is not None:
            self.document.add("cameras", **write_camera(scene.camera))
            roots.append(self.add_node("camera", pose @ FLIP, camera=0))
        elif not np.array_equal(pose, FLIP):
            said["pose"] = pose.tolist()
        is_turned = bool(roots) and _is_upside_down(scene)
        if is_turned:
            top = self.add_node("y up", FLIP, {"turned": True})
            nodes[top]["children"] = roots
            roots = [top]
        around = None if scene.environment is None else write_environment(scene.environment, self.document.image)
        if around is not None:
            self.document.around.append(around | ({"rotation": [1, 0, 0, 0]} if is_turned else {}))
        extensions = None if around is None else {IMAGE_BASED: {"light": 0}}
        self.document.add("scenes", extensions=extensions, extras=extras_of(said), nodes=roots or None)

    def node(self, node: Node, world: Matrix, is_shown: bool) -> int:
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
        objects: list[tuple[int, PointObject]] = []  # number of the glTF node that holds each
        index = len(self.document.gltf["nodes"])
        if here:
            values["mesh"] = self.mesh(tuple(here))
        if points:
            objects.append((index, points[0]))
            values["extras"] |= self.points(points.pop(0), node.name)
        if lights and np.array_equal(light_place(lights[0]), np.eye(4)) and not _is_viewers(lights[0]):
            values["extensions"] = self.light(lights.pop(0), world, node.shadow)
        self.add_node(node.name, matrix, **values)
        below = self.document.gltf["nodes"][index]["children"]
        shadow = {} if node.shadow else {"shadow": False}
        for item in points:
            below.append(self.add_node("", np.eye(4), shadow | self.points(item, node.name)))
            objects.append((below[-1], item))
        below += [self.add_node("", cloud_place(item), dict(shadow), mesh=self.mesh((item,))) for item in clouds]
        below += [self.below(item, world) for item in lights]
        if self.fallback and is_shown:
            for holder, item in objects:
                children = write_fallback(self.document, item, self.frames, self.fallback)
                held = self.document.gltf["nodes"][holder]["children"]
                held += [
                    self.add_node(f"{node.name} {self.fallback}".lstrip(), place, {"fallback": True}, mesh=mesh)
                    for mesh, place in children
                ]
        return index

    def add_node(self, name: str, matrix: Matrix, extras: dict[str, Any] | None = None, **values: Any) -> int:
        place, above = transform_of(matrix), None
        if place is None:
            above, matrix = unsheared(matrix)
            place = transform_of(matrix) or {}
        values |= {"extras": extras_of(extras or {})} | place
        index = self.document.add("nodes", name=name or None, **values, children=[])
        if above is not None:
            self.above[index] = self.add_node("", above, {"sheared": True})
            self.document.gltf["nodes"][self.above[index]]["children"].append(index)
        return index

    def points(self, points: PointObject, name: str) -> dict[str, Any]:
        folders = [self.folder(name) for _ in points.frames]
        files = self.document.files
        return write_points(points, files.folder, folders, files.stage, self.frames)

    def folder(self, name: str) -> str:
        """A new name for a frame's folder."""
        path = self.document.path  # of room.gltf and room.glb each
        file = path.name.replace(".", "_") if self.document.is_binary else path.stem
        plain = f"{file}_{re.sub(NO_NAME, '_', name) or 'points'}"
        folder, k = plain, 1
        while name_key(folder) in self.folders:
            k += 1
            folder = f"{plain}_{k}"
        self.folders.add(name_key(folder))
        return folder

    def below(self, light: Light, world: Matrix) -> int:
        """A light that its node cannot hold: it looks another way, or stands elsewhere."""
        place, extras, held = light_place(light), None, self.light(light, world, True)
        if _is_viewers(light):
            towards = np.linalg.solve(world[:3, :3], self.viewer[:3, :3] @ UPPER_LEFT)
            place, extras = looking_along(towards), {"content": True}
        return self.add_node("", place, extras, extensions=held)

    def light(self, light: Light, world: Matrix, node_casts: bool) -> dict[str, Any]:
        reach = np.clip(self.distance(light, world), _REACHES[0] * self.radius, _REACHES[1]).item()
        self.document.lights.append(write_light(light, node_casts, reach, self.units))
        return {LIGHTS: {"light": len(self.document.lights) - 1}}

    def distance(self, light: Light, world: Matrix) -> float:
        """Return how far a light is from the middle of what the scene draws; 1 of one without a position."""
        if light.position is None:
            return 1.0
        return float(np.linalg.norm(world[:3, :3] @ light.position + world[:3, 3] - self.middle))

    def mesh(self, things: tuple[Mesh | PointCloud, ...]) -> int:
        known = self.document.known
        if things not in known:
            primitives = [self.triangles(one) if isinstance(one, Mesh) else self.cloud(one) for one in things]
            known[things] = self.document.add("meshes", primitives=primitives)
        return known[things]

    def triangles(self, mesh: Mesh) -> dict[str, Any]:
        document, picture = self.document, mesh.texture
        attributes = document.attributes(mesh.normals, {"POSITION": mesh.positions})
        if mesh.uv is not None:
            attributes["TEXCOORD_0"] = document.accessor(mesh.uv)
        texture = None if picture is None else document.texture(picture)
        has_alpha = picture is not None and picture.shape[2] == 4
        return {
            "attributes": attributes,
            "indices": document.corners(mesh.faces, len(mesh.positions)),
            "material": document.material(mesh.material, mesh.shading, mesh.color, texture, has_alpha),
        }

    def cloud(self, cloud: PointCloud) -> dict[str, Any]:
        primitive = {"mode": POINTS, "attributes": self.document.attributes(cloud.normals, cloud_attributes(cloud))}
        is_plain = cloud.shading == "phong" and cloud.material == Material()
        material = None if is_plain else self.document.material(cloud.material, cloud.shading)
        beside = {"material": material, "extras": extras_of(cloud_extras(cloud))}
        return primitive | {key: value for key, value in beside.items() if value is not None}


def _is_drawn(thing: Mesh | PointCloud) -> bool:
    return len(thing.faces if isinstance(thing, Mesh) else thing) > 0


def _is_at_zero(cloud: PointCloud) -> bool:
    """Return whether a glTF node can hold these points in its own axes."""
    return np.array_equal(cloud_place(cloud), np.eye(4))


def _is_viewers(light: Light) -> bool:
    """Return whether a light has no place and no direction: it shines from the viewer's upper left."""
    return light.position is None and light.direction is None


def _is_upside_down(scene: Scene) -> bool:
    """Return whether the world's y points down, where glTF's points up: in the picture, or by a cloud's own up."""
    for placed in scene.things:
        if isinstance(placed.content, PointCloud):
            up: NDArray[np.float64] = placed.rigid_axes[0][:3, :3] @ placed.content.up_direction
            return bool(up[1] < -_LEANING)
    return bool(scene.pose[1, 1] > _LEANING)
